# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the panels."""

from __future__ import annotations

import bpy

from . import messages


class TYNDALL_OT_copy_report(bpy.types.Operator):
    """Copy all messages of the last render to the clipboard."""

    bl_idname = "tyndall.copy_report"
    bl_label = "Copy report"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only if there is something to copy."""
        return bool(messages.last(context.scene.name).rows())

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy."""
        context.window_manager.clipboard = messages.last(context.scene.name).text()
        return {"FINISHED"}


def register() -> None:
    """Add the operators."""
    bpy.utils.register_class(TYNDALL_OT_copy_report)


def unregister() -> None:
    """Remove them."""
    bpy.utils.unregister_class(TYNDALL_OT_copy_report)

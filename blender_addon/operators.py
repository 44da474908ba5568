# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the panels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import tyndall

from . import cache, final, messages

if TYPE_CHECKING:
    from pathlib import Path


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


class TYNDALL_OT_train_cache(bpy.types.Operator):
    """Render this frame and learn its guiding cache from nothing."""

    bl_idname = "tyndall.train_cache"
    bl_label = "Train"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only if there is a file to learn for."""
        return _file(context) is not None

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Render as F12 does."""
        cache.train_next(context.scene)
        return bpy.ops.render.render("INVOKE_DEFAULT")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Render and wait, for scripts."""
        cache.train_next(context.scene)
        return bpy.ops.render.render()


class _OfWrittenCache:
    """What operators share that need the guiding cache's file."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only if there is one."""
        file = _file(context)
        return file is not None and file.is_file()

    def _cancel(self, why: str) -> set[str]:
        self.report({"ERROR"}, f"Tyndall: {why}")
        return {"CANCELLED"}


class TYNDALL_OT_inspect_cache(_OfWrittenCache, bpy.types.Operator):
    """Tell what the guiding cache holds, and how much of it fits the scene as viewports show it."""

    bl_idname = "tyndall.inspect_cache"
    bl_label = "Inspect"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Read the scene as a render does, and compare."""
        try:
            worth = final.what_the_cache_is_worth(context.evaluated_depsgraph_get())
        except (final.RenderFailure, cache.PathError, tyndall.Error) as error:
            return self._cancel(str(error))
        cache.remember_worth(context.scene, worth)
        if context.scene.render.use_motion_blur:
            self.report({"WARNING"}, "Tyndall: motion blur is not looked at: what moves is called changed")
        self.report({"INFO"}, "\n".join(cache.lines(context.scene, context.view_layer)))
        return {"FINISHED"}


class TYNDALL_OT_clear_cache(_OfWrittenCache, bpy.types.Operator):
    """Delete the guiding cache's file."""

    bl_idname = "tyndall.clear_cache"
    bl_label = "Clear"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first."""
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Delete what is a cache, and nothing else."""
        file = _file(context)
        try:
            tyndall.read_cache_info(file)
            file.unlink()
        except (tyndall.FileError, OSError) as error:
            return self._cancel(f"not deleted: {error}")
        return {"FINISHED"}


def _file(context: bpy.types.Context) -> Path | None:
    try:
        return cache.file_of(context.scene, context.view_layer)
    except cache.PathError:
        return None


_CLASSES = (TYNDALL_OT_copy_report, TYNDALL_OT_train_cache, TYNDALL_OT_inspect_cache, TYNDALL_OT_clear_cache)


def register() -> None:
    """Add the operators."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Remove them."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)

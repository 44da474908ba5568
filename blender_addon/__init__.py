# SPDX-License-Identifier: GPL-3.0-or-later
"""Tyndall in Blender: render engine, settings, panels.

Translation only: what is seen is described to `tyndall.RenderDelegate`, which renders it.
"""

from __future__ import annotations

import atexit

from . import engine, operators, properties, ui

_MODULES = (properties, operators, engine, ui)


def register() -> None:
    """Make the engine known to Blender."""
    for module in _MODULES:
        module.register()
    # Blender 4.2 crashes and 4.5 hangs at exit while an engine class of Python's is registered.
    atexit.register(unregister)


def unregister() -> None:
    """Take everything back that `register` did."""
    atexit.unregister(unregister)
    for module in reversed(_MODULES):
        module.unregister()

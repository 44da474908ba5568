"""USD front end of Tyndall: a stage is walked once and described to the render delegate, prim by prim.

Examples
--------
>>> import tyndall, tyndall_usd
>>> stage = tyndall_usd.open_stage("shot.usda")
>>> delegate = tyndall.RenderDelegate()
>>> index = tyndall_usd.SceneIndex(stage, delegate)
>>> index.sync(tyndall_usd.first_time(stage))
>>> scene = delegate.commit()
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tyndall.messages import Messages

    from tyndall_usd.scene_index import SceneIndex
    from tyndall_usd.stage import first_time, open_stage

__version__ = "0.1.0"
__all__ = ["Messages", "SceneIndex", "first_time", "open_stage"]

_MODULES = {
    "Messages": "messages",
    "SceneIndex": "scene_index",
    "first_time": "stage",
    "open_stage": "stage",
}


def __getattr__(name: str) -> object:
    """Import on first use: the command line's help and errors need no USD."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)

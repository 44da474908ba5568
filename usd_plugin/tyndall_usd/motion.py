"""What moves while the shutter is open and is not blurred: told, prim by prim."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pxr import Sdf, Usd, UsdGeom

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pxr import Gf
    from tyndall.messages import Messages

#: Of more prims only the number is told.
_MAX_NAMED = 20
_ACTION = "it is drawn as it is at the frame's own time; only cameras are blurred"
#: Attributes that change the shape of a prim.
_SHAPES = ("points", "positions", "orientations", "scales", "filePath", "radius", "size", "height")


def report_unblurred(
    stage: Usd.Stage, paths: Iterable[str], interval: Gf.Interval, messages: Messages
) -> None:
    """Name the prims among `paths` that change within `interval`."""
    opened, closed = (UsdGeom.XformCache(at) for at in (interval.min, interval.max))
    n_found = 0
    for path in paths:
        prim = stage.GetPrimAtPath(path) if Sdf.Path.IsValidPathString(path) else None
        if not prim or not UsdGeom.Imageable(prim):
            continue
        what = None
        if opened.GetLocalToWorldTransform(prim) != closed.GetLocalToWorldTransform(prim):
            what = "it moves while the shutter is open"
        elif any(_changes(prim.GetAttribute(name), interval) for name in _SHAPES):
            what = "its shape changes while the shutter is open"
        if what is None:
            continue
        n_found += 1
        if n_found <= _MAX_NAMED:
            messages.warning(path, what, _ACTION)
    if n_found > _MAX_NAMED:
        messages.warning("", f"{n_found - _MAX_NAMED} more prims move while the shutter is open", _ACTION)


def _changes(attribute: Usd.Attribute, interval: Gf.Interval) -> bool:
    """Return whether the values at both ends differ; a held value may change between samples unseen."""
    if not attribute or not attribute.ValueMightBeTimeVarying():
        return False
    first, last = (attribute.Get(at) for at in (interval.min, interval.max))
    return bool(first != last)

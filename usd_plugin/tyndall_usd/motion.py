"""Motion while the shutter is open: where things are then, and what is not blurred, prim by prim."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdVol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from tyndall.messages import Messages
    from tyndall.prims import Matrix

#: Of more prims only the number is told.
_MAX_NAMED = 20
_ACTION = "it is drawn as it is at the frame's own time; only transforms of surfaces and cameras are blurred"
#: Attributes that change the shape of a prim.
_SHAPES = ("points", "filePath", "radius", "size", "height", "width", "length")
#: What simulations call the velocity of their grids.
_VELOCITY_FIELDS = frozenset({"velocity", "vel", "v"})
#: The stretches of a shutter whose middles are looked at first, and how often one is halved.
_FIRST_PARTS = 4
_MAX_HALVINGS = 5
#: The core interpolates matrices linearly. An arc is followed to this part of the motion and of the object.
_TOLERANCE = 1e-3
#: A key that others give to this part is none.
_ROUNDING = 1e-9


@dataclass(slots=True)
class Mover:
    """Something whose transforms, shape (..., 4, 4), vary in time, and the prims whose samples decide."""

    at: Callable[[Usd.TimeCode], Matrix]
    prims: Sequence[Usd.Prim]

    def after(self, first: Matrix) -> Mover:
        """Return what `first` transforms before."""
        return Mover(lambda time: self.at(time) @ first, self.prims)

    def keys(self, interval: Gf.Interval) -> list[tuple[float, Matrix]]:
        """Return where it is at times in [0, 1] of `interval`, so that lines between them follow the motion.

        Empty if it stands still, or if its number changes.
        """
        times = {interval.min + interval.GetSize() * i / _FIRST_PARTS for i in range(_FIRST_PARTS + 1)}
        for prim in self.prims:
            times.update(_sample_times(prim, interval))
        known = {time: self.at(Usd.TimeCode(time)) for time in times}
        if len({matrices.shape for matrices in known.values()}) > 1:
            return []
        scale = _Scale.of(known.values())
        self._refine(known, sorted(times), scale)
        keys = _without_repetition([(time, known[time]) for time in sorted(known)], scale)
        return [((time - interval.min) / interval.GetSize(), matrices) for time, matrices in keys]

    def _refine(self, known: dict[float, Matrix], times: list[float], scale: _Scale) -> None:
        """Halve the stretches between `times` that are no straight lines."""
        pending = [(first, last, 0) for first, last in pairwise(times)]
        while pending:
            first, last, depth = pending.pop()
            middle = (first + last) / 2
            here = self.at(Usd.TimeCode(middle))
            straight = (known[first] + known[last]) / 2
            if here.shape != straight.shape or scale.error(here, straight) <= _TOLERANCE:
                continue
            known[middle] = here
            if depth < _MAX_HALVINGS:
                pending += [(first, middle, depth + 1), (middle, last, depth + 1)]


@dataclass(slots=True)
class _Scale:
    """What errors of matrices are compared with: their linear parts, and how far they go."""

    linear: float
    way: float

    @classmethod
    def of(cls, matrices: Iterable[Matrix]) -> _Scale:
        stack = np.stack(list(matrices))
        places = stack[..., :3, 3]
        way = np.ptp(places, axis=0).max(initial=0.0)
        # Places are rounded too.
        return cls(
            linear=float(np.abs(stack[..., :3, :3]).max(initial=0.0)) or 1.0,
            way=float(max(way, 1e-9 * np.abs(places).max(initial=0.0))) or 1.0,
        )

    def error(self, a: Matrix, b: Matrix) -> float:
        difference = np.abs(a - b)
        linear = difference[..., :3, :3].max(initial=0.0) / self.linear
        return float(max(linear, difference[..., :3, 3].max(initial=0.0) / self.way))


def _sample_times(prim: Usd.Prim, interval: Gf.Interval) -> set[float]:
    """Return the times within `interval` at which transforms of `prim` or above it have samples."""
    times: set[float] = set()
    if prim.IsA(UsdGeom.PointInstancer):
        for name in ("positions", "orientations", "scales"):
            times.update(prim.GetAttribute(name).GetTimeSamplesInInterval(interval))
    while prim:
        if UsdGeom.Xformable(prim):
            times.update(UsdGeom.Xformable(prim).GetTimeSamplesInInterval(interval))
        prim = prim.GetParent()
    return times


def _without_repetition(keys: list[tuple[float, Matrix]], scale: _Scale) -> list[tuple[float, Matrix]]:
    """Return `keys` without those that lie on the line between their neighbours."""
    if all(np.array_equal(keys[0][1], key[1]) for key in keys):
        return []
    kept = [keys[0]]
    for (time, matrices), (later, following) in pairwise(keys[1:]):
        before, start = kept[-1]
        share = (time - before) / (later - before)
        if scale.error(matrices, start + (following - start) * share) > _ROUNDING:
            kept.append((time, matrices))
    return [*kept, keys[-1]]


def report_unblurred(
    stage: Usd.Stage, paths: Iterable[str], interval: Gf.Interval, messages: Messages
) -> None:
    """Name the prims among `paths` that change within `interval` and are not blurred by it."""
    opened, closed = (UsdGeom.XformCache(at) for at in (interval.min, interval.max))
    n_found = 0
    for path in paths:
        prim = stage.GetPrimAtPath(path) if Sdf.Path.IsValidPathString(path) else None
        if not prim or not UsdGeom.Imageable(prim):
            continue
        what = None
        moves = opened.GetLocalToWorldTransform(prim) != closed.GetLocalToWorldTransform(prim)
        if moves and not _is_surface(prim):
            what = "it moves while the shutter is open"
        elif any(_changes(prim.GetAttribute(name), interval) for name in _SHAPES):
            what = "its shape changes while the shutter is open"
        elif _has_velocity(prim):
            what = "its velocities are not supported"
        if what is None:
            continue
        n_found += 1
        if n_found <= _MAX_NAMED:
            messages.warning(path, what, _ACTION)
    if n_found > _MAX_NAMED:
        messages.warning("", f"{n_found - _MAX_NAMED} more prims move while the shutter is open", _ACTION)


def _is_surface(prim: Usd.Prim) -> bool:
    return bool(UsdGeom.Gprim(prim)) and not prim.IsA(UsdVol.Volume)


def _has_velocity(prim: Usd.Prim) -> bool:
    """Return whether a mesh has velocities of its points, or a volume a field of them."""
    if prim.IsA(UsdVol.Volume):
        names = (prop.GetName() for prop in prim.GetPropertiesInNamespace("field"))
        return any(name.removeprefix("field:").lower() in _VELOCITY_FIELDS for name in names)
    velocities = prim.GetAttribute("velocities")
    return bool(velocities and velocities.HasAuthoredValue() and prim.IsA(UsdGeom.PointBased))


def _changes(attribute: Usd.Attribute, interval: Gf.Interval) -> bool:
    """Return whether the values at both ends differ; a held value may change between samples unseen."""
    if not attribute or not attribute.ValueMightBeTimeVarying():
        return False
    first, last = (attribute.Get(at) for at in (interval.min, interval.max))
    return bool(first != last)

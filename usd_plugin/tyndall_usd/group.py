"""Prims that are stored once and drawn at many places."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tyndall_usd.motion import Mover

if TYPE_CHECKING:
    from pxr import Gf, Sdf, Usd
    from tyndall.prims import Matrix


@dataclass(slots=True)
class Drawable:
    """A prim to be read, with its place in its group, and whether that varies in time."""

    prim: Usd.Prim
    family: str
    matrix: Gf.Matrix4d
    varies: bool
    inherited_primvars: list[Any]


@dataclass(slots=True)
class Use:
    """Placements of a group, shape (n, 4, 4), at the time of the reading; those that vary have a mover."""

    matrices: Matrix
    mover: Mover | None = None

    def at(self, time: Usd.TimeCode | None) -> Matrix:
        """Return the placements at `time`, or at that of the reading."""
        return self.matrices if time is None or self.mover is None else self.mover.at(time)


@dataclass(slots=True, eq=False)
class Group:
    """Prims stored once.

    Parameters
    ----------
    path : str
        Unique name; the prims keep the paths they have on the stage, plus `suffix`.
    anchor : Sdf.Path
        Transforms of prims below are relative to it.
    uses : dict
        Placements by the group they are in (``None``: the stage).
    """

    path: str
    anchor: Sdf.Path
    suffix: str = ""
    uses: dict[Group | None, list[Use]] = field(default_factory=dict)
    drawables: list[Drawable] = field(default_factory=list)

    @property
    def instancer_path(self) -> str:
        """Path of the delegate's instancer."""
        return f"{self.path}.instancer"

    def placements(self, time: Usd.TimeCode | None = None) -> Matrix:
        """Return every placement in the world, shape (n, 4, 4)."""
        parts = []
        for outer, uses in self.uses.items():
            here = _concatenate(uses, time)
            if outer is not None:
                here = (outer.placements(time)[:, None] @ here[None]).reshape(-1, 4, 4)
            parts.append(here)
        return np.concatenate(parts)

    def is_within(self, other: Group) -> bool:
        """Return whether this group is `other` or is drawn, however indirectly, as part of it."""
        return self is other or any(outer is not None and outer.is_within(other) for outer in self.uses)

    def instances(self, time: Usd.TimeCode | None = None) -> tuple[Matrix, str | None]:
        """Return the placements and the parent instancer; one that is met in several places is flattened."""
        if len(self.uses) == 1:
            ((outer, uses),) = self.uses.items()
            return _concatenate(uses, time), None if outer is None else outer.instancer_path
        return self.placements(time), None

    def mover(self) -> Mover | None:
        """Return where the instances are at other times; ``None`` if they stand still."""
        movers = self._movers(is_flat=len(self.uses) > 1)
        if not movers:
            return None
        return Mover(lambda time: self.instances(time)[0], [prim for mover in movers for prim in mover.prims])

    def _movers(self, *, is_flat: bool) -> list[Mover]:
        """Return the movers of the placements, and of all groups around it if those count too."""
        movers = [use.mover for uses in self.uses.values() for use in uses if use.mover is not None]
        if is_flat:
            for outer in self.uses:
                movers += [] if outer is None else outer._movers(is_flat=True)
        return movers


def _concatenate(uses: list[Use], time: Usd.TimeCode | None) -> Matrix:
    return np.concatenate([use.at(time) for use in uses])


def stacked(rows: list[Matrix]) -> Matrix:
    """Return matrices, one each, as shape (n, 4, 4)."""
    return np.array(rows, dtype=np.float64).reshape(-1, 4, 4)

"""The render delegate: what a front end talks to (Hydra's shape, reduced to data)."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Literal, TypeAlias

from tyndall import _core, prims

if TYPE_CHECKING:
    from collections.abc import Callable

    from tyndall.prims import Prim

Severity: TypeAlias = Literal["info", "warning", "error"]


class DirtyBits(enum.IntFlag):
    """What changed about a prim since its last sync; the names and bits of ``tyndall-scene``."""

    NONE = 0
    TRANSFORM = enum.auto()
    TOPOLOGY = enum.auto()
    POINTS = enum.auto()
    PRIMVARS = enum.auto()
    MATERIAL_ID = enum.auto()
    VISIBILITY = enum.auto()
    FIELD = enum.auto()
    PARAMS = enum.auto()
    CAMERA = enum.auto()
    SETTINGS = enum.auto()
    INSTANCES = enum.auto()
    ALL = (1 << 11) - 1


class RenderDelegate:
    """Receives prims by path and commits them to immutable scenes.

    Examples
    --------
    >>> delegate = RenderDelegate()
    >>> delegate.sync("/ball", prims.Shape(kind="sphere", params={"radius": 1.0}))
    >>> scene = delegate.commit()
    """

    __slots__ = ("_core", "_sync_by_type")

    def __init__(self) -> None:
        self._core = _core.RenderDelegate()
        self._sync_by_type: dict[type, Callable[[str, object, int], None]] = {
            prims.Mesh: self._core.sync_mesh,
            prims.Shape: self._core.sync_shape,
            prims.Instancer: self._core.sync_instancer,
            prims.Volume: self._core.sync_volume,
            prims.Field: self._core.sync_field,
            prims.Light: self._core.sync_light,
            prims.Material: self._core.sync_material,
            prims.Camera: self._core.sync_camera,
        }

    def sync(self, path: str, prim: Prim, dirty_bits: DirtyBits = DirtyBits.ALL) -> None:
        """Set the prim at `path`; `dirty_bits` says what differs from the last sync.

        Messages about the prim are forgotten: report those that still hold after syncing it.
        """
        sync = self._sync_by_type.get(type(prim))
        if sync is None:
            known = ", ".join(kind.__name__ for kind in self._sync_by_type)
            raise TypeError(f"prim at {path} is a {type(prim).__name__}; it must be one of {known}")
        sync(path, prim, int(dirty_bits))

    def remove(self, path: str) -> bool:
        """Remove the prim at `path`; return whether there was one."""
        return bool(self._core.remove(path))

    def report(self, severity: Severity, path: str, what: str, action: str = "") -> None:
        """Add a message about the prim at `path` (empty: the whole shot) to the diagnostics of the scene."""
        self._core.report(severity, path, what, action)

    def read_ahead(self, path: str, grid: str, index: int | None = None) -> None:
        """Decode a grid of an OpenVDB file that a later commit will ask for, from any thread.

        It is kept until two worlds were built without it. What cannot be read is told when it is asked for.
        """
        self._core.read_ahead(path, grid, index)

    def commit(self) -> _core.Scene:
        """Return the shot as it is now; later syncs do not change it."""
        return self._core.commit()

"""Volumes and the grids that fill them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from .arrays import convert, identity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .arrays import FloatArray, Matrix


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Volume:
    """A medium filled from fields: pairs of the name shaders ask for and the path of the field prim.

    Without a material, extinction is the field ``density`` (or the first) with a grey albedo.
    """

    fields: Sequence[tuple[str, str]]
    material: str | None = None
    world_from_object: Matrix = field(default_factory=identity)
    instancer: str | None = None
    visible: bool = True

    def __post_init__(self) -> None:
        convert(self, "world_from_object", np.float64, 4, 4)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Field:
    """A grid: in a file (`path`, `grid`, `index`) or in memory (`values`, `origin`, `voxel_size`).

    Parameters
    ----------
    world_from_field : ndarray, shape (4, 4), float64
        Applied after the file's own transform.
    path : str or None
        The OpenVDB file; ``None`` if `values` is given.
    grid : str
        Name of the grid in the file.
    index : int or None
        Which of several grids of that name.
    values : ndarray, shape (nx, ny, nz), float32, or None
        Samples along x, y, z; zero outside.
    origin : tuple of 3 float
        Position of sample (0, 0, 0) in field space.
    voxel_size : float
        Distance between samples.
    """

    world_from_field: Matrix = field(default_factory=identity)
    path: str | None = None
    grid: str = ""
    index: int | None = None
    values: FloatArray | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    voxel_size: float = 1.0

    def __post_init__(self) -> None:
        convert(self, "world_from_field", np.float64, 4, 4)
        if (self.path is None) == (self.values is None):
            raise ValueError("a field needs either path or values")
        if self.values is not None:
            convert(self, "values", np.float32, None, None, None)

"""Cameras."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from .arrays import convert, identity

if TYPE_CHECKING:
    from .arrays import Matrix
    from .motion import TransformKey


Projection: TypeAlias = Literal["perspective", "orthographic"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Camera:
    """A camera looking along its local -z with +y up.

    `aperture` and `aperture_offset` have the unit of `focal_length` for perspective and are in stage units
    for orthographic; `lens_radius`, `focus_distance` and `clipping_range` are in stage units. A radius of 0
    is a pinhole. `motion` says where it is while the shutter is open, in the order of time; between two keys
    it goes straight and turns evenly.
    """

    world_from_camera: Matrix = field(default_factory=identity)
    motion: tuple[TransformKey, ...] = ()
    projection: Projection = "perspective"
    aperture: tuple[float, float] = (36.0, 24.0)
    aperture_offset: tuple[float, float] = (0.0, 0.0)
    focal_length: float = 50.0
    lens_radius: float = 0.0
    focus_distance: float = 1.0
    clipping_range: tuple[float, float] = (0.0, float("inf"))
    exposure_scale: float = 1.0

    def __post_init__(self) -> None:
        convert(self, "world_from_camera", np.float64, 4, 4)

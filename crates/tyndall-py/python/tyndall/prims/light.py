"""Lights."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from .arrays import convert, identity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .arrays import Matrix


LightKind: TypeAlias = Literal["sphere", "rect", "disk", "cylinder", "distant", "dome"]
ConeProfile: TypeAlias = Literal["angle", "cosine", "honeycomb"]


@dataclass(frozen=True, slots=True)
class Shaping:
    """Restricts the directions of a light (UsdLuxShapingAPI); the cone's half angle is in degrees.

    Towards its edge, light fades by smoothstep of the angle (UsdLux) or of its cosine (Blender's spots), or
    linearly in its tangent as behind a honeycomb, where a card keeps its power (Blender's spread).
    """

    focus: float = 0.0
    focus_tint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cone_angle: float = 90.0
    cone_softness: float = 0.0
    cone_profile: ConeProfile = "angle"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Light:
    """A light with UsdLux's parameters and units; colour temperature is already multiplied into `color`.

    `params` by kind: sphere {radius, as_point}; rect {width, height, texture}; disk {radius}; cylinder
    {length, radius, as_line}; distant {angle in degrees}; dome {texture}. `texture` is a file path and absent
    if there is none. Rays go on behind lights that are not `opaque`, having gained their radiance; camera
    rays pass those that are not `camera_visible`, and those at infinity leave the image black there.
    """

    kind: LightKind
    params: Mapping[str, float | bool | str] = field(default_factory=dict)
    world_from_light: Matrix = field(default_factory=identity)
    intensity: float = 1.0
    exposure: float = 0.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    normalize: bool = False
    diffuse: float = 1.0
    specular: float = 1.0
    shaping: Shaping = field(default_factory=Shaping)
    visible: bool = True
    camera_visible: bool = True
    opaque: bool = True

    def __post_init__(self) -> None:
        convert(self, "world_from_light", np.float64, 4, 4)

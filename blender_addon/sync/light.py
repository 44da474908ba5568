# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights: watts to UsdLux's units.

Blender's lamps are no obstacles, and the camera sees them only if the object says so. A lamp of P watts has
the radiance P / (pi A), a sun the irradiance of its strength; both were measured against Cycles 5.0.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from tyndall.prims import Light, Shaping

from .. import compat

if TYPE_CHECKING:
    import bpy
    from tyndall.messages import Messages

_ROUND = ("DISK", "ELLIPSE")


def read_light(light: bpy.types.Light, world: np.ndarray, path: str, messages: Messages) -> Light | None:
    """Read a lamp placed by `world`; ``None``, with a message, if it is of an unknown kind."""
    if light.type == "AREA" and getattr(getattr(light, "cycles", None), "is_portal", False):
        messages.info(path, "portals are for Cycles", "it does not shine, there as here")
        return None
    match light.type:
        case "POINT" | "SPOT":
            read = _read_point(light, world)
        case "AREA":
            read = _read_area(light, world)
        case "SUN":
            read = _read_sun(light, world)
        case other:
            messages.error(path, f"lights of type {other} are not supported", "it does not shine")
            return None
    _report_unsupported(light, path, messages)
    return read


def _common(light: bpy.types.Light) -> dict[str, object]:
    return {
        "color": compat.light_color(light),
        "opaque": False,
        "diffuse": float(light.diffuse_factor),
        "specular": float(light.specular_factor),
        "normalize": compat.is_normalized(light),
    }


def _read_point(light: bpy.types.Light, world: np.ndarray) -> Light:
    radius = float(light.shadow_soft_size)
    common = _common(light)
    intensity = light.energy / math.pi
    if radius == 0.0 and not common["normalize"]:
        # Without a size to divide by, Cycles takes P / pi as the intensity; ours is a quarter of the number.
        intensity, common["normalize"] = 4.0 * intensity, True
    shaping = Shaping()
    if light.type == "SPOT":
        shaping = Shaping(
            cone_angle=math.degrees(light.spot_size) / 2.0,
            cone_softness=float(light.spot_blend),
            cone_profile="cosine",
        )
    # The size of a lamp does not follow the scale of its object.
    return Light(
        kind="sphere",
        params={"radius": radius, "as_point": radius == 0.0},
        world_from_light=_without_scale(world),
        intensity=intensity,
        shaping=shaping,
        **common,  # type: ignore[arg-type]
    )


def _read_area(light: bpy.types.Light, world: np.ndarray) -> Light:
    width = float(light.size)
    height = float(light.size_y) if light.shape in ("RECTANGLE", "ELLIPSE") else width
    half_spread = math.degrees(light.spread) / 2.0
    shaping = Shaping()
    # Half a degree short of open, Blender's own panel cannot tell it from open either.
    if half_spread < 89.9:
        shaping = Shaping(cone_angle=max(half_spread, 0.05), cone_profile="honeycomb")
    if light.shape in _ROUND:
        kind, params = "disk", {"radius": 0.5}
        world = world @ np.diag([width, height, 1.0, 1.0])
    else:
        kind, params = "rect", {"width": width, "height": height}
    return Light(
        kind=kind,
        params=params,
        world_from_light=world,
        intensity=light.energy / math.pi,
        shaping=shaping,
        **_common(light),  # type: ignore[arg-type]
    )


def _read_sun(light: bpy.types.Light, world: np.ndarray) -> Light:
    return Light(
        kind="distant",
        params={"angle": math.degrees(light.angle)},
        world_from_light=_without_scale(world),
        intensity=float(light.energy),
        **_common(light),  # type: ignore[arg-type]
    )


def _without_scale(world: np.ndarray) -> np.ndarray:
    """Return a placement with axes of length 1."""
    placed = world.copy()
    lengths = np.linalg.norm(placed[:3, :3], axis=0)
    placed[:3, :3] /= np.where(lengths > 0.0, lengths, 1.0)
    return placed


def _report_unsupported(light: bpy.types.Light, path: str, messages: Messages) -> None:
    if light.type in ("POINT", "SPOT") and light.use_soft_falloff and light.shadow_soft_size > 0.0:
        what = "soft falloff shines like a disk that faces whatever it lights"
        messages.info(path, what, "it is a sphere: brighter within a few radii")
    if light.type == "SPOT" and light.use_square:
        messages.warning(path, "square spots are not supported", "it is round")
    if not light.use_shadow:
        messages.warning(path, "lights without shadows are not supported", "it casts shadows")
    tree = compat.node_tree(light)
    if tree is not None and not _is_plain(tree):
        messages.warning(path, "nodes of lights are not supported", "its own colour and power are used")
    if light.volume_factor != 1.0 or light.transmission_factor != 1.0:
        messages.warning(path, "factors for volumes and transmission are not supported", "1 was used")


def _is_plain(tree: bpy.types.NodeTree) -> bool:
    """Return whether nodes change nothing: white emission of strength 1."""
    active = {"ShaderNodeOutputLight", "ShaderNodeEmission"}
    if any(node.bl_idname not in active for node in tree.nodes):
        return False
    return all(
        node.inputs["Strength"].default_value == 1.0
        and tuple(node.inputs["Color"].default_value)[:3] == (1, 1, 1)
        for node in tree.nodes
        if node.bl_idname == "ShaderNodeEmission"
    )

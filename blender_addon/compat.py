# SPDX-License-Identifier: GPL-3.0-or-later
"""Every difference between the supported Blender versions (4.2 to 5.2), and nowhere else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from bpy.types import ID, Light, Material, Scene, ViewLayer, World

#: A new material or world always has a node tree, whatever `use_nodes` says.
_TREES_ALWAYS_COUNT = bpy.app.version >= (5, 0, 0)
#: Blender 5.0 drew other random numbers for Voronoi's cells than those before; ours are of 5.0.
VORONOI_AGREES = bpy.app.version >= (5, 0, 0)


def node_tree(owner: Material | World) -> bpy.types.NodeTree | None:
    """Return the nodes that count; ``None`` if the simple settings do."""
    return owner.node_tree if _TREES_ALWAYS_COUNT or owner.use_nodes else None


def world_of(scene: Scene, layer: ViewLayer) -> World | None:
    """Return the world of a view layer; it may have none, or (since 5.0) one of its own."""
    return (getattr(layer, "world_override", None) or scene.world) if layer.use_sky else None


def light_color(light: Light) -> tuple[float, float, float]:
    """Return colour times temperature (since 4.5) times exposure (since 4.5)."""
    red, green, blue = light.color
    if getattr(light, "use_temperature", False):
        tint = light.temperature_color
        red, green, blue = red * tint[0], green * tint[1], blue * tint[2]
    scale = 2.0 ** getattr(light, "exposure", 0.0)
    return red * scale, green * scale, blue * scale


def is_normalized(light: Light) -> bool:
    """Return whether power is spread over the light's area (the only way before 4.5)."""
    return bool(getattr(light, "normalize", True))


def session_uid(data: ID) -> int:
    """Return what tells data-blocks apart, also across libraries; it does not change while a file is open."""
    return int(data.session_uid)

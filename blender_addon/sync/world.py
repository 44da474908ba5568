# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: background and fog."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from mathutils import Euler
from tyndall.graph import Graph
from tyndall.prims import Light, Material, Prim, Volume

from .. import compat
from ..nodes.tree import own_value, source_of
from .material import output_node, read_volume_output
from .sky import PAINTER

if TYPE_CHECKING:
    from collections.abc import Callable

    import bpy
    from tyndall.messages import Messages

    from .images import ImageFiles

PATH = "/World"
#: Light's axes in Blender's: the image's middle (+Z) is +X, its quarter (+X) is +Y, its pole (+Y) is +Z.
_BLENDER_FROM_DOME = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)


#: Texture coordinates that are the direction of the ray, or the point far away that it meets.
_DIRECTIONS = ("Generated", "Object", "Normal")


@dataclass(frozen=True)
class Background:
    """Radiance from everywhere, perhaps times an image."""

    color: tuple[float, float, float]
    strength: float
    texture: str | None = None
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)


#: Stands for a sky that there is none of.
_GREY = Background((0.5, 0.5, 0.5), 1.0)


def read_world(
    world: bpy.types.World | None,
    *,
    frame: float,
    is_transparent: bool,
    images: ImageFiles,
    messages: Messages,
    when_painted: Callable[[], None] | None = None,
) -> dict[str, Prim]:
    """Return the prims of the world: a dome if it shines, fog if it has any.

    With `when_painted` it does not wait for skies that must be painted; that is called when one is ready.
    """
    if world is None:
        return {}
    prims: dict[str, Prim] = {}
    tree = compat.node_tree(world)
    background: Background | None = Background(tuple(world.color), 1.0)
    if tree is not None:
        output = output_node(tree)
        background = None
        if output is not None:
            try:
                background = _read_background(output, images, messages)
            except _NeedsPaintingError:
                sky = PAINTER.sky_of(world, frame, messages, PATH, when_painted)
                background = _GREY if sky is None else Background((1.0, 1.0, 1.0), 1.0, sky)
            prims.update(_read_fog(output, images, messages))
    if background is not None:
        is_seen = _is_seen_by_camera(world, messages)
        prims[PATH] = _dome(background, camera_visible=is_seen and not is_transparent)
    return prims


def _is_seen_by_camera(world: bpy.types.World, messages: Messages) -> bool:
    """Return whether camera rays see the world; that other rays do not is reported."""
    rays = getattr(world, "cycles_visibility", None)
    if rays is None:
        return True
    hidden = [
        name for name in ("diffuse", "glossy", "transmission", "scatter") if not getattr(rays, name, True)
    ]
    if hidden:
        messages.warning(
            PATH, f"it is hidden from {', '.join(hidden)} rays, which is not supported", "they see it"
        )
    return bool(getattr(rays, "camera", True))


def _dome(background: Background, *, camera_visible: bool) -> Light:
    # The mapping turns the direction before the image is looked up.
    turned = np.eye(4)
    turned[:3, :3] = np.array(Euler(background.turn, "XYZ").to_matrix()).T
    return Light(
        kind="dome",
        params={} if background.texture is None else {"texture": background.texture},
        world_from_light=turned @ _BLENDER_FROM_DOME,
        intensity=background.strength,
        color=background.color,
        camera_visible=camera_visible,
        opaque=False,
    )


def _read_fog(output: bpy.types.Node, images: ImageFiles, messages: Messages) -> dict[str, Prim]:
    graph = Graph()
    volume = read_volume_output(output, PATH, graph=graph, images=images, messages=messages)
    if volume is None:
        return {}
    material = f"{PATH}/fog material"
    return {
        material: Material(nodes=graph.nodes, volume=volume.index),
        f"{PATH}/fog": Volume(fields=[], material=material),
    }


class _NeedsPaintingError(Exception):
    """The nodes are more than a colour or an image."""


def _read_background(output: bpy.types.Node, images: ImageFiles, messages: Messages) -> Background | None:
    """Return a background of one colour or one image, or raise; ``None`` is black."""
    found = source_of(output.inputs["Surface"], ())
    if found is None or not found[0].is_output:
        return None
    node, groups = found[0].node, found[1]
    if node.bl_idname not in ("ShaderNodeBackground", "ShaderNodeEmission"):
        raise _NeedsPaintingError
    strength = _constant(node.inputs["Strength"], groups)
    color = source_of(node.inputs["Color"], groups)
    if color is None:
        return None
    socket, groups = color
    if not socket.is_output or socket.node.bl_idname == "ShaderNodeRGB":
        red, green, blue, _ = socket.default_value
        return Background((red, green, blue), strength)
    if socket.node.bl_idname == "ShaderNodeTexEnvironment":
        return _read_environment(socket.node, groups, strength, images, messages)
    raise _NeedsPaintingError


def _read_environment(
    node: bpy.types.Node,
    groups: tuple[bpy.types.Node, ...],
    strength: float,
    images: ImageFiles,
    messages: Messages,
) -> Background:
    texture = None if node.image is None else images.file_of(node.image)
    if texture is None:
        messages.error(PATH, "the environment has no image that can be read", "the sky is magenta")
        return Background((1.0, 0.0, 1.0), strength)
    if node.projection != "EQUIRECTANGULAR":
        raise _NeedsPaintingError
    return Background((1.0, 1.0, 1.0), strength, texture, _turn(node.inputs["Vector"], groups))


def _turn(socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...]) -> tuple[float, float, float]:
    """Return by which angles the directions are turned before an image is looked up."""
    found = source_of(socket, groups)
    if found is None or not found[0].is_output:
        return (0.0, 0.0, 0.0)
    source, groups = found
    mapping = source.node
    if mapping.bl_idname == "ShaderNodeTexCoord" and source.identifier in _DIRECTIONS:
        return (0.0, 0.0, 0.0)
    if mapping.bl_idname != "ShaderNodeMapping" or mapping.vector_type not in ("POINT", "VECTOR"):
        raise _NeedsPaintingError
    is_moved = mapping.vector_type == "POINT" and own_value(mapping.inputs["Location"]) != (0.0, 0.0, 0.0)
    is_scaled = own_value(mapping.inputs["Scale"]) != (1.0, 1.0, 1.0)
    if (
        is_moved
        or is_scaled
        or any(mapping.inputs[name].is_linked for name in ("Location", "Rotation", "Scale"))
    ):
        raise _NeedsPaintingError
    behind = source_of(mapping.inputs["Vector"], groups)
    if (
        behind is None
        or not behind[0].is_output
        or _turn(mapping.inputs["Vector"], groups) != (0.0, 0.0, 0.0)
    ):
        raise _NeedsPaintingError
    x, y, z = own_value(mapping.inputs["Rotation"])
    return x, y, z


def _constant(socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...]) -> float:
    found = source_of(socket, groups)
    if found is None:
        return 1.0
    if not found[0].is_output or found[0].node.bl_idname == "ShaderNodeValue":
        return float(found[0].default_value)
    raise _NeedsPaintingError

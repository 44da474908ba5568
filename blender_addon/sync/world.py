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

if TYPE_CHECKING:
    import bpy
    from tyndall.messages import Messages

    from .images import ImageFiles

PATH = "/World"
#: Light's axes in Blender's: the image's middle (+Z) is +X, its quarter (+X) is +Y, its pole (+Y) is +Z.
_BLENDER_FROM_DOME = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)


@dataclass(frozen=True)
class Background:
    """Radiance from everywhere, perhaps times an image."""

    color: tuple[float, float, float]
    strength: float
    texture: str | None = None
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)


def read_world(
    world: bpy.types.World | None, *, is_transparent: bool, images: ImageFiles, messages: Messages
) -> dict[str, Prim]:
    """Return the prims of the world: a dome if it shines, fog if it has any."""
    if world is None:
        return {}
    prims: dict[str, Prim] = {}
    tree = compat.node_tree(world)
    background = Background(tuple(world.color), 1.0)
    if tree is not None:
        output = output_node(tree)
        background = None if output is None else _read_background(output, images, messages)
        if output is not None:
            prims.update(_read_fog(output, images, messages))
    if background is not None:
        prims[PATH] = _dome(background, is_transparent=is_transparent)
    return prims


def _dome(background: Background, *, is_transparent: bool) -> Light:
    # The mapping turns the direction before the image is looked up.
    turned = np.eye(4)
    turned[:3, :3] = np.array(Euler(background.turn, "XYZ").to_matrix()).T
    return Light(
        kind="dome",
        params={} if background.texture is None else {"texture": background.texture},
        world_from_light=turned @ _BLENDER_FROM_DOME,
        intensity=background.strength,
        color=background.color,
        camera_visible=not is_transparent,
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


def _read_background(output: bpy.types.Node, images: ImageFiles, messages: Messages) -> Background | None:
    found = source_of(output.inputs["Surface"], ())
    if found is None or not found[0].is_output:
        return None
    node, groups = found[0].node, found[1]
    if node.bl_idname not in ("ShaderNodeBackground", "ShaderNodeEmission"):
        messages.warning(PATH, f"node {node.bl_label!r} is not supported in worlds", "the sky is black")
        return None
    strength = _constant(node.inputs["Strength"], groups, 1.0, messages)
    color = source_of(node.inputs["Color"], groups)
    if color is None:
        return None
    socket, groups = color
    if not socket.is_output:
        red, green, blue, _ = socket.default_value
        return Background((red, green, blue), strength)
    if socket.node.bl_idname == "ShaderNodeRGB":
        red, green, blue, _ = socket.default_value
        return Background((red, green, blue), strength)
    if socket.node.bl_idname == "ShaderNodeTexEnvironment":
        return _read_environment(socket.node, groups, strength, images, messages)
    label = socket.node.bl_label
    messages.warning(
        PATH, f"node {label!r} is not supported in worlds", "the sky is grey; bake it to an image"
    )
    return Background((0.5, 0.5, 0.5), strength)


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
        messages.warning(PATH, "mirror balls are not supported", "the image is read as equirectangular")
    turn = (0.0, 0.0, 0.0)
    mapping = source_of(node.inputs["Vector"], groups)
    if mapping is not None and mapping[0].is_output:
        source, groups = mapping
        if source.node.bl_idname == "ShaderNodeMapping":
            x, y, z = own_value(source.node.inputs["Rotation"])
            turn = (x, y, z)
            if source.node.vector_type not in ("POINT", "VECTOR") or source.node.inputs["Rotation"].is_linked:
                messages.warning(PATH, "the sky's mapping is more than a rotation", "the rest is ignored")
        elif source.node.bl_idname != "ShaderNodeTexCoord":
            messages.warning(PATH, f"node {source.node.bl_label!r} turns the sky", "it is ignored")
    return Background((1.0, 1.0, 1.0), strength, texture, turn)


def _constant(
    socket: bpy.types.NodeSocket,
    groups: tuple[bpy.types.Node, ...],
    default: float,
    messages: Messages,
) -> float:
    found = source_of(socket, groups)
    if found is None:
        return default
    if not found[0].is_output or found[0].node.bl_idname == "ShaderNodeValue":
        return float(found[0].default_value)
    messages.warning(PATH, "the strength of the world varies", f"{default:g} was used")
    return default

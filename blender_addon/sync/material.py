# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials, with a volume part that may be scaled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tyndall.graph import Graph, compact
from tyndall.medium import Medium, add_volume_node
from tyndall.prims import Material, Node, NodeRef

from .. import compat
from ..nodes.media import scaled
from ..nodes.table import CONVERTERS
from ..nodes.tree import SourceNode, Translation

if TYPE_CHECKING:
    import bpy
    from tyndall.messages import Messages

    from .images import ImageFiles

#: What Blender shows objects without a material in.
DEFAULT_PATH = "/__tyndall/default"
DEFAULT = Material(nodes=[Node("diffuse", {"color": (0.8, 0.8, 0.8)})], surface=0)


@dataclass(frozen=True)
class Look:
    """A translated material and the attributes that it reads of meshes."""

    material: Material
    primvars: frozenset[str]


def read_material(
    material: bpy.types.Material,
    path: str,
    *,
    images: ImageFiles,
    messages: Messages,
    has_grids: bool = False,
    volume_scale: float = 1.0,
) -> Look:
    """Translate `material`; coefficients of its volume are multiplied by `volume_scale`."""
    tree = compat.node_tree(material)
    if tree is None:
        return Look(_simple(material), frozenset())
    output = output_node(tree)
    if output is None:
        messages.warning(path, "the material has no output", "it is black")
        return Look(Material(nodes=[_black()], surface=0), frozenset())
    graph, primvars = Graph(), set()
    surface = Translation(path, messages, images, False, False, CONVERTERS, graph, primvars)
    closure = surface.of_socket(output.inputs["Surface"])
    volume = read_volume_output(
        output, path, graph=graph, images=images, messages=messages, has_grids=has_grids, scale=volume_scale
    )
    if output.inputs["Displacement"].is_linked:
        messages.warning(path, "displacement is not supported", "the surface stays smooth")
    if not isinstance(closure, NodeRef):
        closure = None
        if volume is None:
            closure = graph.add("diffuse", color=(0.0, 0.0, 0.0))
    roots = [ref.index for ref in (closure, volume) if ref is not None]
    nodes, index = compact(graph.nodes, roots)
    translated = Material(
        nodes=nodes,
        surface=None if closure is None else index[closure.index],
        volume=None if volume is None else index[volume.index],
    )
    return Look(translated, frozenset(primvars))


def read_volume_output(
    output: bpy.types.Node,
    path: str,
    *,
    graph: Graph,
    images: ImageFiles,
    messages: Messages,
    has_grids: bool = False,
    scale: float = 1.0,
) -> NodeRef | None:
    """Add the ``volume`` node of what is connected to an output's Volume socket."""
    translation = Translation(path, messages, images, True, has_grids, CONVERTERS, graph)
    socket = output.inputs["Volume"]
    medium = translation.of_socket(socket)
    seen = SourceNode(translation, output, socket, ())
    if not isinstance(medium, Medium):
        if socket.is_linked:
            seen.warn("has a volume that is not one", "there is no medium")
        return None
    if scale != 1.0:
        medium = scaled(seen, medium, scale)
    return add_volume_node(seen, medium)


def output_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """Return the output that counts: for all engines, else Cycles', else whichever there is."""
    for target in ("ALL", "CYCLES", "EEVEE"):
        output = tree.get_output_node(target)
        if output is not None:
            return output
    return None


def _simple(material: bpy.types.Material) -> Material:
    """Translate a material without nodes: its viewport settings."""
    red, green, blue, _ = material.diffuse_color
    inputs = {
        "diffuseColor": (float(red), float(green), float(blue)),
        "metallic": float(material.metallic),
        "roughness": float(material.roughness),
    }
    return Material(nodes=[Node("preview_surface", inputs)], surface=0)


def _black() -> Node:
    return Node("diffuse", {"color": (0.0, 0.0, 0.0)})

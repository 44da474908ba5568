# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give numbers and colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .tree import Converter, to_number

if TYPE_CHECKING:
    from tyndall.prims import NodeInput

    from .tree import SourceNode

#: Blender's Volume Info, by output: the names of Blender's own grids.
_GRIDS = {"Color": "color", "Density": "density", "Flame": "flame", "Temperature": "temperature"}


class Value(Converter):
    """A number."""

    idname = "ShaderNodeValue"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        return float(node.node.outputs[0].default_value)


class Rgb(Converter):
    """A colour."""

    idname = "ShaderNodeRGB"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        x, y, z, _ = node.node.outputs[0].default_value
        return float(x), float(y), float(z)


class Attribute(Converter):
    """An attribute of the geometry, or a grid of the volume."""

    idname = "ShaderNodeAttribute"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return a primvar or a field."""
        kind = getattr(node.node, "attribute_type", "GEOMETRY")
        if kind != "GEOMETRY":
            node.warn(f"reads attributes of the kind {kind}", "0 was used")
            return 0.0
        return _property(node, node.node.attribute_name)


class ColorAttribute(Converter):
    """A colour attribute of the mesh."""

    idname = "ShaderNodeVertexColor"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return a primvar."""
        return _property(node, node.node.layer_name)


class VolumeInfo(Converter):
    """The grids that Blender's own simulations write."""

    idname = "ShaderNodeVolumeInfo"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return a field."""
        if not node.translation.is_volume:
            node.warn("is used on a surface", "0 was used")
            return 0.0
        return _field(node, _GRIDS[node.output.identifier])


def _field(node: SourceNode, name: str) -> NodeInput:
    if node.translation.has_grids:
        return node.graph.add("field", name=name)
    node.info(f"reads the grid {name!r} of what has no grids", "0 was used")
    return 0.0


def _property(node: SourceNode, name: str) -> NodeInput:
    if not name:
        node.warn("names nothing", "0 was used")
        return 0.0
    if node.output.identifier == "Alpha":
        node.warn("is asked for alpha", "1 was used")
        return 1.0
    if node.translation.is_volume:
        return _field(node, name)
    node.translation.primvars.add(name)
    value = node.graph.add("primvar", name=name)
    if node.output.identifier == "Fac":
        return to_number(node.graph, value, "RGBA")
    return value


class Blackbody(Converter):
    """The colour of heat."""

    idname = "ShaderNodeBlackbody"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the graph's node of that name."""
        if node.translation.is_volume:
            node.warn("is used in a volume", "white was used; Principled Volume has a black body of its own")
            return (1.0, 1.0, 1.0)
        return node.graph.add("blackbody", temperature=node.value("Temperature", 6500.0))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give numbers and colours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .tree import Converter, to_number

if TYPE_CHECKING:
    from collections.abc import Callable

    from tyndall.prims import NodeInput

    from .tree import SourceNode

#: Blender's Volume Info, by output: the names of Blender's own grids.
_GRIDS = {"Color": "color", "Density": "density", "Flame": "flame", "Temperature": "temperature"}

_ON_NUMBERS: dict[str, Callable[[float, float, float], float]] = {
    "DIVIDE": lambda a, b, _: a / b if b != 0.0 else 0.0,
    "POWER": lambda a, b, _: a**b if a >= 0.0 or b == int(b) else 0.0,
    "MINIMUM": lambda a, b, _: min(a, b),
    "MAXIMUM": lambda a, b, _: max(a, b),
    "LESS_THAN": lambda a, b, _: float(a < b),
    "GREATER_THAN": lambda a, b, _: float(a > b),
    "ABSOLUTE": lambda a, _, __: abs(a),
    "SQRT": lambda a, _, __: math.sqrt(max(a, 0.0)),
    "EXPONENT": lambda a, _, __: math.exp(min(a, 80.0)),
    "SINE": lambda a, _, __: math.sin(a),
    "COSINE": lambda a, _, __: math.cos(a),
    "ROUND": lambda a, _, __: math.floor(a + 0.5),
    "FLOOR": lambda a, _, __: math.floor(a),
    "CEIL": lambda a, _, __: math.ceil(a),
    "FRACT": lambda a, _, __: a - math.floor(a),
}
_LINEAR = {"ADD": "add", "SUBTRACT": "subtract", "MULTIPLY": "multiply"}


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
        return to_number(node.graph, value, is_volume=False)
    return value


class Math(Converter):
    """Arithmetic on numbers; what varies can be added and multiplied."""

    idname = "ShaderNodeMath"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the result."""
        operation = node.node.operation
        a, b, c = (node.value(name) for name in ("Value", "Value_001", "Value_002"))
        value = self._apply(node, operation, a, b, c)
        if node.node.use_clamp:
            value = clamped(node, value, 0.0, 1.0)
        return value

    @staticmethod
    def _apply(node: SourceNode, operation: str, a: NodeInput, b: NodeInput, c: NodeInput) -> NodeInput:
        combine = node.graph.combine
        if operation in _LINEAR:
            return combine(_LINEAR[operation], a, b)
        if operation == "MULTIPLY_ADD":
            return combine("add", combine("multiply", a, b), c)
        if operation == "DIVIDE" and isinstance(b, float) and b != 0.0:
            return combine("multiply", a, 1.0 / b)
        function = _ON_NUMBERS.get(operation)
        if function and isinstance(a, float) and isinstance(b, float) and isinstance(c, float):
            try:
                return float(function(a, b, c))
            except OverflowError:
                return 0.0
        node.warn(f"computes {operation.lower()} of what varies", "its first input is passed on")
        return a


class VectorMath(Converter):
    """Arithmetic on colours and vectors, as far as it is linear."""

    idname = "ShaderNodeVectorMath"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the result."""
        operation = node.node.operation
        a = node.value("Vector")
        if operation in _LINEAR:
            return node.graph.combine(_LINEAR[operation], a, node.value("Vector_001"))
        if operation == "SCALE":
            return node.graph.combine("multiply", a, node.value("Scale", 1.0))
        node.warn(f"computes {operation.lower()}", "its first input is passed on")
        return a


class Mix(Converter):
    """A mixture of numbers or colours."""

    idname = "ShaderNodeMix"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the mixture."""
        kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.node.data_type, "Color")
        share = node.value("Factor_Float", 0.5)
        if kind == "Vector" and node.node.factor_mode == "NON_UNIFORM":
            share = node.value("Factor_Vector", 0.5)
        blend = node.node.blend_type if kind == "Color" else "MIX"
        a, b = node.value(f"A_{kind}"), node.value(f"B_{kind}")
        if node.node.clamp_factor:
            share = clamped(node, share, 0.0, 1.0)
        value = blended(node, blend, a, b, share)
        return clamped(node, value, 0.0, 1.0) if kind == "Color" and node.node.clamp_result else value


class MixRgb(Converter):
    """The older mixture of colours, which files from before 3.4 have."""

    idname = "ShaderNodeMixRGB"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the mixture."""
        share = clamped(node, node.value("Fac", 0.5), 0.0, 1.0)
        value = blended(node, node.node.blend_type, node.color("Color1"), node.color("Color2"), share)
        return clamped(node, value, 0.0, 1.0) if node.node.use_clamp else value


def blended(node: SourceNode, blend: str, a: NodeInput, b: NodeInput, share: NodeInput) -> NodeInput:
    """Return `a` with `share` of its blend with `b`."""
    combine = node.graph.combine
    match blend:
        case "MIX":
            full = b
        case "ADD" | "SUBTRACT" | "MULTIPLY":
            full = combine(_LINEAR[blend], a, b)
        case _:
            node.warn(f"blends by {blend.lower()}", "the colours are mixed instead")
            full = b
    rest = combine("subtract", 1.0, share)
    return combine("add", combine("multiply", a, rest), combine("multiply", full, share))


def clamped(node: SourceNode, value: NodeInput, low: float, high: float) -> NodeInput:
    """Return `value` limited to an interval."""
    if isinstance(value, float):
        return min(max(value, low), high)
    if isinstance(value, tuple):
        x, y, z = (min(max(v, low), high) for v in value)
        return x, y, z
    if node.translation.is_volume:
        node.info("clamps a grid", "its values are taken to be within the limits")
        return value
    return node.graph.add("clamp", low=low, high=high, **{"in": value})


class Clamp(Converter):
    """A number within limits."""

    idname = "ShaderNodeClamp"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        low, high = node.constant("Min", 0.0), node.constant("Max", 1.0)
        return clamped(node, node.value("Value"), min(low, high), max(low, high))


class MapRange(Converter):
    """A number, mapped linearly from one interval to another."""

    idname = "ShaderNodeMapRange"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        if node.node.data_type != "FLOAT" or node.node.interpolation_type != "LINEAR":
            node.warn("maps vectors, or not linearly", "its input is passed on")
            return node.value("Value")
        low, high = node.constant("From Min", 0.0), node.constant("From Max", 1.0)
        start, end = node.constant("To Min", 0.0), node.constant("To Max", 1.0)
        if low == high:
            return start
        slope = (end - start) / (high - low)
        combine = node.graph.combine
        value = combine("add", combine("multiply", node.value("Value"), slope), start - low * slope)
        return clamped(node, value, min(start, end), max(start, end)) if node.node.clamp else value


class ColorRamp(Converter):
    """A ramp; of two stops if it is to vary."""

    idname = "ShaderNodeValToRGB"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return its colour."""
        ramp, position = node.node.color_ramp, node.value("Fac", 0.5)
        alpha = node.output.identifier == "Alpha"
        if isinstance(position, float):
            x, y, z, w = ramp.evaluate(position)
            return w if alpha else (x, y, z)
        stops = sorted(ramp.elements, key=lambda stop: stop.position)
        if len(stops) != 2 or ramp.interpolation != "LINEAR" or stops[0].position == stops[1].position:
            node.warn("is a ramp of more than two stops", "the ramp from its first to its last is used")
        first, last = stops[0], stops[-1]
        width = max(last.position - first.position, 1e-6)
        combine = node.graph.combine
        share = combine("multiply", combine("subtract", position, first.position), 1.0 / width)
        share = clamped(node, share, 0.0, 1.0)
        if alpha:
            return blended(node, "MIX", float(first.color[3]), float(last.color[3]), share)
        return blended(node, "MIX", _rgb(first.color), _rgb(last.color), share)


def _rgb(color: object) -> tuple[float, float, float]:
    x, y, z = tuple(color)[:3]  # type: ignore[call-overload]
    return float(x), float(y), float(z)


class Blackbody(Converter):
    """The colour of heat."""

    idname = "ShaderNodeBlackbody"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the graph's node of that name."""
        if node.translation.is_volume:
            node.warn("is used in a volume", "white was used; Principled Volume has a black body of its own")
            return (1.0, 1.0, 1.0)
        return node.graph.add("blackbody", temperature=node.value("Temperature", 6500.0))


class Gamma(Converter):
    """A power of a colour that does not vary."""

    idname = "ShaderNodeGamma"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        color, gamma = node.color("Color"), node.constant("Gamma", 1.0)
        if isinstance(color, tuple):
            x, y, z = (max(c, 0.0) ** gamma for c in color)
            return x, y, z
        if gamma != 1.0:
            node.warn("is fed by what varies", "the colour is passed on")
        return color


class Invert(Converter):
    """A colour turned over."""

    idname = "ShaderNodeInvert"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        color = node.color("Color")
        inverse = node.graph.combine("subtract", (1.0, 1.0, 1.0), color)
        return blended(node, "MIX", color, inverse, node.value("Fac", 1.0))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that compute with numbers, colours and vectors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tyndall.prims import Table

from .tree import Converter, to_number

if TYPE_CHECKING:
    from collections.abc import Callable

    from tyndall.prims import NodeInput

    from .tree import SourceNode

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


#: Blender's operations on vectors that work on each coordinate by itself, by the core's name.
_BY_COORDINATE = {
    **{name: name.lower() for name in ("DIVIDE", "SNAP", "FLOOR", "CEIL", "MODULO", "WRAP", "ABSOLUTE")},
    **{name: name.lower() for name in ("MINIMUM", "MAXIMUM", "SINE", "COSINE", "TANGENT", "POWER", "SIGN")},
    "FRACTION": "fract",
    "MULTIPLY_ADD": "multiply_add",
}
_OF_VECTORS = {
    **{name: name.lower() for name in ("LENGTH", "DISTANCE", "NORMALIZE", "PROJECT", "REFLECT")},
    "DOT_PRODUCT": "dot",
    "CROSS_PRODUCT": "cross",
}
_SMOOTH = {"LINEAR": "linear", "STEPPED": "stepped", "SMOOTHSTEP": "smooth", "SMOOTHERSTEP": "smoother"}
#: Colours in a ramp's table: Cycles has as many.
_RAMP_SIZE = 256


class Math(Converter):
    """A function of numbers."""

    idname = "ShaderNodeMath"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the result."""
        a, b, c = (node.value(name) for name in ("Value", "Value_001", "Value_002"))
        value = self._apply(node, node.node.operation, a, b, c)
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
        return node.graph.add("math", function=operation.lower(), in1=a, in2=b, in3=c)


class VectorMath(Converter):
    """A function of vectors."""

    idname = "ShaderNodeVectorMath"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the result."""
        operation = node.node.operation
        a, b = node.value("Vector"), node.value("Vector_001")
        if operation in _LINEAR:
            return node.graph.combine(_LINEAR[operation], a, b)
        if operation == "SCALE":
            return node.graph.combine("multiply", a, node.value("Scale", 1.0))
        if operation in _BY_COORDINATE:
            c = node.value("Vector_002")
            return node.graph.add("math", function=_BY_COORDINATE[operation], in1=a, in2=b, in3=c)
        if operation in _OF_VECTORS:
            return node.graph.add("vector_math", function=_OF_VECTORS[operation], in1=a, in2=b)
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
        case "DARKEN" | "LIGHTEN" | "DIVIDE":
            function = {"DARKEN": "minimum", "LIGHTEN": "maximum", "DIVIDE": "divide"}[blend]
            full = node.graph.add("math", function=function, in1=a, in2=b)
        case "DIFFERENCE":
            full = node.graph.add("math", function="absolute", in1=combine("subtract", a, b))
        case "SCREEN":
            white = (1.0, 1.0, 1.0)
            dark = combine("multiply", combine("subtract", white, a), combine("subtract", white, b))
            full = combine("subtract", white, dark)
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
    return node.graph.add("clamp", low=low, high=high, **{"in": value})


class Clamp(Converter):
    """A number within limits."""

    idname = "ShaderNodeClamp"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        low, high = node.constant("Min", 0.0), node.constant("Max", 1.0)
        if node.node.clamp_type == "RANGE":
            low, high = min(low, high), max(low, high)
        return clamped(node, node.value("Value"), low, high)


class MapRange(Converter):
    """A number or vector, mapped from one interval to another."""

    idname = "ShaderNodeMapRange"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        kind = node.node.interpolation_type
        is_vector = node.node.data_type == "FLOAT_VECTOR"
        names = ("Value", "From Min", "From Max", "To Min", "To Max", "Steps")
        if is_vector:
            names = ("Vector", *(f"{n.replace(' ', '_')}_FLOAT3" for n in names[1:5]), "Steps_FLOAT3")
        value, low, high, start, end, steps = (node.value(name) for name in names)
        return node.graph.add(
            "map_range",
            from_min=low,
            from_max=high,
            to_min=start,
            to_max=end,
            steps=steps,
            interpolation=_SMOOTH[kind],
            clamp="true" if node.node.clamp and kind in ("LINEAR", "STEPPED") else "false",
            **{"in": value},
        )


class ColorRamp(Converter):
    """A colour by position."""

    idname = "ShaderNodeValToRGB"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return its colour, or its alpha."""
        ramp, position = node.node.color_ramp, node.value("Fac", 0.5)
        alpha = node.output.identifier == "Alpha"
        if isinstance(position, float):
            x, y, z, w = ramp.evaluate(position)
            return w if alpha else (x, y, z)
        table = [ramp.evaluate(i / (_RAMP_SIZE - 1)) for i in range(_RAMP_SIZE)]
        color = node.graph.add(
            "ramp",
            colors=Table(tuple(float(c) for color in table for c in color)),
            interpolation="constant" if ramp.interpolation == "CONSTANT" else "linear",
            **{"in": position},
        )
        return node.graph.add("channel", channel="a", **{"in": color}) if alpha else color


class Combine(Converter):
    """A vector of three numbers."""

    idname = "ShaderNodeCombineXYZ"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        x, y, z = (node.value(socket.identifier) for socket in node.node.inputs)
        if isinstance(x, float) and isinstance(y, float) and isinstance(z, float):
            return x, y, z
        return node.graph.add("combine", in1=x, in2=y, in3=z)


class CombineColor(Combine):
    """A colour of three numbers."""

    idname = "ShaderNodeCombineColor"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        _report_mode(node)
        return super().convert(node)


class Separate(Converter):
    """A number of a vector."""

    idname = "ShaderNodeSeparateXYZ"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        index = [socket.identifier for socket in node.node.outputs].index(node.output.identifier)
        value = node.value(node.node.inputs[0].identifier)
        if isinstance(value, float):
            return value
        if isinstance(value, tuple):
            return value[index]
        return node.graph.add("channel", channel="rgb"[index], **{"in": value})


class SeparateColor(Separate):
    """A number of a colour."""

    idname = "ShaderNodeSeparateColor"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        _report_mode(node)
        return super().convert(node)


def _report_mode(node: SourceNode) -> None:
    if node.node.mode != "RGB":
        node.warn(f"works in {node.node.mode}", "red, green and blue are used")


class RgbToBw(Converter):
    """The luminance of a colour."""

    idname = "ShaderNodeRGBToBW"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        return to_number(node.graph, node.color("Color"), "RGBA")


class Gamma(Converter):
    """A power of a colour."""

    idname = "ShaderNodeGamma"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        color, gamma = node.color("Color"), node.value("Gamma", 1.0)
        if isinstance(color, tuple) and isinstance(gamma, float):
            x, y, z = (max(c, 0.0) ** gamma for c in color)
            return x, y, z
        return color if gamma == 1.0 else node.graph.add("math", function="power", in1=color, in2=gamma)


class Invert(Converter):
    """A colour turned over."""

    idname = "ShaderNodeInvert"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return it."""
        color = node.color("Color")
        inverse = node.graph.combine("subtract", (1.0, 1.0, 1.0), color)
        return blended(node, "MIX", color, inverse, node.value("Fac", 1.0))

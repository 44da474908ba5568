"""MaterialX's procedural and mathematical nodes, as far as the core's nodes have the same definition."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall_usd.shading.materialx import convert_texcoord

if TYPE_CHECKING:
    from collections.abc import Callable

    from tyndall.prims import NodeInput

    from tyndall_usd.shading.network import ShaderNode


def convert_position(node: ShaderNode) -> NodeInput:
    """``ND_position_vector3``: in the object's space or on the stage."""
    space = node.text("space", "object")
    if space == "model":
        space = "object"
    if space not in ("object", "world"):
        node.warn(f"space {space!r} is not supported", "the object's is used")
        space = "object"
    return node.graph.add("coordinate", space=space)


def convert_noise(node: ShaderNode) -> NodeInput:
    """``ND_noise2d_float`` and ``ND_noise3d_float``: Perlin noise times an amplitude, plus a pivot."""
    return node.graph.combine("add", _noise(node, octaves=1), node.value_or("pivot", 0.0))


def convert_fractal(node: ShaderNode) -> NodeInput:
    """``ND_fractal2d_float`` and ``ND_fractal3d_float``: a sum of octaves of Perlin noise."""
    return _noise(node, octaves=max(round(node.number("octaves", 3.0)), 1))


def _noise(node: ShaderNode, *, octaves: int) -> NodeInput:
    is_flat = "2d_" in node.node_id
    point = node.value("texcoord" if is_flat else "position")
    if point is None:
        point = convert_texcoord(node) if is_flat else node.graph.add("coordinate", space="object")
    noise = node.graph.add(
        "noise",
        vector=point,
        scale=1.0,
        detail=float(octaves - 1),
        roughness=node.value_or("diminish", 0.5),
        lacunarity=node.value_or("lacunarity", 2.0),
        dimensions="2" if is_flat else "3",
        normalize="false",
    )
    return node.graph.combine("multiply", noise, node.value_or("amplitude", 1.0))


def function(name: str, *inputs: str, defaults: tuple[float, ...] = ()) -> Callable[[ShaderNode], NodeInput]:
    """Return the converter of a node that is the core's `name` of these inputs."""

    def convert(node: ShaderNode) -> NodeInput:
        values = [node.value_or(i, d) for i, d in zip(inputs, defaults or (0.0,) * len(inputs), strict=True)]
        return node.graph.add("math", function=name, **{f"in{n + 1}": v for n, v in enumerate(values)})

    return convert


def vector_function(name: str, *inputs: str) -> Callable[[ShaderNode], NodeInput]:
    """Return the converter of a node that is the core's `name` of one or two vectors."""

    def convert(node: ShaderNode) -> NodeInput:
        values = {f"in{n + 1}": node.value(i) for n, i in enumerate(inputs)}
        return node.graph.add("vector_math", function=name, **values)

    return convert


def convert_combine(node: ShaderNode) -> NodeInput:
    """``ND_combine3_*``: three numbers."""
    return node.graph.add("combine", in1=node.value("in1"), in2=node.value("in2"), in3=node.value("in3"))


def convert_remap(node: ShaderNode) -> NodeInput:
    """``ND_remap_*``: from one interval to another."""
    return node.graph.add(
        "map_range",
        from_min=node.value_or("inlow", 0.0),
        from_max=node.value_or("inhigh", 1.0),
        to_min=node.value_or("outlow", 0.0),
        to_max=node.value_or("outhigh", 1.0),
        **{"in": node.value_or("in", 0.0)},
    )


def convert_smoothstep(node: ShaderNode) -> NodeInput:
    """``ND_smoothstep_*``: from 0 to 1, slow at both ends."""
    low, high = node.value_or("low", 0.0), node.value_or("high", 1.0)
    value = node.value_or("in", 0.0)
    return node.graph.add("map_range", from_min=low, from_max=high, interpolation="smooth", **{"in": value})

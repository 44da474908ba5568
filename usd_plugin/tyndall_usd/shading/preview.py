"""The UsdPreviewSurface specification: surface, texture, primvar readers, 2-D transform."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from tyndall.prims import NodeInput, NodeRef

from tyndall_usd.read.primvar import to_float_rows

if TYPE_CHECKING:
    from tyndall_usd.shading.network import ShaderNode

Vector4: TypeAlias = tuple[float, float, float, float]

_SURFACE_INPUTS = (
    "diffuseColor",
    "emissiveColor",
    "useSpecularWorkflow",
    "specularColor",
    "metallic",
    "roughness",
    "clearcoat",
    "clearcoatRoughness",
    "opacity",
    "opacityMode",
    "opacityThreshold",
    "ior",
    "normal",
)
_WRAPS = ("black", "clamp", "repeat", "mirror", "useMetadata")
_COLOR_SPACES = {"auto": "auto", "sRGB": "sRGB", "raw": "raw"}


def convert_preview_surface(node: ShaderNode) -> NodeInput:
    """``UsdPreviewSurface``: the inputs keep their names."""
    displacement = node.value("displacement")
    if displacement is not None and displacement != 0.0:
        node.warn("displacement is not supported", "the surface stays smooth; use real geometry")
    return node.graph.add("preview_surface", **{name: node.value(name) for name in _SURFACE_INPUTS})


def convert_uv_texture(node: ShaderNode) -> NodeInput:
    """``UsdUVTexture``; the output that is asked for picks the channel."""
    fallback = _vector4(node, "fallback", (0.0, 0.0, 0.0, 1.0))
    path, space = node.file("file")
    if path is None:
        return _channel_of(fallback, node.output)
    scale, bias = _vector4(node, "scale", (1.0, 1.0, 1.0, 1.0)), _vector4(node, "bias", (0.0, 0.0, 0.0, 0.0))
    wrap = {name: _wrap(node.text(name, "useMetadata")) for name in ("wrapS", "wrapT")}
    authored = node.text("sourceColorSpace", "auto")
    color_space = _COLOR_SPACES.get(authored)
    if color_space is None:
        node.warn(f"sourceColorSpace {authored!r} is not known", "the image is read as auto")
        color_space = "auto"
    if color_space == "auto" and space in ("raw", "sRGB"):
        color_space = space
    image = node.graph.add(
        "image",
        file=path,
        st=node.value("st"),
        wrap_s=wrap["wrapS"],
        wrap_t=wrap["wrapT"],
        scale=scale[:3],
        scale_a=scale[3],
        bias=bias[:3],
        bias_a=bias[3],
        fallback=fallback[:3],
        color_space=color_space,
    )
    return channel(node, image, node.output)


def channel(node: ShaderNode, image: NodeRef, output: str) -> NodeInput:
    """Return one channel of `image`, or all of it for an output that is no channel."""
    return (
        node.graph.add("channel", channel=output, **{"in": image})
        if output in ("r", "g", "b", "a")
        else image
    )


def convert_primvar_reader(node: ShaderNode) -> NodeInput | None:
    """``UsdPrimvarReader_*``; in a volume it reads a field."""
    name = node.text("varname")
    fallback = node.value("fallback")
    if not name:
        node.warn("varname is empty", "the fallback is used")
        return fallback
    return read_property(node, name, fallback)


def read_property(node: ShaderNode, name: str, default: NodeInput | None) -> NodeInput:
    """Return a node that reads the primvar `name`, or the field of that name in a volume."""
    constant = None if isinstance(default, (NodeRef, str)) else default
    if not node.network.is_volume:
        return node.graph.add("primvar", name=name, default=constant)
    return node.graph.add(
        "field", name=name, default=constant[0] if isinstance(constant, tuple) else constant
    )


def convert_transform_2d(node: ShaderNode) -> NodeInput:
    """``UsdTransform2d``: scale, then rotate by degrees, then translate."""
    return node.graph.add(
        "transform2d",
        rotation=node.number("rotation", 0.0),
        scale=node.vector("scale", (1.0, 1.0, 0.0)),
        translation=node.vector("translation", (0.0, 0.0, 0.0)),
        **{"in": node.value_or("in", (0.0, 0.0, 0.0))},
    )


def _vector4(node: ShaderNode, name: str, default: Vector4) -> Vector4:
    rows = to_float_rows(node.raw(name))
    if rows is None or rows.shape != (1, 4):
        return default
    x, y, z, w = (float(component) for component in rows[0])
    return x, y, z, w


def _wrap(mode: str) -> str:
    return mode if mode in _WRAPS else "useMetadata"


def _channel_of(rgba: Vector4, output: str) -> NodeInput:
    return rgba["rgba".index(output)] if output in ("r", "g", "b", "a") else rgba[:3]

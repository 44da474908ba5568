"""MaterialX's standard and physically based nodes, as USD names them (``ND_*``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall.prims import NodeInput, NodeRef

from tyndall_usd.shading.preview import channel, read_property

if TYPE_CHECKING:
    from collections.abc import Callable

    from tyndall_usd.shading.network import ShaderNode

_WRAPS = {"constant": "black", "clamp": "clamp", "periodic": "repeat", "mirror": "mirror"}
_CHANNELS = {"outr": "r", "outg": "g", "outb": "b", "outa": "a", "outx": "r", "outy": "g", "outz": "b"}


# Closures


def convert_surface(node: ShaderNode) -> NodeInput | None:
    """``ND_surface``: a closure, an emission and an opacity; without a closure the surface only emits."""
    bsdf, emission, opacity = node.value("bsdf"), node.value("edf"), node.value("opacity")
    if not isinstance(bsdf, NodeRef):
        if node.is_authored("bsdf"):
            return None
        bsdf = node.graph.add("diffuse", color=(0.0, 0.0, 0.0))
    return node.graph.add("surface", bsdf=bsdf, emission=emission, opacity=opacity)


def convert_diffuse(node: ShaderNode) -> NodeInput:
    """``ND_oren_nayar_diffuse_bsdf`` and ``ND_burley_diffuse_bsdf``."""
    return node.graph.add(
        "diffuse",
        color=node.value_or("color", (0.18, 0.18, 0.18)),
        roughness=node.value("roughness"),
        weight=node.value("weight"),
    )


def convert_dielectric(node: ShaderNode) -> NodeInput:
    """``ND_dielectric_bsdf``; its roughness is the pair of microfacet widths."""
    node.ignore_all_but(("ior", "roughness", "tint", "scatter_mode", "weight", "normal", "tangent"))
    return node.graph.add(
        "dielectric",
        ior=node.value("ior"),
        roughness=_microfacet_roughness(node),
        tint=node.graph.combine(
            "multiply", node.value_or("tint", (1.0, 1.0, 1.0)), node.value_or("weight", 1.0)
        ),
        mode=node.text("scatter_mode", "R"),
    )


def convert_conductor(node: ShaderNode) -> NodeInput:
    """``ND_conductor_bsdf``."""
    node.ignore_all_but(("ior", "extinction", "roughness", "weight", "normal", "tangent"))
    return node.graph.add(
        "conductor",
        ior=node.value_or("ior", (0.183, 0.421, 1.373)),
        extinction=node.value_or("extinction", (3.424, 2.346, 1.770)),
        roughness=_microfacet_roughness(node),
    )


def convert_mix_closure(node: ShaderNode) -> NodeInput | None:
    """``ND_mix_bsdf``."""
    background, foreground = node.value("bg"), node.value("fg")
    if not isinstance(background, NodeRef) or not isinstance(foreground, NodeRef):
        return foreground if background is None else background
    return node.graph.add("mix_closure", a=background, b=foreground, mix=node.value_or("mix", 0.0))


def convert_layer(node: ShaderNode) -> NodeInput | None:
    """``ND_layer_bsdf``: only its base is kept."""
    node.warn("layered closures are not supported", "only the base is drawn")
    base = node.value("base")
    return node.value("top") if base is None else base


def convert_edf(node: ShaderNode) -> NodeInput:
    """``ND_uniform_edf``: its colour is the emission."""
    return node.value_or("color", (1.0, 1.0, 1.0))


def _microfacet_roughness(node: ShaderNode) -> NodeInput | None:
    """Return the perceptual roughness of a pair of microfacet widths (its square)."""
    value = node.value("roughness")
    if isinstance(value, tuple):
        if value[0] != value[1]:
            node.warn("anisotropic roughness is not supported", "the mean is used")
        value = 0.5 * (value[0] + value[1])
    return max(value, 0.0) ** 0.5 if isinstance(value, float) else value


# Patterns


def convert_geomprop(node: ShaderNode) -> NodeInput | None:
    """``ND_geompropvalue_*``: a primvar, or a field in a volume."""
    name, default = node.text("geomprop"), node.value("default")
    return read_property(node, name, default) if name else default


def convert_texcoord(node: ShaderNode) -> NodeInput:
    """``ND_texcoord_*``: USD's ``st``."""
    return node.graph.add("primvar", name="st")


def convert_image(node: ShaderNode) -> NodeInput:
    """``ND_image_*`` and ``ND_tiledimage_*``."""
    path, space = node.file("file")
    default = node.value_or("default", (0.0, 0.0, 0.0))
    if path is None:
        return default
    coordinates = node.value("texcoord")
    if coordinates is None:
        coordinates = convert_texcoord(node)
    tiling = node.value("uvtiling")
    if isinstance(tiling, tuple) and tiling[:2] != (1.0, 1.0):
        coordinates = node.graph.add("transform2d", scale=tiling, **{"in": coordinates})
    is_color = "_color" in node.node_id
    is_encoded = space.lower() in ("srgb_texture", "srgb", "srgb_rec709_scene")
    image = node.graph.add(
        "image",
        file=path,
        st=coordinates,
        wrap_s=_WRAPS.get(node.text("uaddressmode", "periodic"), "repeat"),
        wrap_t=_WRAPS.get(node.text("vaddressmode", "periodic"), "repeat"),
        fallback=default if isinstance(default, tuple) else None,
        color_space="sRGB" if is_encoded else "auto" if is_color and not space else "raw",
    )
    if node.node_id.endswith("_float"):
        return channel(node, image, "r")
    return channel(node, image, _CHANNELS.get(node.output, "rgb"))


def convert_constant(node: ShaderNode) -> NodeInput | None:
    """``ND_constant_*`` and nodes that only hand their input on."""
    return node.value("value") if node.is_authored("value") else node.value("in")


def binary(kind: str, neutral: float) -> Callable[[ShaderNode], NodeInput]:
    """Return the converter of ``ND_multiply_*``, ``ND_add_*`` or ``ND_subtract_*``."""

    def convert(node: ShaderNode) -> NodeInput:
        return node.graph.combine(kind, node.value_or("in1", 0.0), node.value_or("in2", neutral))

    return convert


def convert_blackbody(node: ShaderNode) -> NodeInput:
    """``ND_blackbody``: the colour of a temperature, with luminance 1."""
    return node.graph.add("blackbody", temperature=node.value_or("temperature", 6500.0))


def convert_mix(node: ShaderNode) -> NodeInput:
    """``ND_mix_*`` of values."""
    return node.graph.add(
        "mix", bg=node.value_or("bg", 0.0), fg=node.value_or("fg", 0.0), mix=node.value_or("mix", 0.0)
    )


def convert_clamp(node: ShaderNode) -> NodeInput:
    """``ND_clamp_*``."""
    return node.graph.add(
        "clamp", low=node.value("low"), high=node.value("high"), **{"in": node.value_or("in", 0.0)}
    )


def convert_extract(node: ShaderNode) -> NodeInput | None:
    """``ND_extract_*``: one component of a vector."""
    value, index = node.value("in"), int(node.number("index", 0.0))
    if isinstance(value, NodeRef):
        return channel(node, value, "rgba"[min(max(index, 0), 3)])
    return value[min(max(index, 0), 2)] if isinstance(value, tuple) else value


def convert_normal_map(node: ShaderNode) -> NodeInput | None:
    """``ND_normalmap_*``: a tangent-space normal in [0, 1]."""
    value = node.value("in")
    if not isinstance(value, NodeRef):
        return None
    return node.graph.add("normal_map", scale=node.number("scale", 1.0), **{"in": value})

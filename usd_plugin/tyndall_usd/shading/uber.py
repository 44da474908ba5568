"""The large surface models of MaterialX, approximated by the preview surface; ignored inputs are named."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tyndall.prims import NodeInput, NodeRef

if TYPE_CHECKING:
    from tyndall_usd.shading.network import ShaderNode


@dataclass(frozen=True, slots=True)
class UberNames:
    """Input names (and defaults) of one model."""

    base_weight: tuple[str, float]
    base_color: tuple[str, float]
    metalness: str
    roughness: tuple[str, float]
    ior: tuple[str, float]
    coat: str
    coat_roughness: tuple[str, float]
    emission: tuple[str, float]
    emission_color: tuple[str, float]
    opacity: str
    normal: str
    transmission: str
    transmission_color: str

    def all(self) -> tuple[str, ...]:
        """Return every name."""
        names = (getattr(self, name) for name in self.__slots__)
        return tuple(name if isinstance(name, str) else name[0] for name in names)


STANDARD_SURFACE = UberNames(
    base_weight=("base", 1.0),
    base_color=("base_color", 0.8),
    metalness="metalness",
    roughness=("specular_roughness", 0.2),
    ior=("specular_IOR", 1.5),
    coat="coat",
    coat_roughness=("coat_roughness", 0.1),
    emission=("emission", 0.0),
    emission_color=("emission_color", 1.0),
    opacity="opacity",
    normal="normal",
    transmission="transmission",
    transmission_color="transmission_color",
)
OPEN_PBR = UberNames(
    base_weight=("base_weight", 1.0),
    base_color=("base_color", 0.8),
    metalness="base_metalness",
    roughness=("specular_roughness", 0.3),
    ior=("specular_ior", 1.5),
    coat="coat_weight",
    coat_roughness=("coat_roughness", 0.0),
    emission=("emission_luminance", 0.0),
    emission_color=("emission_color", 1.0),
    opacity="geometry_opacity",
    normal="geometry_normal",
    transmission="transmission_weight",
    transmission_color="transmission_color",
)
GLTF_PBR = UberNames(
    base_weight=("", 1.0),
    base_color=("base_color", 1.0),
    metalness="metallic",
    roughness=("roughness", 1.0),
    ior=("ior", 1.5),
    coat="clearcoat",
    coat_roughness=("clearcoat_roughness", 0.0),
    emission=("emissive_strength", 1.0),
    emission_color=("emissive", 0.0),
    opacity="alpha",
    normal="normal",
    transmission="transmission",
    transmission_color="",
)


def convert_standard_surface(node: ShaderNode) -> NodeInput:
    """``ND_standard_surface_surfaceshader``."""
    return _convert(node, STANDARD_SURFACE)


def convert_open_pbr(node: ShaderNode) -> NodeInput:
    """``ND_open_pbr_surface_surfaceshader``."""
    return _convert(node, OPEN_PBR)


def convert_gltf_pbr(node: ShaderNode) -> NodeInput:
    """``ND_gltf_pbr_surfaceshader``."""
    return _convert(node, GLTF_PBR)


def _convert(node: ShaderNode, names: UberNames) -> NodeInput:
    node.ignore_all_but(names.all())
    graph = node.graph

    def get(entry: tuple[str, float]) -> NodeInput:
        return node.value_or(entry[0], entry[1]) if entry[0] else entry[1]

    transmission = node.value(names.transmission)
    if isinstance(transmission, float) and transmission >= 0.5:
        tint = node.value(names.transmission_color) if names.transmission_color else None
        return graph.add(
            "dielectric", ior=get(names.ior), roughness=get(names.roughness), tint=tint, mode="RT"
        )
    if transmission not in (None, 0.0):
        node.warn(f"{names.transmission} below 0.5 or varying is not supported", "the surface is opaque")
    return graph.add(
        "preview_surface",
        diffuseColor=_color(graph.combine("multiply", get(names.base_color), get(names.base_weight))),
        metallic=node.value_or(names.metalness, 1.0 if names is GLTF_PBR else 0.0),
        roughness=get(names.roughness),
        ior=get(names.ior),
        clearcoat=node.value_or(names.coat, 0.0),
        clearcoatRoughness=get(names.coat_roughness),
        emissiveColor=_color(graph.combine("multiply", get(names.emission_color), get(names.emission))),
        opacity=_grey(node, node.value_or(names.opacity, 1.0)),
        normal=node.value(names.normal),
    )


def _color(value: NodeInput) -> NodeInput:
    return (value, value, value) if isinstance(value, float) else value


def _grey(node: ShaderNode, value: NodeInput) -> NodeInput:
    """Return a coloured opacity as its mean."""
    if isinstance(value, tuple):
        return sum(value) / 3.0
    if isinstance(value, NodeRef) and node.graph.node(value).kind == "image":
        return node.graph.add("channel", channel="r", **{"in": value})
    return value

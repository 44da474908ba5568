"""Volume shaders: MaterialX's distributions, and the volume shaders of other renderers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tyndall.prims import NodeInput, NodeRef

from tyndall_usd.shading.graph import Vector, to_vector
from tyndall_usd.shading.network import Medium

if TYPE_CHECKING:
    from tyndall_usd.shading.network import ShaderNode

_ONE: Vector = (1.0, 1.0, 1.0)


def convert_volume(node: ShaderNode) -> Medium | None:
    """``ND_volume``: a distribution and an emission."""
    medium = node.converted("vdf")
    emission = node.value("edf")
    if not isinstance(medium, Medium):
        if emission is None:
            return None
        medium = Medium()
    return Medium(medium.absorption, medium.scattering, medium.anisotropy, emission)


def convert_anisotropic_vdf(node: ShaderNode) -> Medium:
    """``ND_anisotropic_vdf``: Henyey-Greenstein with the mean cosine `anisotropy`."""
    return Medium(
        absorption=node.value_or("absorption", (0.0, 0.0, 0.0)),
        scattering=node.value_or("scattering", (0.0, 0.0, 0.0)),
        anisotropy=node.number("anisotropy", 0.0),
    )


def convert_absorption_vdf(node: ShaderNode) -> Medium:
    """``ND_absorption_vdf``."""
    return Medium(absorption=node.value_or("absorption", (0.0, 0.0, 0.0)))


def convert_karma_volume(node: ShaderNode) -> Medium:
    """Karma's ``kma_volume``: the first lobe."""
    node.ignore_all_but(("absorption", "scattering", "anisotropy", "emission"))
    return Medium(
        absorption=node.value_or("absorption", (0.0, 0.0, 0.0)),
        scattering=node.value_or("scattering", (0.0, 0.0, 0.0)),
        anisotropy=node.number("anisotropy", 0.0),
        emission=node.value("emission"),
    )


def convert_arnold_volume(node: ShaderNode) -> Medium:
    """Arnold's ``standard_volume``: density grid, scatter colour, transparency over a depth."""
    node.ignore_all_but(
        (
            "density",
            "density_channel",
            "scatter",
            "scatter_color",
            "scatter_anisotropy",
            "transparent",
            "transparent_depth",
        )
    )
    transparent = node.vector("transparent", (math.exp(-1.0),) * 3)
    depth = max(node.number("transparent_depth", 1.0), 1e-30)
    x, y, z = (-math.log(min(max(t, 1e-30), 1.0)) / depth for t in transparent)
    albedo = _scaled(node.vector("scatter_color", (0.5, 0.5, 0.5)), node.number("scatter", 1.0))
    extinction = _scaled((x, y, z), node.number("density", 1.0))
    return _from_albedo(node, extinction, albedo, field=node.text("density_channel") or "density")


def convert_renderman_volume(node: ShaderNode) -> Medium:
    """RenderMan's ``PxrVolume``."""
    node.ignore_all_but(
        (
            "densityFloat",
            "densityFloatPrimVar",
            "extinctionMultiplier",
            "diffuseColor",
            "anisotropy",
            "maxDensity",
        )
    )
    extinction = node.number("densityFloat", 1.0) * node.number("extinctionMultiplier", 1.0)
    return _from_albedo(
        node,
        to_vector(extinction),
        node.vector("diffuseColor", _ONE),
        field=node.text("densityFloatPrimVar"),
        anisotropy="anisotropy",
    )


def convert_cycles_volume(node: ShaderNode) -> Medium:
    """Cycles' ``principled_volume``."""
    node.ignore_all_but(("density", "density_attribute", "color", "anisotropy"))
    return _from_albedo(
        node,
        to_vector(node.number("density", 1.0)),
        node.vector("color", (0.5, 0.5, 0.5)),
        field=node.text("density_attribute", "density"),
        anisotropy="anisotropy",
    )


def _from_albedo(
    node: ShaderNode,
    extinction: Vector,
    albedo: Vector,
    *,
    field: str,
    anisotropy: str = "scatter_anisotropy",
) -> Medium:
    scattering = tuple(e * a for e, a in zip(extinction, albedo, strict=True))
    absorption = tuple(e * (1.0 - a) for e, a in zip(extinction, albedo, strict=True))
    density: NodeInput = node.graph.add("field", name=field) if field else 1.0
    return Medium(
        absorption=node.graph.combine("multiply", (absorption[0], absorption[1], absorption[2]), density),
        scattering=node.graph.combine("multiply", (scattering[0], scattering[1], scattering[2]), density),
        anisotropy=node.number(anisotropy, 0.0),
    )


def _scaled(vector: Vector, factor: float) -> Vector:
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


def add_volume_node(node: ShaderNode, medium: Medium) -> NodeRef:
    """Append the graph's ``volume`` node; each coefficient is a constant or a constant times one field."""
    return node.graph.add(
        "volume",
        absorption=_coefficient(node, medium.absorption),
        scattering=_coefficient(node, medium.scattering),
        anisotropy=medium.anisotropy,
        emission=None if medium.emission is None else _coefficient(node, medium.emission),
    )


def _coefficient(node: ShaderNode, value: NodeInput) -> NodeInput:
    constant, fields = _factors(node, value)
    if not fields:
        return constant
    if len(fields) > 1:
        node.warn("a coefficient is the product of several fields", "only the first field is used")
    return node.graph.add("multiply", in1=constant, in2=fields[0])


def _factors(node: ShaderNode, value: NodeInput) -> tuple[Vector, list[NodeRef]]:
    """Return the constant factor of a product and the fields in it."""
    if isinstance(value, str):
        return _ONE, []
    if not isinstance(value, NodeRef):
        return to_vector(value), []
    source = node.graph.node(value)
    if source.kind == "field":
        return _ONE, [value]
    if source.kind != "multiply":
        node.warn(
            f"a coefficient is fed by {source.kind!r}",
            "only constants times one field are supported; 0 is used",
        )
        return (0.0, 0.0, 0.0), []
    constant, fields = _ONE, []
    for factor in source.inputs.values():
        part, more = _factors(node, factor)
        constant = (constant[0] * part[0], constant[1] * part[1], constant[2] * part[2])
        fields += more
    return constant, fields

"""Volume shaders: MaterialX's distributions, our own node, and the graph's ``volume`` node they end in.

``tyndall:volume`` has what MaterialX lacks. Its inputs, all per stage unit; those marked * may be connected
to ``ND_geompropvalue_*`` (a field of the volume), times constants:

============================== ===============================================================================
``density`` * (1)              extinction, a number or a colour
``albedo`` (0.5, 0.5, 0.5)     part of the extinction that scatters
``phase``                      ``henyey_greenstein``, ``rayleigh``, ``draine`` or ``droplets``
``anisotropy`` (0)             mean cosine of the first lobe; of Draine's lobe
``anisotropy2``, ``lobeMix``   mean cosine of the second lobe and its part of the light
``alpha`` (1)                  strength of Draine's squared cosine
``dropletDiameter`` (20)       of water droplets, in micrometres
``emission`` *                 radiance per length; a sum may have several fields
``temperature`` *              in kelvin
``blackbodyIntensity`` (1)     radiance per length over ``1e-6 sigma T^4 / pi`` times the colour of T
============================== ===============================================================================
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tyndall.prims import NodeInput, NodeRef

from tyndall_usd.shading.graph import Vector, to_vector
from tyndall_usd.shading.network import Medium

if TYPE_CHECKING:
    from tyndall_usd.shading.network import ShaderNode

_ONE: Vector = (1.0, 1.0, 1.0)
_SCATTERING_INPUTS = ("anisotropy2", "lobeMix", "alpha", "dropletDiameter")


def convert_volume(node: ShaderNode) -> Medium | None:
    """``ND_volume``: a distribution and an emission."""
    medium = node.converted("vdf")
    emission = node.value("edf")
    if not isinstance(medium, Medium):
        return None if emission is None else Medium(emission=emission)
    return replace(medium, emission=emission)


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


def convert_multiply_vdf(node: ShaderNode) -> Medium | None:
    """``ND_multiply_vdfF`` and ``ND_multiply_vdfC``: a distribution times a number or colour."""
    medium, factor = node.converted("in1"), node.value_or("in2", 1.0)
    if not isinstance(medium, Medium):
        return None
    return replace(
        medium,
        absorption=node.graph.combine("multiply", medium.absorption, factor),
        scattering=node.graph.combine("multiply", medium.scattering, factor),
    )


def convert_first_vdf(node: ShaderNode) -> Medium | None:
    """``ND_add_vdf`` and ``ND_mix_vdf``: only one distribution is kept."""
    node.warn("combined distributions are not supported", "only the first is used; see tyndall:volume")
    for name in ("in1", "bg", "in2", "fg"):
        medium = node.converted(name)
        if isinstance(medium, Medium):
            return medium
    return None


def convert_own_volume(node: ShaderNode) -> Medium:
    """``tyndall:volume``; see the top of this file."""
    supported = (
        *("density", "albedo", "phase", "anisotropy", *_SCATTERING_INPUTS),
        *("emission", "temperature", "blackbodyIntensity"),
    )
    node.ignore_all_but(supported)
    scattering_inputs: dict[str, NodeInput] = {}
    if node.is_authored("phase"):
        scattering_inputs["phase"] = node.text("phase")
    for name in _SCATTERING_INPUTS:
        if node.is_authored(name):
            scattering_inputs[name] = node.number(name, 0.0)
    medium = from_albedo(node, node.value_or("density", 1.0), _ONE, node.vector("albedo", (0.5, 0.5, 0.5)))
    return replace(
        medium,
        anisotropy=node.number("anisotropy", 0.0),
        scattering_inputs=scattering_inputs,
        emission=node.value("emission"),
        temperature=node.value("temperature"),
        blackbody_intensity=node.value("blackbodyIntensity"),
    )


def from_albedo(node: ShaderNode, density: NodeInput, extinction: Vector, albedo: Vector) -> Medium:
    """Return the medium with `extinction` times `density`, of which `albedo` scatters."""
    scattering = tuple(e * a for e, a in zip(extinction, albedo, strict=True))
    absorption = tuple(e * (1.0 - a) for e, a in zip(extinction, albedo, strict=True))
    return Medium(
        absorption=node.graph.combine("multiply", (absorption[0], absorption[1], absorption[2]), density),
        scattering=node.graph.combine("multiply", (scattering[0], scattering[1], scattering[2]), density),
    )


def two_lobes(g: float, g2: float, mix: float) -> dict[str, NodeInput]:
    """Return the inputs of a second lobe with the part `mix` of the light; none if it has none."""
    return {} if mix == 0.0 or g == g2 else {"anisotropy2": g2, "lobeMix": mix}


def add_volume_node(node: ShaderNode, medium: Medium) -> NodeRef:
    """Append the graph's ``volume`` node.

    Absorption, scattering and temperature are constants or constants times one field; emission may be a sum.
    """
    emission, temperature = medium.emission, medium.temperature
    if emission is not None and _is_product(node, emission):
        emission = _coefficient(node, emission)
    inputs: dict[str, NodeInput | None] = {
        "absorption": _coefficient(node, medium.absorption),
        "scattering": _coefficient(node, medium.scattering),
        "anisotropy": medium.anisotropy,
        "emission": emission,
        "temperature": None if temperature is None else _coefficient(node, temperature),
        "blackbodyIntensity": medium.blackbody_intensity,
        **medium.scattering_inputs,
    }
    phase = inputs.get("phase", "henyey_greenstein")
    if phase in ("rayleigh", "droplets") and medium.anisotropy == 0.0:
        del inputs["anisotropy"]
    return node.graph.add("volume", **inputs)


def _coefficient(node: ShaderNode, value: NodeInput) -> NodeInput:
    constant, fields = _factors(node, value)
    if not fields:
        return constant
    if len(fields) > 1:
        node.warn("a coefficient is the product of several fields", "only the first field is used")
    return node.graph.add("multiply", in1=constant, in2=fields[0])


def _is_product(node: ShaderNode, value: NodeInput) -> bool:
    """Return whether `value` is made of constants, fields and products."""
    if not isinstance(value, NodeRef):
        return True
    source = node.graph.node(value)
    if source.kind == "multiply":
        return all(_is_product(node, factor) for factor in source.inputs.values())
    return source.kind == "field"


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

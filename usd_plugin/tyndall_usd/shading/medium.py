"""Volume shaders: MaterialX's distributions, our own node, and the graph's ``volume`` node they end in.

``tyndall:volume`` has what MaterialX lacks. Its inputs, all per stage unit; those marked * may be connected
to ``ND_geompropvalue_*`` (a field of the volume), times constants, times a second field: a density times a
colour. Whether a field holds numbers or colours is up to its grid, not to the type of the node:

============================== ===============================================================================
``density`` * (1)              extinction, a number or a colour
``albedo`` * (0.5, 0.5, 0.5)   part of the extinction that scatters
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

import functools
from dataclasses import replace
from typing import TYPE_CHECKING

from tyndall.prims import NodeInput, NodeRef

from tyndall_usd.shading.graph import Vector, to_vector
from tyndall_usd.shading.network import Medium

if TYPE_CHECKING:
    from tyndall_usd.shading.network import ShaderNode

_ONE: Vector = (1.0, 1.0, 1.0)
_GREY: Vector = (0.5, 0.5, 0.5)
_ZERO: Vector = (0.0, 0.0, 0.0)
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
    medium = from_albedo(node, node.value_or("density", 1.0), _ONE, node.value_or("albedo", _GREY))
    return replace(
        medium,
        anisotropy=node.number("anisotropy", 0.0),
        scattering_inputs=scattering_inputs,
        emission=node.value("emission"),
        temperature=node.value("temperature"),
        blackbody_intensity=node.value("blackbodyIntensity"),
    )


def from_albedo(node: ShaderNode, density: NodeInput, extinction: Vector, albedo: NodeInput) -> Medium:
    """Return the medium with `extinction` times `density`, of which `albedo` scatters."""
    if isinstance(albedo, (NodeRef, str)):
        total = node.graph.combine("multiply", extinction, density)
        scattered = node.graph.combine("multiply", total, albedo)
        return Medium(absorption=node.graph.combine("subtract", total, scattered), scattering=scattered)
    albedo = to_vector(albedo)
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

    Absorption and scattering are constants, times one or two fields; temperature has at most one, and
    emission may be any sum of these.
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
    """Return `value` as the sum of products that a ``volume`` node takes; 0 with a message if it is none."""
    terms = _terms(node, value)
    if any(len(fields) > 2 for fields in terms):
        node.warn("a coefficient is the product of several fields", "only the first two fields are used")
        terms = {fields[:2]: constant for fields, constant in terms.items()}
    shared = set.intersection(*({field.index for field in fields} for fields in terms)) if terms else set()
    if len(terms) > 1 and not shared:
        node.warn("a coefficient is fed by 'add' of different fields", "0 is used")
        return _ZERO
    products = [_product(node, constant, fields) for fields, constant in terms.items()]
    return functools.reduce(lambda a, b: node.graph.combine("add", a, b), products) if products else _ZERO


def _product(node: ShaderNode, constant: Vector, fields: tuple[NodeRef, ...]) -> NodeInput:
    product: NodeInput = constant
    for field in fields:
        product = node.graph.add("multiply", in1=product, in2=field)
    return product


def _is_product(node: ShaderNode, value: NodeInput) -> bool:
    """Return whether `value` is made of constants, fields and products."""
    if not isinstance(value, NodeRef):
        return True
    source = node.graph.node(value)
    if source.kind == "multiply":
        return all(_is_product(node, factor) for factor in source.inputs.values())
    return source.kind == "field"


def _terms(node: ShaderNode, value: NodeInput) -> dict[tuple[NodeRef, ...], Vector]:
    """Return the constant factor of every product of fields in a sum."""
    if not isinstance(value, NodeRef):
        return {(): _ONE if isinstance(value, str) else to_vector(value)}
    source = node.graph.node(value)
    if source.kind == "field":
        return {(value,): _ONE}
    if source.kind not in ("multiply", "add", "subtract"):
        node.warn(
            f"a coefficient is fed by {source.kind!r}",
            "only constants times one or two fields are supported; 0 is used",
        )
        return {}
    a, b = _terms(node, source.inputs["in1"]), _terms(node, source.inputs["in2"])
    if source.kind == "multiply":
        pairs = [(f + g, _times(x, y)) for f, x in a.items() for g, y in b.items()]
    else:
        sign = (1.0 if source.kind == "add" else -1.0,) * 3
        pairs = [*a.items(), *((fields, _times(x, sign)) for fields, x in b.items())]
    terms: dict[tuple[NodeRef, ...], Vector] = {}
    for fields, (x, y, z) in pairs:
        key = tuple(sorted(fields, key=lambda field: field.index))
        old = terms.get(key, _ZERO)
        terms[key] = (old[0] + x, old[1] + y, old[2] + z)
    return terms


def _times(a: Vector, b: Vector) -> Vector:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]

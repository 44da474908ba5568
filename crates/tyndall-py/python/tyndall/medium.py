"""Media on their way into the shading graph: what front ends' volume shaders are translated to."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from tyndall.graph import to_vector
from tyndall.prims import NodeInput, NodeRef, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tyndall.graph import Graph, Vector

_ONE: Vector = (1.0, 1.0, 1.0)
_ZERO: Vector = (0.0, 0.0, 0.0)


class GraphNode(Protocol):
    """The source node that is being translated."""

    @property
    def graph(self) -> Graph:
        """The graph it is translated into."""

    def warn(self, what: str, action: str) -> None:
        """Add a message about it."""


@dataclass(frozen=True, slots=True)
class Medium:
    """A volume distribution on its way to a volume terminal: coefficients per stage unit.

    Parameters
    ----------
    scattering_inputs : mapping
        Inputs of the graph's ``volume`` node that choose the phase function.
    temperature : NodeInput or None
        Kelvin, constant or times a field; emits as a black body of `blackbody_intensity`.
    """

    absorption: NodeInput = (0.0, 0.0, 0.0)
    scattering: NodeInput = (0.0, 0.0, 0.0)
    anisotropy: NodeInput = 0.0
    emission: NodeInput | None = None
    scattering_inputs: Mapping[str, NodeInput] = field(default_factory=dict)
    temperature: NodeInput | None = None
    blackbody_intensity: NodeInput | None = None


def from_albedo(node: GraphNode, density: NodeInput, extinction: Vector, albedo: NodeInput) -> Medium:
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


def add_volume_node(node: GraphNode, medium: Medium) -> NodeRef:
    """Append the graph's ``volume`` node.

    Absorption and scattering are constants, times one or two fields; temperature has at most one, and
    emission may be any sum of these. What is made of other nodes is left as it is: the core samples it.
    """
    emission, temperature = medium.emission, medium.temperature
    absorption, scattering = medium.absorption, medium.scattering
    values = (absorption, scattering, temperature, medium.blackbody_intensity)
    if all(value is None or _is_linear(node, value) for value in values):
        if emission is not None and _is_product(node, emission):
            emission = _coefficient(node, emission)
        absorption, scattering = (_coefficient(node, value) for value in (absorption, scattering))
        temperature = None if temperature is None else _coefficient(node, temperature)
    inputs: dict[str, NodeInput | None] = {
        "absorption": absorption,
        "scattering": scattering,
        "anisotropy": medium.anisotropy,
        "emission": emission,
        "temperature": temperature,
        "blackbodyIntensity": medium.blackbody_intensity,
        **medium.scattering_inputs,
    }
    phase = inputs.get("phase", "henyey_greenstein")
    if phase in ("rayleigh", "droplets") and medium.anisotropy == 0.0:
        del inputs["anisotropy"]
    return node.graph.add("volume", **inputs)


def _coefficient(node: GraphNode, value: NodeInput) -> NodeInput:
    """Return `value` as the sum of products that a ``volume`` node takes; 0 with a message if it is none."""
    terms = _terms(node, value)
    if any(len(fields) > 2 for fields in terms):
        node.warn("a coefficient is the product of several fields", "only the first two fields are used")
        terms = {fields[:2]: constant for fields, constant in terms.items()}
    shared = set.intersection(*({field.index for field in fields} for fields in terms)) if terms else set()
    if len(terms) > 1 and () in terms:
        return value
    if len(terms) > 1 and not shared:
        node.warn("a coefficient is fed by 'add' of different fields", "0 is used")
        return _ZERO
    products = [_product(node, constant, fields) for fields, constant in terms.items()]
    return functools.reduce(lambda a, b: node.graph.combine("add", a, b), products) if products else _ZERO


def _product(node: GraphNode, constant: Vector, fields: tuple[NodeRef, ...]) -> NodeInput:
    product: NodeInput = constant
    for factor in fields:
        product = node.graph.add("multiply", in1=product, in2=factor)
    return product


def _is_product(node: GraphNode, value: NodeInput | Table) -> bool:
    """Return whether `value` is made of constants, fields and products."""
    if not isinstance(value, NodeRef):
        return True
    source = node.graph.node(value)
    if source.kind == "multiply":
        return all(_is_product(node, factor) for factor in source.inputs.values())
    return source.kind == "field"


def _is_linear(node: GraphNode, value: NodeInput | Table) -> bool:
    """Return whether `value` is made of constants, fields, sums and products."""
    if not isinstance(value, NodeRef):
        return True
    source = node.graph.node(value)
    if source.kind in ("multiply", "add", "subtract"):
        return all(_is_linear(node, source.inputs[name]) for name in ("in1", "in2"))
    return source.kind == "field"


def _terms(node: GraphNode, value: NodeInput | Table) -> dict[tuple[NodeRef, ...], Vector]:
    """Return the constant factor of every product of fields in a sum."""
    if not isinstance(value, NodeRef):
        return {(): _ONE if isinstance(value, (str, Table)) else to_vector(value)}
    source = node.graph.node(value)
    if source.kind == "field":
        return {(value,): _ONE}
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

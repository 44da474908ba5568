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

from dataclasses import replace
from typing import TYPE_CHECKING

from tyndall.medium import Medium, from_albedo

if TYPE_CHECKING:
    from tyndall.graph import Vector
    from tyndall.prims import NodeInput

    from tyndall_usd.shading.network import ShaderNode

_ONE: Vector = (1.0, 1.0, 1.0)
_GREY: Vector = (0.5, 0.5, 0.5)
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

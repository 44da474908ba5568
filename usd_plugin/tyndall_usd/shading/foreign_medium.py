"""The volume shaders of other renderers, as far as their meaning maps.

Every other authored input is named in a message. Temperatures shine by our formula (``tyndall:volume``),
which is that of Cycles; other renderers scale black bodies in ways of their own.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from tyndall.graph import Vector, to_vector
from tyndall.medium import Medium, from_albedo, two_lobes

if TYPE_CHECKING:
    from tyndall.prims import NodeInput

    from tyndall_usd.shading.network import ShaderNode

_ZERO: Vector = (0.0, 0.0, 0.0)
_ONE: Vector = (1.0, 1.0, 1.0)
_GREY: Vector = (0.5, 0.5, 0.5)


def convert_karma_volume(node: ShaderNode) -> Medium:
    """Karma's ``kma_volume``: MaterialX's distribution and emission with a second lobe."""
    lobe_names, lobes = _second_lobe(node)
    node.ignore_all_but(("absorption", "scattering", "anisotropy", "emission", *lobe_names))
    return Medium(
        absorption=node.value_or("absorption", _ZERO),
        scattering=node.value_or("scattering", _ZERO),
        anisotropy=node.number("anisotropy", 0.0),
        emission=node.value("emission"),
        scattering_inputs=lobes,
    )


def convert_arnold_volume(node: ShaderNode) -> Medium:
    """Arnold's ``standard_volume``: density grid, scatter colour, transparency, emission by mode."""
    mode = node.text("emission_mode", "blackbody")
    # Inputs that the mode does not read are not missed.
    by_mode = {
        "none": (),
        "density": ("emission", "emission_color"),
        "channel": ("emission", "emission_color", "emission_channel"),
        "blackbody": (
            *("emission", "emission_color", "temperature", "temperature_channel"),
            *("blackbody_kelvin", "blackbody_intensity"),
        ),
    }
    node.ignore_all_but(
        (
            *("density", "density_channel", "scatter", "scatter_color", "scatter_anisotropy"),
            *("scatter_secondary_anisotropy", "scatter_secondary_anisotropy_mix"),
            *("transparent", "transparent_depth", "emission_mode"),
            *by_mode.get(mode, ()),
        )
    )
    transparent = node.vector("transparent", (math.exp(-1.0),) * 3)
    depth = max(node.number("transparent_depth", 1.0), 1e-30)
    x, y, z = (-math.log(min(max(t, 1e-30), 1.0)) / depth for t in transparent)
    scatter = node.number("scatter", 1.0)
    albedo = node.graph.combine("multiply", node.value_or("scatter_color", _GREY), (scatter,) * 3)
    density = _field(node, node.text("density_channel") or "density")
    g = node.number("scatter_anisotropy", 0.0)
    medium = replace(
        from_albedo(node, density, _scaled((x, y, z), node.number("density", 1.0)), albedo),
        anisotropy=g,
        scattering_inputs=two_lobes(
            g,
            node.number("scatter_secondary_anisotropy", 0.0),
            node.number("scatter_secondary_anisotropy_mix", 0.0),
        ),
    )
    return _with_arnold_emission(node, medium, mode, density)


def _with_arnold_emission(node: ShaderNode, medium: Medium, mode: str, density: NodeInput) -> Medium:
    color = _scaled(node.vector("emission_color", _ONE), node.number("emission", 1.0))
    combine = node.graph.combine
    if mode == "density":
        return replace(medium, emission=combine("multiply", color, density))
    if mode == "channel":
        channel = _field(node, node.text("emission_channel", "heat"))
        return replace(medium, emission=combine("multiply", color, channel))
    if mode == "blackbody":
        kelvin = node.number("temperature", 1.0) * node.number("blackbody_kelvin", 5000.0)
        return replace(
            medium,
            temperature=combine(
                "multiply", kelvin, _field(node, node.text("temperature_channel", "temperature"))
            ),
            blackbody_intensity=_scaled(color, node.number("blackbody_intensity", 1.0)),
        )
    if mode != "none":
        node.warn(f"emission_mode {mode!r} is not known", "nothing is emitted")
    return medium


def convert_renderman_volume(node: ShaderNode) -> Medium:
    """RenderMan's ``PxrVolume``: density and colour of scattering, two lobes, emission per length."""
    lobe_names, lobes = _second_lobe(node)
    node.ignore_all_but(
        (
            *("densityFloat", "densityFloatPrimVar", "densityColor", "densityColorPrimVar"),
            *("extinctionDistance", "diffuseColor", "emitColor"),
            *("anisotropy", *lobe_names, "maxDensity", "multiScatter"),
        )
    )
    if node.is_authored("multiScatter") and node.number("multiScatter", 1.0) == 0.0:
        node.warn("multiScatter 0 is not supported", "light scatters many times")
    # The density colour, if it is set, takes the place of the number; the distance that of both.
    kind = "Color" if node.is_authored("densityColor") or node.text("densityColorPrimVar") else "Float"
    field, density = node.text(f"density{kind}PrimVar"), node.value_or(f"density{kind}", 1.0)
    distance = node.number("extinctionDistance", 0.0)
    if distance > 0.0:
        field, density = "", 1.0 / distance
    if field:
        density = _field(node, field)
    return replace(
        from_albedo(node, density, _ONE, node.value_or("diffuseColor", _ONE)),
        anisotropy=node.number("anisotropy", 0.0),
        scattering_inputs=lobes,
        emission=node.value("emitColor"),
    )


def convert_cycles_volume(node: ShaderNode) -> Medium:
    """Cycles' ``principled_volume``: coefficients times the density attribute, emission apart from it."""
    node.ignore_all_but(
        (
            *("density", "density_attribute", "color", "absorption_color", "anisotropy"),
            *("emission_strength", "emission_color"),
            *("blackbody_intensity", "blackbody_tint", "temperature", "temperature_attribute"),
        )
    )
    field = node.text("density_attribute", "density")
    density = node.graph.combine("multiply", node.value_or("density", 1.0), _field(node, field))
    # Whatever of the colour does not scatter is absorbed, less what the absorption colour lets pass.
    colored = from_albedo(node, density, _ONE, node.value_or("color", _GREY))
    x, y, z = (max(1.0 - math.sqrt(max(t, 0.0)), 0.0) for t in node.vector("absorption_color", _ZERO))
    strength, heat = node.number("emission_strength", 0.0), node.number("blackbody_intensity", 0.0)
    glow = _scaled(node.vector("emission_color", _ONE), strength)
    medium = Medium(
        absorption=node.graph.combine("multiply", (x, y, z), colored.absorption),
        scattering=colored.scattering,
        anisotropy=node.number("anisotropy", 0.0),
        emission=glow if strength > 0.0 else None,
    )
    if heat <= 0.0:
        return medium
    kelvin = node.value_or("temperature", 1000.0)
    return replace(
        medium,
        temperature=node.graph.combine(
            "multiply", kelvin, _field(node, node.text("temperature_attribute", "temperature"))
        ),
        blackbody_intensity=_scaled(node.vector("blackbody_tint", _ONE), heat),
    )


def _second_lobe(node: ShaderNode) -> tuple[list[str], dict[str, NodeInput]]:
    """Return the inputs beside ``anisotropy`` that describe a second lobe, and what they mean.

    The manuals of Karma and RenderMan name them by their labels, "Secondary Anisotropy" and "Secondary Mix"
    or "Blend"; whatever is authored and spells that is taken.
    """
    others = [name for name in node.authored() if name != "anisotropy"]
    mix = next((name for name in others if name.lower().endswith(("mix", "blend"))), None)
    second = next((name for name in others if "anisotropy" in name.lower() and name != mix), None)
    if second is None or mix is None:
        return [], {}
    g = node.number("anisotropy", 0.0)
    return [second, mix], two_lobes(g, node.number(second, 0.0), node.number(mix, 0.0))


def _field(node: ShaderNode, name: str) -> NodeInput:
    return node.graph.add("field", name=name) if name else 1.0


def _scaled(vector: Vector, factor: float) -> Vector:
    x, y, z = to_vector(vector)
    return x * factor, y * factor, z * factor

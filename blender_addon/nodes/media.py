# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume shaders: coefficients per length, as Cycles has them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from tyndall.graph import to_vector
from tyndall.medium import Medium

from .tree import Converter

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tyndall.graph import Vector
    from tyndall.prims import NodeInput

    from .tree import SourceNode

_ZERO: Vector = (0.0, 0.0, 0.0)
_WHITE: Vector = (1.0, 1.0, 1.0)
_KELVIN = 1000.0


class PrincipledVolume(Converter):
    """Smoke and fire: a density with colours, emission, and a black body."""

    idname = "ShaderNodeVolumePrincipled"

    def convert(self, node: SourceNode) -> Medium:
        """Return the medium.

        What of the colour does not scatter is absorbed, less what the root of the absorption colour lets pass
        (Cycles' shader). Emission does not depend on the density.
        """
        combine = node.graph.combine
        density = combine("multiply", node.value("Density", 1.0), _attribute(node, "Density Attribute"))
        color = combine("multiply", node.color("Color"), _attribute(node, "Color Attribute"))
        absorbed = to_vector(node.constant_color("Absorption Color", _ZERO))
        x, y, z = (max(1.0 - math.sqrt(max(c, 0.0)), 0.0) for c in absorbed)
        emission = combine("multiply", node.color("Emission Color"), node.value("Emission Strength"))
        medium = Medium(
            absorption=combine("multiply", (x, y, z), _unscattered(node, density, color)),
            scattering=combine("multiply", color, density),
            anisotropy=node.constant("Anisotropy", 0.0),
            emission=None if emission == _ZERO else emission,
        )
        return self._with_black_body(node, medium)

    @staticmethod
    def _with_black_body(node: SourceNode, medium: Medium) -> Medium:
        intensity = node.constant("Blackbody Intensity", 0.0)
        if intensity <= 0.0:
            return medium
        tint = node.graph.combine("multiply", node.constant_color("Blackbody Tint", _WHITE), intensity)
        kelvin = node.graph.combine(
            "multiply", node.value("Temperature", _KELVIN), _attribute(node, "Temperature Attribute")
        )
        return replace(medium, temperature=kelvin, blackbody_intensity=tint)


class Absorption(Converter):
    """Absorbs what its colour is not."""

    idname = "ShaderNodeVolumeAbsorption"

    def convert(self, node: SourceNode) -> Medium:
        """Return the medium."""
        density, color = node.value("Density", 1.0), node.color("Color")
        return Medium(absorption=_unscattered(node, density, color))


class Scatter(Converter):
    """Scatters its colour and absorbs nothing."""

    idname = "ShaderNodeVolumeScatter"

    def convert(self, node: SourceNode) -> Medium:
        """Return the medium."""
        scattering = node.graph.combine("multiply", node.color("Color"), node.value("Density", 1.0))
        return _with_phase(node, Medium(scattering=scattering))


class Coefficients(Converter):
    """Everything per length."""

    idname = "ShaderNodeVolumeCoefficients"

    def convert(self, node: SourceNode) -> Medium:
        """Return the medium."""
        emission = node.color("Emission Coefficients")
        medium = Medium(
            absorption=node.color("Absorption Coefficients"),
            scattering=node.color("Scatter Coefficients"),
            emission=None if emission == _ZERO else emission,
        )
        return _with_phase(node, medium)


def _with_phase(node: SourceNode, medium: Medium) -> Medium:
    """Return `medium` with the phase function that the node chooses (only one before Blender 4.3)."""
    phase = getattr(node.node, "phase", "HENYEY_GREENSTEIN")
    match phase:
        case "HENYEY_GREENSTEIN":
            return replace(medium, anisotropy=node.constant("Anisotropy", 0.0))
        case "RAYLEIGH":
            return replace(medium, scattering_inputs={"phase": "rayleigh"})
        case "DRAINE":
            inputs = {"phase": "draine", "alpha": node.constant("Alpha", 0.5)}
            return replace(medium, anisotropy=node.constant("Anisotropy", 0.0), scattering_inputs=inputs)
        case "MIE":
            inputs = {"phase": "droplets", "dropletDiameter": node.constant("Diameter", 20.0)}
            return replace(medium, scattering_inputs=inputs)
    node.warn(f"has the phase function {phase}", "Henyey-Greenstein without anisotropy was used")
    return medium


def _attribute(node: SourceNode, identifier: str) -> NodeInput:
    """Return the field that the text of a socket names; 1 where there is no name, or no such field."""
    socket = next((s for s in node.node.inputs if s.identifier == identifier), None)
    name = "" if socket is None else socket.default_value
    if not name or not node.translation.has_grids:
        return 1.0
    return node.graph.add("field", name=name, default=1.0)


def _unscattered(node: SourceNode, density: NodeInput, color: NodeInput) -> NodeInput:
    """Return the part of the density that is not of the colour."""
    combine = node.graph.combine
    if isinstance(color, (float, tuple)):
        x, y, z = (max(1.0 - c, 0.0) for c in to_vector(color))
        return combine("multiply", (x, y, z), density)
    return combine("subtract", combine("multiply", _WHITE, density), combine("multiply", color, density))


def sum_of_media(node: SourceNode, a: Medium | None, b: Medium | None) -> Medium | None:
    """Return both in one place; one phase function must do for both."""
    if a is None or b is None:
        return a or b
    first, second = (m for m in ((a, b) if scatters(a) else (b, a)))
    if scatters(first) and scatters(second) and _phase(first) != _phase(second):
        node.warn("joins media with different phase functions", "the first one is used for both")
    if a.temperature is not None and b.temperature is not None:
        node.warn("joins two black bodies", "only the first one glows")
    hot = a if a.temperature is not None else b
    combine = node.graph.combine
    return Medium(
        absorption=combine("add", a.absorption, b.absorption),
        scattering=combine("add", a.scattering, b.scattering),
        anisotropy=first.anisotropy,
        scattering_inputs=first.scattering_inputs,
        emission=_sum(node, a.emission, b.emission),
        temperature=hot.temperature,
        blackbody_intensity=hot.blackbody_intensity,
    )


def mix_media(node: SourceNode, a: Medium | None, b: Medium | None, share: NodeInput) -> Medium | None:
    """Return `a` thinned to ``1 - share`` and `b` to `share`, in one place."""
    rest = node.graph.combine("subtract", 1.0, share)
    return sum_of_media(node, _thinned(node, a, rest), _thinned(node, b, share))


def _thinned(node: SourceNode, medium: Medium | None, factor: NodeInput) -> Medium | None:
    return None if medium is None else scaled(node, medium, factor)


def scaled(node: SourceNode, medium: Medium, factor: NodeInput) -> Medium:
    """Return `medium` with all coefficients times `factor`."""

    def times(value: NodeInput | None) -> NodeInput | None:
        return None if value is None else node.graph.combine("multiply", value, factor)

    return replace(
        medium,
        absorption=node.graph.combine("multiply", medium.absorption, factor),
        scattering=node.graph.combine("multiply", medium.scattering, factor),
        emission=times(medium.emission),
        blackbody_intensity=times(medium.blackbody_intensity),
    )


def _sum(node: SourceNode, a: NodeInput | None, b: NodeInput | None) -> NodeInput | None:
    if a is None or b is None:
        return b if a is None else a
    return node.graph.combine("add", a, b)


def scatters(medium: Medium) -> bool:
    """Return whether there is a phase function to speak of."""
    return medium.scattering not in (0.0, _ZERO)


def _phase(medium: Medium) -> tuple[NodeInput, Mapping[str, NodeInput]]:
    return medium.anisotropy, medium.scattering_inputs

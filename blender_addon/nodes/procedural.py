# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures; the core has Blender's own definitions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import compat
from .tree import Converter

if TYPE_CHECKING:
    from tyndall.prims import NodeInput

    from .tree import SourceNode

_FRACTALS = {
    "FBM": "fbm",
    "MULTIFRACTAL": "multifractal",
    "HYBRID_MULTIFRACTAL": "hybrid",
    "RIDGED_MULTIFRACTAL": "ridged",
    "HETERO_TERRAIN": "hetero_terrain",
}
_FEATURES = {"F1": "f1", "F2": "f2", "SMOOTH_F1": "smooth_f1", "DISTANCE_TO_EDGE": "distance_to_edge"}
_OUTPUTS = {"Distance": "distance", "Color": "color", "Position": "position"}
_PROFILES = {"SIN": "sine", "SAW": "saw", "TRI": "triangle"}
_DIRECTIONS = {"X": "x", "Y": "y", "Z": "z", "DIAGONAL": "all", "SPHERICAL": "all"}


def _point(node: SourceNode) -> NodeInput | None:
    """Return the texture's coordinates; ``None`` if nothing is connected: those in the object's box."""
    return node.value("Vector") if node.is_linked("Vector") else None


def _word(*, is_so: bool) -> str:
    return "true" if is_so else "false"


class Noise(Converter):
    """Fractal noise."""

    idname = "ShaderNodeTexNoise"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the graph's node of that name."""
        source = node.node
        return node.graph.add(
            "noise",
            vector=_point(node),
            w=node.value("W"),
            scale=node.value("Scale"),
            detail=node.value("Detail"),
            roughness=node.value("Roughness"),
            lacunarity=node.value("Lacunarity", 2.0),
            offset=node.value("Offset"),
            gain=node.value("Gain", 1.0),
            distortion=node.value("Distortion"),
            fractal=_FRACTALS[getattr(source, "noise_type", "FBM")],
            dimensions=source.noise_dimensions[0],
            normalize=_word(is_so=getattr(source, "normalize", True)),
            output="color" if node.output.type == "RGBA" else "value",
        )


class Voronoi(Converter):
    """Distances to random points."""

    idname = "ShaderNodeTexVoronoi"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the graph's node of that name."""
        source = node.node
        if not compat.VORONOI_AGREES:
            node.warn("has other random numbers before Blender 5.0", "its cells lie where those of 5.0 do")
        if source.voronoi_dimensions != "3D":
            node.warn(f"has {source.voronoi_dimensions[0]} dimensions", "three are used")
        if source.feature not in _FEATURES or node.output.identifier not in _OUTPUTS:
            node.warn(f"is asked for {node.output.name} of {source.feature}", "middle grey was used")
            return 0.5
        return node.graph.add(
            "voronoi",
            vector=_point(node),
            scale=node.value("Scale"),
            detail=node.value("Detail"),
            roughness=node.value("Roughness"),
            lacunarity=node.value("Lacunarity"),
            smoothness=node.value("Smoothness"),
            exponent=node.value("Exponent"),
            randomness=node.value("Randomness"),
            feature=_FEATURES[source.feature],
            metric="euclidean" if source.feature == "DISTANCE_TO_EDGE" else source.distance.lower(),
            normalize=_word(is_so=source.normalize),
            output=_OUTPUTS[node.output.identifier],
        )


class Gradient(Converter):
    """A ramp over space."""

    idname = "ShaderNodeTexGradient"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the graph's node of that name."""
        return node.graph.add("gradient", vector=_point(node), shape=node.node.gradient_type.lower())


class Wave(Converter):
    """Bands or rings."""

    idname = "ShaderNodeTexWave"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the graph's node of that name."""
        source = node.node
        is_rings = source.wave_type == "RINGS"
        return node.graph.add(
            "wave",
            vector=_point(node),
            scale=node.value("Scale"),
            distortion=node.value("Distortion"),
            detail=node.value("Detail"),
            detail_scale=node.value("Detail Scale"),
            roughness=node.value("Detail Roughness"),
            phase=node.value("Phase Offset"),
            form="rings" if is_rings else "bands",
            direction=_DIRECTIONS[source.rings_direction if is_rings else source.bands_direction],
            profile=_PROFILES[source.wave_profile],
        )

"""Run by a Python with bpy: ENGINE FOLDER writes FOLDER/ENGINE-<texture>.exr, glowing squares.

Coordinates are the same all over a pixel, so that engines agree in every one of them wherever they put their
samples.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import shots  # noqa: E402
from process import run  # noqa: E402

import blender_addon  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Mapping

SIZE = 32
#: Node, its properties, its inputs, and the output that is asked for.
TEXTURES: Mapping[str, tuple[str, dict[str, Any], dict[str, Any], int]] = {
    "noise": ("TexNoise", {}, {"Scale": 2.3, "Detail": 3.6, "Roughness": 0.6, "Lacunarity": 2.2}, 0),
    "noise colour": ("TexNoise", {}, {"Scale": 3.0, "Distortion": 0.8}, 1),
    "noise 1D": ("TexNoise", {"noise_dimensions": "1D"}, {"W": 0.7, "Scale": 3.0}, 1),
    "noise 2D": ("TexNoise", {"noise_dimensions": "2D"}, {"Scale": 3.0, "Distortion": 0.5}, 1),
    "noise 4D": ("TexNoise", {"noise_dimensions": "4D"}, {"W": 0.7, "Scale": 3.0, "Distortion": 0.5}, 1),
    "noise as it is": ("TexNoise", {"normalize": False}, {"Scale": 3.0, "Detail": 1.5}, 0),
    "multifractal": ("TexNoise", {"noise_type": "MULTIFRACTAL"}, {"Detail": 2.5}, 0),
    "hybrid": (
        "TexNoise",
        {"noise_type": "HYBRID_MULTIFRACTAL"},
        {"Detail": 2.5, "Offset": 0.4, "Gain": 2.0},
        0,
    ),
    "ridged": (
        "TexNoise",
        {"noise_type": "RIDGED_MULTIFRACTAL"},
        {"Detail": 3, "Offset": 0.9, "Gain": 2.0},
        0,
    ),
    "terrain": ("TexNoise", {"noise_type": "HETERO_TERRAIN"}, {"Detail": 2.5, "Offset": 0.6}, 0),
    "voronoi": ("TexVoronoi", {}, {"Scale": 3.0}, 0),
    "voronoi colour": ("TexVoronoi", {}, {"Scale": 3.0, "Randomness": 0.7}, 1),
    "voronoi position": ("TexVoronoi", {}, {"Scale": 3.0}, 2),
    "voronoi octaves": (
        "TexVoronoi",
        {"normalize": True},
        {"Scale": 2.0, "Detail": 2.5, "Roughness": 0.6},
        0,
    ),
    "voronoi F2": ("TexVoronoi", {"feature": "F2", "distance": "MANHATTAN"}, {"Scale": 3.0}, 0),
    "voronoi smooth": ("TexVoronoi", {"feature": "SMOOTH_F1"}, {"Scale": 3.0, "Smoothness": 0.6}, 1),
    "voronoi edge": ("TexVoronoi", {"feature": "DISTANCE_TO_EDGE"}, {"Scale": 2.0, "Detail": 1.5}, 0),
    "voronoi minkowski": ("TexVoronoi", {"distance": "MINKOWSKI"}, {"Scale": 3.0, "Exponent": 1.5}, 0),
    **{
        f"gradient {kind.lower()}": ("TexGradient", {"gradient_type": kind}, {}, 0)
        for kind in (
            *("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "RADIAL"),
            "SPHERICAL",
            "QUADRATIC_SPHERE",
        )
    },
    "bands": ("TexWave", {"wave_profile": "SAW", "bands_direction": "DIAGONAL"}, {"Scale": 0.5}, 0),
    "rings": (
        "TexWave",
        {"wave_type": "RINGS", "rings_direction": "Z"},
        {"Scale": 0.7, "Distortion": 3.0, "Detail Scale": 1.5, "Phase Offset": 0.4},
        0,
    ),
    "shells": (
        "TexWave",
        {"wave_type": "RINGS", "rings_direction": "SPHERICAL", "wave_profile": "TRI"},
        {},
        0,
    ),
}
#: Math operations and the arguments after the first; each is put after a ramp from -1 to 1.
FUNCTIONS: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("ABSOLUTE", "SIGN", "FLOOR", "TRUNC", "FRACT", "SINE", "ARCCOSINE", "TANH"), (0.0, 0.0)),
    **dict.fromkeys(("POWER", "MODULO", "FLOORED_MODULO", "SNAP", "PINGPONG", "ARCTAN2"), (0.3, 0.0)),
    **dict.fromkeys(("SMOOTH_MIN", "SMOOTH_MAX", "WRAP", "COMPARE"), (0.2, 0.4)),
}


def square(name: str) -> None:
    """Build a square that glows by a texture."""
    thing = shots.plane(2.0)
    glow = shots.material(thing, "ShaderNodeEmission")
    tree = glow.id_data
    shots.camera((0, 0, 5), type="ORTHO", ortho_scale=2.0)
    new, link = (lambda kind: tree.nodes.new(f"ShaderNode{kind}")), tree.links.new
    where, snap, mapping = new("TexCoord"), new("VectorMath"), new("Mapping")
    snap.operation = "SNAP"
    snap.inputs[1].default_value = (2.0 / SIZE,) * 3
    mapping.inputs["Rotation"].default_value = (0.3, 0.5, 0.7)
    mapping.inputs["Location"].default_value = (0.11, 0.23, 0.05)
    link(where.outputs["Object"], snap.inputs[0])
    link(snap.outputs[0], mapping.inputs["Vector"])
    if name in FUNCTIONS:
        parts, function = new("SeparateXYZ"), new("Math")
        function.operation = name
        function.inputs[1].default_value, function.inputs[2].default_value = FUNCTIONS[name]
        link(mapping.outputs[0], parts.inputs[0])
        link(parts.outputs["X"], function.inputs[0])
        link(function.outputs[0], glow.inputs["Color"])
        return
    kind, properties, inputs, output = TEXTURES[name]
    texture = new(kind)
    for attribute, value in properties.items():
        setattr(texture, attribute, value)
    for socket, value in inputs.items():
        texture.inputs[socket].default_value = value
    vector = texture.inputs.get("Vector")
    if vector is not None:
        link(mapping.outputs[0], vector)
    link(texture.outputs[output], glow.inputs["Color"])


def main(engine: str, folder: str) -> None:
    """Render all of them."""
    blender_addon.register()
    for name in (*TEXTURES, *FUNCTIONS):
        scene = shots.new_scene(engine, resolution=(SIZE, SIZE))
        square(name)
        shots.set_samples(scene, 4, 0)
        scene.render.filepath = f"{folder}/{engine}-{name}.exr"
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    run(main)

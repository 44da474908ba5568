"""Shots about media, each about one convention."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy
from shots import camera, cube, cube_of, lamp, material, plane

if TYPE_CHECKING:
    from collections.abc import Callable


def tracked_cube() -> None:
    """Homogeneous fog in a box, forward scattering, coloured."""
    cube_of("ShaderNodeVolumePrincipled", Color=(0.8, 0.5, 0.3, 1), Density=1.5, Anisotropy=0.4)


def absorption_colour() -> None:
    """Principled Volume with an absorption colour and emission."""
    cube_of(
        "ShaderNodeVolumePrincipled",
        Color=(0.2, 0.5, 0.8, 1),
        Absorption_Color=(0.3, 0.6, 0.1, 1),
        Density=1.0,
        Emission_Strength=0.2,
        Emission_Color=(1.0, 0.3, 0.1, 1),
    )


def black_body() -> None:
    """Principled Volume that glows."""
    cube_of(
        "ShaderNodeVolumePrincipled",
        Density=0.5,
        Blackbody_Intensity=0.7,
        Blackbody_Tint=(1, 0.8, 0.6, 1),
        Temperature=1800.0,
    )


def scatter_and_absorption() -> None:
    """Scatter and Absorption, added."""
    shader = cube_of("ShaderNodeVolumeScatter", Color=(0.9, 0.6, 0.4, 1), Density=0.8, Anisotropy=-0.3)
    tree = shader.id_data
    absorber, both = tree.nodes.new("ShaderNodeVolumeAbsorption"), tree.nodes.new("ShaderNodeAddShader")
    absorber.inputs["Color"].default_value, absorber.inputs["Density"].default_value = (0.2, 0.5, 0.8, 1), 0.7
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], both.inputs[0])
    tree.links.new(absorber.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], output.inputs["Volume"])


def coefficients() -> None:
    """Volume Coefficients."""
    cube_of(
        "ShaderNodeVolumeCoefficients",
        Absorption_Coefficients=(0.1, 0.3, 0.5),
        Scatter_Coefficients=(0.8, 0.5, 0.3),
        Emission_Coefficients=(0.05, 0.02, 0.0),
        Anisotropy=0.2,
    )


def overlap() -> None:
    """Two boxes of fog that overlap, the camera in one of them.

    They share their anisotropy: of two phase functions Cycles takes one for all channels.
    """
    tracked_cube()
    other = cube(2.5, location=(0.5, -1.5, 0.2))
    inputs = {"Color": (0.5, 0.7, 0.9, 1), "Density": 0.3, "Anisotropy": 0.4}
    material(other, "ShaderNodeVolumeScatter", "Volume", **inputs)
    bpy.context.scene.camera.location = (0, -2.5, 0.3)


def world_fog() -> None:
    """Fog everywhere, a lamp and a wall."""
    camera((0, -4, 0), (math.pi / 2, 0, 0))
    material(plane(30.0, location=(0, 4, 0), rotation=(math.pi / 2, 0, 0)), "ShaderNodeBsdfDiffuse")
    tree = bpy.context.scene.world.node_tree
    fog = tree.nodes.new("ShaderNodeVolumeScatter")
    fog.inputs["Color"].default_value, fog.inputs["Density"].default_value = (0.8, 0.8, 0.9, 1), 0.1
    tree.links.new(fog.outputs[0], tree.nodes["World Output"].inputs["Volume"])
    lamp("SPOT", (0, 0, 3), energy=300, shadow_soft_size=0.2, spot_size=0.8, use_soft_falloff=False)


def procedural(kind: str, span: tuple[float, float], density: float = 5.0, **attributes: Any) -> Any:
    """A box whose density follows a texture from one end of `span` to the other; return its tree."""
    shader = cube_of("ShaderNodeVolumePrincipled", Color=(0.8, 0.6, 0.4, 1), Anisotropy=0.2)
    tree = shader.id_data
    texture, where, fit = (tree.nodes.new(f"ShaderNode{k}") for k in (kind, "TexCoord", "MapRange"))
    for name, value in attributes.items():
        if name in texture.inputs:
            texture.inputs[name].default_value = value
        else:
            setattr(texture, name, value)
    fit.inputs["From Min"].default_value, fit.inputs["From Max"].default_value = span
    fit.inputs["To Max"].default_value = density
    tree.links.new(where.outputs["Object"], texture.inputs["Vector"])
    tree.links.new(texture.outputs[0], fit.inputs["Value"])
    tree.links.new(fit.outputs[0], shader.inputs["Density"])
    return shader


def coloured_noise() -> None:
    """Noise whose colour is a ramp of cells, in the object's own box."""
    shader = procedural("TexNoise", (0.45, 0.7), Scale=2.0, Detail=3.0)
    tree = shader.id_data
    cells, ramp = tree.nodes.new("ShaderNodeTexVoronoi"), tree.nodes.new("ShaderNodeValToRGB")
    first, last = ramp.color_ramp.elements
    first.position, first.color, last.position, last.color = 0.3, (0.9, 0.2, 0.1, 1), 0.6, (0.1, 0.5, 0.9, 1)
    cells.inputs["Scale"].default_value = 3.0
    tree.links.new(cells.outputs["Distance"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Color"])


def glowing_ball() -> None:
    """Emission and density by textures that differ."""
    shader = procedural("TexNoise", (0.4, 0.8), Scale=2.0, density=2.0)
    shader.inputs["Emission Color"].default_value = (1.0, 0.3, 0.1, 1.0)
    tree = shader.id_data
    ball, where = tree.nodes.new("ShaderNodeTexGradient"), tree.nodes.new("ShaderNodeTexCoord")
    ball.gradient_type = "SPHERICAL"
    tree.links.new(where.outputs["Object"], ball.inputs["Vector"])
    tree.links.new(ball.outputs[1], shader.inputs["Emission Strength"])


SHOTS: dict[str, Callable[[], Any]] = {
    "cube": tracked_cube,
    "absorption colour": absorption_colour,
    "black body": black_body,
    "scatter and absorption": scatter_and_absorption,
    "coefficients": coefficients,
    "overlap": overlap,
    "world fog": world_fog,
    "noise": lambda: procedural("TexNoise", (0.45, 0.7), Scale=2.0, Detail=3.0),
    "noise 4D": lambda: procedural("TexNoise", (0.45, 0.7), noise_dimensions="4D", Scale=2.0, W=1.7),
    "voronoi": lambda: procedural("TexVoronoi", (0.6, 0.2), Scale=2.0),
    "gradient": lambda: procedural("TexGradient", (0.0, 1.0), gradient_type="SPHERICAL"),
    "wave": lambda: procedural("TexWave", (0.0, 1.0), 3.0, Scale=1.0, Distortion=2.0),
    "coloured noise": coloured_noise,
    "glowing ball": glowing_ball,
}

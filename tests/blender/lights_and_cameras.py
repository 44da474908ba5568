"""Shots about lights and cameras, each about one convention."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy
from shots import ball, camera, cube, lamp, material, place, plane, sky

if TYPE_CHECKING:
    from collections.abc import Callable


def floor() -> None:
    """Add a grey floor seen from above, and a camera beside the light's axis."""
    material(plane(40.0), "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1.0))
    camera((0, 0, 6), lens=36.0)


def point_light() -> None:
    """A point of no size."""
    floor()
    lamp("POINT", (0.5, 0.2, 3), energy=200, shadow_soft_size=0.0, color=(1, 0.5, 0.25))


def sphere_light() -> None:
    """A lamp with a radius, seen by the camera."""
    floor()
    light = lamp("POINT", (0.5, 0.2, 3), energy=200, shadow_soft_size=0.4, use_soft_falloff=False)
    light.visible_camera = True


def spot_light() -> None:
    """A cone with a soft edge inside the picture."""
    floor()
    lamp("SPOT", (0, 0, 3), (0.2, 0.1, 0), energy=300, shadow_soft_size=0.0, spot_size=0.8, spot_blend=0.6)


def area_light() -> None:
    """A rectangle, scaled, with light from behind passing it."""
    floor()
    light = lamp("AREA", (0, 0, 3), (0.5, 0, 0), energy=200, shape="RECTANGLE", size=1.0, size_y=2.0)
    light.scale = (1.5, 1.0, 1.0)
    sky(0.2)


def ellipse_light() -> None:
    """An ellipse, not normalised, with temperature and exposure."""
    floor()
    light = lamp("AREA", (0, 0, 3), (0.4, 0.2, 0), energy=20, shape="ELLIPSE", size=1.0, size_y=2.0)
    light.data.normalize, light.data.exposure = False, 1.5
    light.data.use_temperature, light.data.temperature = True, 3000


def spread_light() -> None:
    """A card behind a honeycomb."""
    floor()
    lamp("AREA", (0, 0, 3), (0.2, 0, 0), energy=50, size=1.0, spread=math.radians(60))


def sun() -> None:
    """A sun with a size, low."""
    floor()
    lamp("SUN", (0, 0, 3), (0.7, 0, 0.3), energy=3, angle=0.3, color=(1, 0.8, 0.6))
    place("Post", cube(1.0).data, (1, 1, 0))


def mesh_light() -> None:
    """A mesh that emits, with a Mix Shader and a transparent sheet before it."""
    floor()
    material(plane(1.0, location=(0, 0, 2)), "ShaderNodeEmission", Color=(1, 0.5, 0.2, 1), Strength=5.0)
    sheet = plane(2.0, location=(1.0, 0, 1.0))
    material(sheet, "ShaderNodeBsdfTransparent", Color=(0.5, 0.8, 1.0, 1))


def hdri() -> None:
    """A sky with a bright side, turned; the camera sees sky and a ball."""
    width, height = 32, 16
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    pixels = [0.2, 0.2, 0.2, 1.0] * (width * height)
    for row in range(height):
        for column in range(width):
            first = 4 * (row * width + column)
            pixels[first] = 0.2 + 3.0 * (4 <= column < 12)
            pixels[first + 1] = 0.2 + 2.0 * (10 <= row < 14)
            pixels[first + 2] = 0.1 + 1.0 * (20 <= column < 28)
    image.pixels.foreach_set(pixels)
    image.update()
    image.pack()
    ball("ShaderNodeBsdfDiffuse", Color=(0.6, 0.6, 0.6, 1))
    world = bpy.context.scene.world
    # Cycles' own table of the sky, as small as the image: it takes long to make.
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 64
    tree = world.node_tree
    texture, mapping = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
    where = tree.nodes.new("ShaderNodeTexCoord")
    texture.image, texture.interpolation = image, "Linear"
    mapping.inputs["Rotation"].default_value = (0.2, 0.1, 0.7)
    tree.links.new(where.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs[0])
    tree.links.new(texture.outputs[0], tree.nodes["Background"].inputs["Color"])


def _sky_of(node: str, ball_color: tuple[float, float, float] = (0.6, 0.6, 0.6)) -> Any:
    """Light a ball by a world of a node; return that node."""
    ball("ShaderNodeBsdfDiffuse", Color=(*ball_color, 1))
    bpy.data.objects.remove(bpy.data.objects["AREA"])
    tree = bpy.context.scene.world.node_tree
    texture = tree.nodes.new(node)
    tree.links.new(texture.outputs[0], tree.nodes["Background"].inputs["Color"])
    return texture


def gradient_sky() -> None:
    """A ramp over the height, brighter on one side."""
    ramp = _sky_of("ShaderNodeValToRGB")
    tree = ramp.id_data
    where, axes = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(where.outputs["Generated"], axes.inputs[0])
    tree.links.new(axes.outputs["Z"], ramp.inputs[0])
    strength = tree.nodes.new("ShaderNodeMath")
    strength.operation = "MULTIPLY_ADD"
    strength.inputs[1].default_value, strength.inputs[2].default_value = 0.8, 1.0
    tree.links.new(axes.outputs["X"], strength.inputs[0])
    tree.links.new(strength.outputs[0], tree.nodes["Background"].inputs["Strength"])
    ramp.color_ramp.elements[0].color = (0.2, 0.5, 1.0, 1)
    ramp.color_ramp.elements[1].color, ramp.color_ramp.elements[1].position = (1.0, 0.4, 0.1, 1), 0.6
    ramp.color_ramp.elements.new(0.3).color = (0.1, 0.9, 0.2, 1)


def sky_texture() -> None:
    """Blender's own sky with its sun, low."""
    texture = _sky_of("ShaderNodeTexSky")
    texture.sky_type = "SINGLE_SCATTERING" if bpy.app.version >= (5, 0, 0) else "NISHITA"
    texture.sun_elevation, texture.sun_rotation = 0.5, 0.8
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.1


def _squares() -> None:
    for x, y, color in ((1, 1, (1, 0, 0, 1)), (-1, 1, (0, 1, 0, 1)), (-1, -1, (0, 0, 1, 1))):
        thing = plane(1.5, location=(x, y, 0.3 * x))
        material(thing, "ShaderNodeEmission", Color=color)


def shifted_camera() -> None:
    """Shift, a vertical sensor and a lens out of focus, above coloured squares."""
    bpy.context.scene.render.resolution_y = 12
    _squares()
    eye = camera((0.3, 0, 5), shift_x=0.1, shift_y=-0.2, sensor_fit="VERTICAL", lens=30)
    eye.data.dof.use_dof, eye.data.dof.focus_distance, eye.data.dof.aperture_fstop = True, 3.0, 0.1


def parallel_camera() -> None:
    """An orthographic camera with shift, in a tall image."""
    bpy.context.scene.render.resolution_x = 12
    _squares()
    camera((0.2, 0, 5), type="ORTHO", ortho_scale=5.0, shift_x=-0.1, shift_y=0.15)


SHOTS: dict[str, Callable[[], Any]] = {
    "point": point_light,
    "sphere": sphere_light,
    "spot": spot_light,
    "area": area_light,
    "ellipse": ellipse_light,
    "spread": spread_light,
    "sun": sun,
    "mesh light": mesh_light,
    "hdri": hdri,
    "gradient sky": gradient_sky,
    "sky texture": sky_texture,
    "shifted camera": shifted_camera,
    "parallel camera": parallel_camera,
}

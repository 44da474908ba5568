"""What small shots are made of, in Blender, for any engine."""

from __future__ import annotations

import math
from typing import Any

import bpy


def new_scene(engine: str, *, resolution: tuple[int, int] = (16, 16), bounces: int = 8) -> Any:
    """Empty the file and return a scene with a black world, set to unbiased light transport."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    use_nodes(scene.world)
    sky(0.0)
    render = scene.render
    render.engine = engine
    render.resolution_x, render.resolution_y = resolution
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", 2
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    if engine == "CYCLES":
        _set_cycles(scene.cycles, bounces)
    else:
        scene.tyndall.filter, scene.tyndall.max_bounces = "box", bounces + 1
    return scene


def use_nodes(owner: Any) -> Any:
    """Have a material or a world use nodes and return them: before Blender 5.0 they do not by themselves."""
    if bpy.app.version < (5, 0, 0):
        owner.use_nodes = True
    return owner.node_tree


def _set_cycles(cycles: Any, bounces: int) -> None:
    """Ask for the image without clamps, filters or ray marching."""
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_auto_tile = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.pixel_filter_type = "BOX"
    for kind in ("max", "diffuse", "glossy", "transmission", "volume"):
        setattr(cycles, f"{kind}_bounces", bounces)
    cycles.transparent_max_bounces = 256


def set_samples(scene: Any, samples: int, seed: int) -> None:
    """Set samples per pixel and seed of either engine."""
    settings = scene.cycles if scene.render.engine == "CYCLES" else scene.tyndall
    settings.samples, settings.seed = samples, seed


def sky(strength: float, color: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Any:
    """Set an even sky; return its node."""
    node = bpy.context.scene.world.node_tree.nodes["Background"]
    node.inputs["Color"].default_value = (*color, 1.0)
    node.inputs["Strength"].default_value = strength
    return node


def place(name: str, data: Any, location: Any = (0, 0, 0), rotation: Any = (0, 0, 0)) -> Any:
    """Put data into the scene."""
    thing = bpy.data.objects.new(name, data)
    thing.location, thing.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(thing)
    return thing


def camera(location: Any, rotation: Any = (0, 0, 0), **attributes: Any) -> Any:
    """Add the camera."""
    data = bpy.data.cameras.new("Camera")
    data.clip_start = 1e-4
    for name, value in attributes.items():
        setattr(data, name, value)
    bpy.context.scene.camera = place("Camera", data, location, rotation)
    return bpy.context.scene.camera


def plane(size: float, **where: Any) -> Any:
    """Add a square in the xy plane."""
    h = size / 2
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [], [(0, 1, 2, 3)])
    return place("Plane", mesh, **where)


def cube(size: float = 2.0, **where: Any) -> Any:
    """Add a cube."""
    h = size / 2
    corners = [(x, y, z) for x in (-h, h) for y in (-h, h) for z in (-h, h)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new("Cube")
    mesh.from_pydata(corners, [], faces)
    return place("Cube", mesh, **where)


def material(thing: Any, node: str, socket: str = "Surface", **inputs: Any) -> Any:
    """Give an object a material of one node; return that node."""
    made = bpy.data.materials.new(node)
    tree = use_nodes(made)
    tree.nodes.clear()
    shader, output = tree.nodes.new(node), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(shader.outputs[0], output.inputs[socket])
    thing.data.materials.append(made)
    return shader


def lamp(kind: str, location: Any, rotation: Any = (0, 0, 0), **attributes: Any) -> Any:
    """Add a light."""
    data = bpy.data.lights.new(kind, kind)
    for name, value in attributes.items():
        setattr(data, name, value)
    return place(kind, data, location, rotation)


def cube_of(node: str, **inputs: Any) -> Any:
    """A box of a medium under a sky and a lamp."""
    camera((0, -6, 1.0), (math.radians(80), 0, 0))
    thing = cube(2.0)
    shader = material(thing, node, "Volume", **inputs)
    sky(0.5, (0.7, 0.8, 1.0))
    lamp("AREA", (2, -2, 3), (0.6, 0.5, 0), energy=200, size=1.0)
    return shader


def cloud(path: str, scale: float = 1.0) -> Any:
    """A grid as a Volume object; Cycles is asked to leave its values alone, and where they are."""
    volume = bpy.data.volumes.new("Cloud")
    volume.filepath = path
    volume.render.precision, volume.render.clipping = "FULL", 0.0
    thing = place("Cloud", volume)
    thing.scale = (scale,) * 3
    if bpy.context.scene.render.engine == "CYCLES" and bpy.app.version < (5, 0, 0):
        # It shows grids half a voxel too far along each axis.
        volume.grids.load()
        half = volume.grids[0].matrix_object.to_scale() / 2
        thing.location = [-h * scale for h in half]
    material(thing, "ShaderNodeVolumePrincipled", "Volume", Color=(0.8, 0.6, 0.5, 1), Density=3.0)
    camera((0, -5, 0), (math.pi / 2, 0, 0))
    sky(0.5)
    lamp("SUN", (0, 0, 3), (0.7, 0.2, 0), energy=2, angle=0.1)
    return thing


def clouds(path: str) -> None:
    """A grid in a collection, placed twice: turned, and scaled unevenly."""
    thing = cloud(path)
    kept = bpy.data.collections.new("Clouds")
    kept.objects.link(thing)
    bpy.context.scene.collection.objects.unlink(thing)
    for location, rotation, scale in (
        ((-1, 0, 0), (0, 0, 0.5), (1, 1, 1)),
        ((1, 0.5, 0.3), (0.4, 0, 0), (0.8, 1.2, 0.6)),
    ):
        empty = place("Place", None, location, rotation)
        empty.instance_type, empty.instance_collection, empty.scale = "COLLECTION", kept, scale


def ball(node: str = "ShaderNodeBsdfPrincipled", **inputs: Any) -> Any:
    """A smooth ball of a material on a floor under a sky and a lamp."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=(0, 0, 1))
    thing = bpy.context.object
    bpy.ops.object.shade_smooth()
    shader = material(thing, node, **inputs)
    material(plane(20.0), "ShaderNodeBsdfDiffuse", Color=(0.3, 0.3, 0.3, 1))
    camera((0, -4, 1.5), (math.radians(83), 0, 0), lens=40)
    sky(0.6, (0.8, 0.9, 1.0))
    lamp("AREA", (2, -2, 4), (0.6, 0.5, 0), energy=150, size=2.0)
    return shader

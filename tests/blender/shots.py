"""Small shots, each about one convention, built in Blender for any engine."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy

if TYPE_CHECKING:
    from collections.abc import Callable


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


def tracked_cube() -> None:
    """Homogeneous fog in a box, forward scattering, coloured."""
    cube_of("ShaderNodeVolumePrincipled", Color=(0.8, 0.5, 0.3, 1), Density=1.5, Anisotropy=0.4)


def cube_of(node: str, **inputs: Any) -> Any:
    """A box of a medium under a sky and a lamp."""
    camera((0, -6, 1.0), (math.radians(80), 0, 0))
    thing = cube(2.0)
    shader = material(thing, node, "Volume", **inputs)
    sky(0.5, (0.7, 0.8, 1.0))
    lamp("AREA", (2, -2, 3), (0.6, 0.5, 0), energy=200, size=1.0)
    return shader


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


def cloud(path: str, scale: float = 1.0) -> Any:
    """A grid as a Volume object; Cycles is asked to leave its values alone."""
    volume = bpy.data.volumes.new("Cloud")
    volume.filepath = path
    volume.render.precision, volume.render.clipping = "FULL", 0.0
    thing = place("Cloud", volume)
    thing.scale = (scale,) * 3
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
    "cube": tracked_cube,
    "absorption colour": absorption_colour,
    "black body": black_body,
    "scatter and absorption": scatter_and_absorption,
    "coefficients": coefficients,
    "overlap": overlap,
    "world fog": world_fog,
    "plastic": lambda: ball(Base_Color=(0.6, 0.3, 0.1, 1), Roughness=0.3),
    "matte": lambda: ball("ShaderNodeBsdfDiffuse", Color=(0.6, 0.3, 0.1, 1)),
    "metal": lambda: ball(Base_Color=(0.9, 0.6, 0.3, 1), Roughness=0.2, Metallic=1.0),
    "glossy": lambda: ball("ShaderNodeBsdfAnisotropic", Color=(0.9, 0.6, 0.3, 1), Roughness=0.3),
    "glass": lambda: ball("ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.45),
    "half there": lambda: ball(Base_Color=(0.6, 0.3, 0.1, 1), Roughness=1.0, Alpha=0.4),
    "glowing": lambda: ball(Base_Color=(0, 0, 0, 1), Emission_Color=(1, 0.5, 0.2, 1), Emission_Strength=2.0),
}

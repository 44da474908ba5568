"""A shot as artists make them, for pictures in the documentation: a cloud over water and Blender's sky."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
import shots

if TYPE_CHECKING:
    from pathlib import Path


def build(folder: Path) -> Any:
    """Make the shot in the open file; its grid goes to FOLDER. Return the scene."""
    # The add-on brought it along.
    import tyndall

    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    scene.render.engine = "TYNDALL"
    path = folder / "cloud.vdb"
    tyndall.write_vdb(path, "density", _cumulus(96), 0.05, (-2.4, -2.4, 0.0))
    volume = bpy.data.volumes.new("Cloud")
    volume.filepath = str(path)
    cloud = shots.place("Cloud", volume, (0.4, 3.0, 1.3))
    shots.material(cloud, "ShaderNodeVolumePrincipled", "Volume", Color=(0.99, 0.99, 0.99, 1), Density=14.0)
    sea = shots.plane(400.0)
    shots.material(sea, "ShaderNodeBsdfPrincipled", Base_Color=(0.02, 0.05, 0.07, 1), Roughness=0.25)
    for x, y, radius, color, metallic in (
        (-1.5, -0.4, 0.55, (1.0, 0.72, 0.3, 1), 1.0),
        (-0.2, -1.3, 0.35, (0.75, 0.08, 0.05, 1), 0.0),
    ):
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=64, ring_count=32, radius=radius, location=(x, y, radius)
        )
        bpy.ops.object.shade_smooth()
        inputs = {"Base_Color": color, "Metallic": metallic, "Roughness": 0.2}
        shots.material(bpy.context.object, "ShaderNodeBsdfPrincipled", **inputs)
    _sky()
    shots.camera((0.2, -6.5, 1.1), (math.radians(97), 0, 0), lens=32)
    bpy.context.view_layer.objects.active = cloud
    cloud.select_set(True)
    return scene


def _cumulus(size: int) -> np.ndarray:
    """Return a heap of balls with a flat base, eaten into by waves, shape (size, size, size)."""
    axis = np.linspace(-1.0, 1.0, size)
    x, y, z = np.meshgrid(axis, axis, 0.5 * (axis + 1.0), indexing="ij")
    random = np.random.default_rng(4)
    inside = np.full(x.shape, -1.0)
    for _ in range(28):
        cx, cy = random.normal(0.0, (0.34, 0.26))
        radius = random.uniform(0.13, 0.3)
        cz = 0.12 + max(0.0, random.uniform(0.0, 0.42) * (1.0 - 1.3 * math.hypot(cx, cy)))
        distance = np.sqrt((x - cx) ** 2 + (y - cy) ** 2 + (1.3 * (z - cz)) ** 2)
        inside = np.maximum(inside, 1.0 - distance / radius)
    for octave in range(4):
        f = 9.0 * 1.9**octave
        phases = random.uniform(0.0, 2 * math.pi, 3)
        waves = np.sin(f * x + 2 * np.sin(f * 0.6 * y) + phases[0]) * np.sin(
            f * y + 2 * np.sin(f * 0.7 * z) + phases[1]
        )
        inside += 0.28 * 0.6**octave * waves * np.sin(f * z + 1.5 * np.sin(f * 0.5 * x) + phases[2])
    base = np.clip((z - 0.08) / 0.05, 0.0, 1.0)
    return (np.clip(3.0 * inside, 0.0, 1.0) * base).astype(np.float32)


def _sky() -> None:
    tree = bpy.context.scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexSky")
    texture.sky_type = "SINGLE_SCATTERING" if bpy.app.version >= (5, 0, 0) else "NISHITA"
    texture.sun_elevation, texture.sun_rotation = math.radians(14), math.radians(-70)
    texture.sun_size = math.radians(2.0)
    tree.links.new(texture.outputs[0], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.12

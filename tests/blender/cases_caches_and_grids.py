"""Cases of `run_engine.py` about guiding caches and volume grids."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
import shots
import tyndall
from still_life import render, still_life

from blender_addon import cache, messages

if TYPE_CHECKING:
    from pathlib import Path


def cached_animation(folder: Path) -> dict[str, Any]:
    """Six frames with one guiding cache; the ball moves after the third."""
    scene = still_life(folder, samples=16)
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/shot.blend")
    scene.tyndall.guiding = "on"
    scene.tyndall.cache_path = "//cache/{blend}.{scene}.tyc"
    ball, answers = scene.objects["Sphere"], []
    layer = scene.view_layers[0]
    for frame in range(1, 7):
        scene.frame_set(frame)
        ball.location.x = 0.0 if frame <= 3 else 0.5
        scene.render.filepath = f"{folder}/image{frame:04d}"
        said = render()
        answers.append([said, *cache.lines(scene, layer)])
    file = cache.file_of(scene, layer)
    frames = [frame["frame"] for frame in tyndall.read_cache_info(file)["frames"]]
    trained = ",".join(bpy.ops.tyndall.train_cache())
    after = [frame["frame"] for frame in tyndall.read_cache_info(file)["frames"]]
    cleared = ",".join(bpy.ops.tyndall.clear_cache())
    return {
        "answers": answers,
        "file": str(file.relative_to(folder)),
        "frames": frames,
        "trained": [trained, *after],
        "cleared": [cleared, file.exists()],
    }


def inspected_cache(folder: Path) -> dict[str, Any]:
    """What Inspect says of a cache of this shot, of one with other things in it, and of what is no cache."""
    scene = still_life(folder, samples=16)
    layer = scene.view_layers[0]
    scene.tyndall.guiding = "on"
    file = folder / "shot.tyc"
    scene.tyndall.cache_path = str(file)
    can = [bpy.ops.tyndall.inspect_cache.poll()]
    said = [render()]
    can.append(bpy.ops.tyndall.inspect_cache.poll())
    before = file.read_bytes()

    def ask() -> None:
        bpy.context.view_layer.update()
        try:
            answers.append([",".join(bpy.ops.tyndall.inspect_cache()), *cache.lines(scene, layer)])
        except RuntimeError as error:
            answers.append([f"error: {error}"])

    answers: list[list[str]] = []
    ask()
    scene.objects["Sphere"].location.x = 0.5
    ask()
    scene.objects["Sphere"].location.x = 0.0
    ask()
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 3.0
    ask()
    camera, scene.camera = scene.camera, None
    ask()
    scene.camera = camera
    is_untouched = file.read_bytes() == before
    bpy.ops.wm.usd_export(filepath=f"{folder}/shot.usda")
    scene.tyndall.cache_path = f"{folder}/image.exr"
    ask()
    return {"said": said, "can": can, "answers": answers, "is untouched": is_untouched}


def cache_paths(folder: Path) -> dict[str, Any]:
    """Cache paths that name no file."""
    scene = still_life(folder)
    said = []
    for path in ("//cache.tyc", f"{folder}/{{shot}}.tyc", f"{folder}/{{scene.tyc"):
        scene.tyndall.cache_path = path
        said.append([render(), *cache.lines(scene, scene.view_layers[0])])
    foreign = folder / "picture.tyc"
    foreign.write_bytes(b"no cache")
    scene.tyndall.cache_path = str(foreign)
    try:
        cleared = ",".join(bpy.ops.tyndall.clear_cache())
    except RuntimeError as error:
        cleared = f"error: {error}"
    return {"said": said, "cleared": cleared, "is kept": foreign.exists()}


def nodes_volume(folder: Path) -> dict[str, Any]:
    """A cube that geometry nodes turn into a grid of density 1 renders as the mesh full of fog."""
    scene = shots.new_scene("TYNDALL", resolution=(24, 24))
    shots.cube_of("ShaderNodeVolumePrincipled", Density=1.5)
    shots.set_samples(scene, 64, 0)
    scene.render.filepath = f"{folder}/mesh"
    said = [render()]
    tree = bpy.data.node_groups.new("To grid", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    to_volume, look = tree.nodes.new("GeometryNodeMeshToVolume"), tree.nodes.new("GeometryNodeSetMaterial")
    if hasattr(to_volume, "resolution_mode"):
        to_volume.resolution_mode = "VOXEL_SIZE"
    else:
        to_volume.inputs["Resolution Mode"].default_value = "Size"
    to_volume.inputs["Voxel Size"].default_value = 0.05
    to_volume.inputs["Interior Band Width"].default_value = 0.05
    thing = scene.objects["Cube"]
    look.inputs["Material"].default_value = thing.active_material
    tree.links.new(start.outputs[0], to_volume.inputs["Mesh"])
    tree.links.new(to_volume.outputs[0], look.inputs["Geometry"])
    tree.links.new(look.outputs[0], end.inputs[0])
    modifier = thing.modifiers.new("To grid", "NODES")
    modifier.node_group = tree
    scene.render.filepath = f"{folder}/grid"
    said.append(render())
    return {"said": said, "report": messages.last(scene.name).text()}


def grid_sequence(folder: Path) -> dict[str, Any]:
    """Four frames of a sequence of three grids, ever thicker; the last frame has no file."""
    scene = shots.new_scene("TYNDALL", resolution=(16, 16))
    for frame in (1, 2, 3):
        values = np.full((8, 8, 8), float(frame), np.float32)
        tyndall.write_vdb(f"{folder}/fog_{frame:04d}.vdb", "density", values, 2.0 / 8, (-1.0, -1.0, -1.0))
    thing = shots.cloud(f"{folder}/fog_0001.vdb")
    thing.active_material.node_tree.nodes[0].inputs["Density"].default_value = 0.3
    volume = thing.data
    volume.is_sequence, volume.frame_start, volume.frame_duration = True, 1, 4
    volume.sequence_mode = "CLIP"
    scene.frame_start, scene.frame_end = 1, 3
    shots.set_samples(scene, 16, 0)
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = f"{folder}/image"
    said = [render(animation=True)]
    scene.frame_set(4)
    scene.render.filepath = f"{folder}/image0004"
    said.append(render())
    return {"said": said, "report": messages.last(scene.name).text()}


def smoke_domain(folder: Path) -> dict[str, Any]:
    """A domain of smoke that has not been baked."""
    scene = still_life(folder)
    modifier = scene.objects["Cube"].modifiers.new("Smoke", "FLUID")
    modifier.fluid_type = "DOMAIN"
    modifier.domain_settings.domain_type = "GAS"
    said = render()
    return {"said": said, "report": messages.last(scene.name).text()}


CASES = (cached_animation, inspected_cache, cache_paths, nodes_volume, grid_sequence, smoke_domain)

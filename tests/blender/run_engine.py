"""Run by a Python with bpy: CASE FOLDER plays one case and prints what it saw as JSON on the last line."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import shots  # noqa: E402
import tyndall  # noqa: E402
from cases_caches_and_grids import CASES as CASES_OF_GRIDS  # noqa: E402
from cases_wishes import CASES as CASES_OF_WISHES  # noqa: E402
from process import run  # noqa: E402
from still_life import render, still_life  # noqa: E402
from tyndall.messages import Messages  # noqa: E402

import blender_addon  # noqa: E402
from blender_addon import messages  # noqa: E402
from blender_addon.final import changed_geometry  # noqa: E402
from blender_addon.sync.scene import SceneSync  # noqa: E402
from blender_addon.viewport import Job, viewport_settings  # noqa: E402


def passes(folder: Path) -> dict[str, Any]:
    scene = still_life(folder)
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_mist = layer.use_pass_position = True
    layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_material = True
    for name in layer.tyndall.bl_rna.properties.keys():  # noqa: SIM118 - no dictionary
        if name.startswith("use_pass_"):
            setattr(layer.tyndall, name, True)
    settings = scene.render.image_settings
    if bpy.app.version >= (5, 0, 0):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    said = render()
    return {"said": said, "report": messages.last(scene.name).text()}


def region(folder: Path) -> dict[str, Any]:
    """The same pixels with and without a render region; the box filter keeps samples in their pixel."""
    scene = still_life(folder, samples=64)
    scene.render.filepath = f"{folder}/full"
    said = [render()]
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    scene.render.filepath = f"{folder}/part"
    return {"said": [*said, render()]}


def transparent(folder: Path) -> dict[str, Any]:
    scene = still_life(folder)
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.film_transparent = True
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    return {"said": render()}


def _hop(folder: Path) -> Any:
    """Three frames of a moving ball, the last like the first."""
    scene = still_life(folder)
    scene.frame_start, scene.frame_end = 1, 3
    ball = bpy.data.objects["Sphere"]
    for frame, x in ((1, 0.0), (2, 0.5), (3, 0.0)):
        ball.location.x = x
        ball.keyframe_insert("location", frame=frame)
    return scene


def animation(folder: Path) -> dict[str, Any]:
    """Frames with persistent data."""
    scene = _hop(folder)
    scene.render.use_persistent_data = True
    return {"said": render(animation=True)}


def blurred_animation(folder: Path) -> dict[str, Any]:
    """Blurred frames, with and without persistent data."""
    scene = _hop(folder)
    scene.render.use_motion_blur = True
    said = []
    for name, is_kept in (("kept", True), ("fresh", False)):
        scene.render.use_persistent_data = is_kept
        scene.render.filepath = f"{folder}/{name}"
        said.append(render(animation=True))
    return {"said": said}


def error_in_animation(folder: Path) -> dict[str, Any]:
    """The camera is gone in frame 2 of 3."""
    scene = still_life(folder)
    scene.frame_start, scene.frame_end = 1, 3

    def lose_camera(*_: Any) -> None:
        if scene.frame_current == 2:
            scene.camera = None

    bpy.app.handlers.frame_change_pre.append(lose_camera)
    return {"said": render(animation=True)}


def missing_grid(folder: Path) -> dict[str, Any]:
    scene = still_life(folder)
    volume = bpy.data.volumes.new("Cloud")
    volume.filepath = f"{folder}/nowhere.vdb"
    shots.place("Cloud", volume)
    said = render()
    text = messages.last(scene.name).text()
    scene.tyndall.strict = True
    scene.render.filepath = f"{folder}/strict"
    return {"said": said, "report": text, "strict": render()}


def unknown_node(folder: Path) -> dict[str, Any]:
    scene = still_life(folder)
    tree = bpy.data.objects["Sphere"].active_material.node_tree
    magic = tree.nodes.new("ShaderNodeTexMagic")
    shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    tree.links.new(magic.outputs["Color"], shader.inputs["Base Color"])
    return {"said": render(), "report": messages.last(scene.name).text()}


def time_limit(folder: Path) -> dict[str, Any]:
    scene = still_life(folder, samples=10_000_000)
    scene.tyndall.time_limit = 1.0
    start = time.monotonic()
    return {"said": render(), "seconds": time.monotonic() - start}


def edits(folder: Path) -> dict[str, Any]:
    """Count the prims that each edit sends, and compare the picture with that of a fresh translation."""
    scene = still_life(folder)
    sync, counts, changed = SceneSync(), {}, set()
    # Blender tells handlers and engines what changed, nobody else.
    bpy.app.handlers.depsgraph_update_post.append(lambda _, graph: changed.update(changed_geometry(graph)))

    def follow(name: str) -> None:
        bpy.context.view_layer.update()
        sync.forget(changed)
        changed.clear()
        counts[name] = sync.sync(bpy.context.evaluated_depsgraph_get(), is_transparent=False)

    follow("first")
    follow("nothing")
    scene.objects["Sphere"].location.x += 0.5
    follow("transform")
    scene.objects["AREA"].data.energy *= 2
    follow("light")
    node = scene.objects["Sphere"].active_material.node_tree.nodes["Principled BSDF"]
    node.inputs["Roughness"].default_value = 0.1
    follow("material")
    shots.sky(2.0)
    follow("world")
    cube = scene.objects["Cube"]
    cube.active_material.node_tree.nodes[0].inputs["Density"].default_value = 3.0
    follow("volume")
    cube.data.vertices[7].co.x += 0.5
    cube.data.update_tag()
    follow("geometry")
    bpy.data.objects.remove(scene.objects["Plane"])
    follow("removal")
    fresh = SceneSync()
    fresh.sync(bpy.context.evaluated_depsgraph_get(), is_transparent=False)
    above = np.eye(4)
    above[2, 3] = 6.0
    images = []
    for either in (sync, fresh):
        either.sync_camera(tyndall.prims.Camera(world_from_camera=above), Messages())
        settings = {"resolution": [16, 16], "samples": 4, "threads": 1, "guiding": "off"}
        images.append(np.array(tyndall.Session(either.delegate.commit(), settings).render().aov("rgba")))
    is_same = bool((images[0] == images[1]).all())
    return {"counts": counts, "is_same": is_same, "mean": float(images[0].mean())}


def viewport(folder: Path) -> dict[str, Any]:
    """The render of a viewport, without its drawing: pictures come, edits end it at once."""
    scene = still_life(folder)
    sync = SceneSync()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    sync.sync(depsgraph, is_transparent=False)
    above = np.eye(4)
    above[2, 3] = 6.0
    sync.sync_camera(tyndall.prims.Camera(world_from_camera=above), Messages())
    scene.tyndall.viewport_samples = 1_000_000
    settings = viewport_settings(scene, bpy.context.view_layer, (320, 240), 2)
    job = Job(sync.delegate.commit(), settings)
    deadline, shapes = time.monotonic() + 60.0, []
    while len(shapes) < 3 and time.monotonic() < deadline:
        image = job.take_image()
        if image is not None:
            shapes.append([*image.shape, bool(np.isfinite(image).all()), float(image[..., :3].mean())])
        time.sleep(0.01)
    start = time.monotonic()
    job.stop()
    seconds = time.monotonic() - start
    return {"images": shapes, "stop": seconds, "error": job.error, "resolution": settings["resolution"]}


def speed(folder: Path) -> dict[str, Any]:
    """CPU seconds of translating a million triangles, and 100,000 instances."""
    del folder
    scene = shots.new_scene("TYNDALL")
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=708, y_subdivisions=708)
    bpy.ops.object.shade_smooth()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start = time.process_time()
    SceneSync().sync(depsgraph, is_transparent=False)
    mesh_seconds = time.process_time() - start
    triangles = 2 * len(bpy.context.object.data.polygons)
    bpy.data.objects.remove(bpy.context.object)
    parent = shots.plane(100.0)
    points = np.random.default_rng(1).uniform(-50, 50, (100_000, 3))
    parent.data.clear_geometry()
    parent.data.from_pydata(points.tolist(), [], [])
    child = shots.cube(0.1)
    child.parent = parent
    parent.instance_type = "VERTS"
    del scene
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start = time.process_time()
    sync = SceneSync()
    sync.sync(depsgraph, is_transparent=False)
    instance_seconds = time.process_time() - start
    placed = sum(len(p.transforms) for p in sync._index.prims.values() if hasattr(p, "transforms"))
    return {"triangles": triangles, "mesh": mesh_seconds, "instances": placed, "instancing": instance_seconds}


def again(folder: Path) -> dict[str, Any]:
    """Register, unregister, register, render."""
    blender_addon.unregister()
    blender_addon.register()
    scene = still_life(folder)
    names = ("DATA_PT_light", "DATA_PT_EEVEE_light")
    lights = [name for name in names if "TYNDALL" in getattr(bpy.types, name).COMPAT_ENGINES]
    return {"said": render(), "engine": scene.render.engine, "panels of lights": lights}


_ALL = (passes, region, transparent, missing_grid, unknown_node)
_ANIMATIONS = (animation, blurred_animation, error_in_animation)
CASES = {
    f.__name__: f
    for f in (
        *_ALL,
        *_ANIMATIONS,
        *CASES_OF_GRIDS,
        *CASES_OF_WISHES,
        time_limit,
        edits,
        viewport,
        speed,
        again,
    )
}


def main(case: str, folder: str) -> None:
    """Play one case."""
    blender_addon.register()
    print("\n" + json.dumps(CASES[case](Path(folder))))  # noqa: T201


run(main)

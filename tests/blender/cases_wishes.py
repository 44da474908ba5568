"""Cases of `run_engine.py`: what view layers, worlds and objects ask for beside the objects themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import shots
from still_life import render, still_life

from blender_addon import messages

if TYPE_CHECKING:
    from pathlib import Path


def wishes_in_vain(folder: Path) -> dict[str, Any]:
    """All that is not rendered, at once."""
    scene = still_life(folder)
    layer = scene.view_layers[0]
    ball, cube, lamp = (scene.objects[name] for name in ("Sphere", "Cube", "AREA"))
    layer.use_volumes = False
    layer.aovs.add().name = "mask"
    layer.lightgroups.add(name="key")
    scene.render.use_multiview = True
    ball.is_holdout = True
    ball.visible_glossy = False
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    hidden.objects.link(cube)
    layer.layer_collection.children["Hidden"].indirect_only = True
    lamp.light_linking.receiver_collection = hidden
    hair = ball.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    hair.type, hair.count = "HAIR", 2
    scene.world.cycles_visibility.diffuse = False
    scene.camera.data.type = "PANO"
    return {"said": render(), "report": messages.last(scene.name).text()}


def layer_overrides(folder: Path) -> dict[str, Any]:
    """A view layer with samples of its own; then with a material; without a sky; with one unseen."""
    scene = still_life(folder)
    layer = scene.view_layers[0]
    layer.samples = 2
    for name in ("Cube", "AREA"):
        bpy.data.objects.remove(scene.objects[name])
    glow = shots.material(shots.plane(0.1, location=(0, 0, -50)), "ShaderNodeEmission", Color=(0, 0, 1, 1))
    shown = next(m for m in bpy.data.materials if m.node_tree == glow.id_data)
    said = [_save(scene, f"{folder}/scene")]
    layer.material_override = shown
    said.append(_save(scene, f"{folder}/material"))
    layer.material_override = None
    layer.use_sky = False
    said.append(_save(scene, f"{folder}/dark"))
    layer.use_sky = True
    scene.world.cycles_visibility.camera = False
    said.append(_save(scene, f"{folder}/unseen"))
    return {"said": said}


def unblurred(folder: Path) -> dict[str, Any]:
    """All that moves and is not blurred; blurred is the ball, by the picture and the core's own words."""
    scene = still_life(folder)
    scene.render.use_motion_blur = True
    for name in ("Sphere", "Cube", "AREA"):
        thing = scene.objects[name]
        for frame in (0, 2):
            thing.location.x += 0.5
            thing.keyframe_insert("location", frame=frame)
    floor = scene.objects["Plane"]
    floor.shape_key_add(name="Basis")
    key = floor.shape_key_add(name="Up")
    key.data[0].co.z += 1.0
    for frame in (0, 2):
        key.value = frame / 2
        key.keyframe_insert("value", frame=frame)
    text = bpy.data.curves.new("Text", "FONT")
    text.body = "T"
    for thing, name in ((text, "extrude"), (scene.camera.data, "lens")):
        for frame, value in ((0, 40.0), (2, 50.0)):
            setattr(thing, name, value)
            thing.keyframe_insert(name, frame=frame)
    shots.place("Text", text, (0, 0, -50))
    seen = {"said": render(), "report": messages.last(scene.name).text(), "frame": scene.frame_current_final}
    curve = scene.render.motion_blur_shutter_curve
    curve.curves[0].points[0].location = (0.0, 0.0)
    curve.update()
    return {**seen, "again": render(), "curve": messages.last(scene.name).text()}


def _save(scene: Any, path: str) -> str:
    scene.render.filepath = path
    return render()


CASES = (wishes_in_vain, unblurred, layer_overrides)

"""Run by Blender: write /shot/shot.blend, three small frames of a moving ball and a box of fog."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

import shots

for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
scene = bpy.context.scene
scene.render.engine = "TYNDALL"
scene.render.resolution_x, scene.render.resolution_y = 48, 36
scene.render.image_settings.file_format = "PNG"
scene.frame_start, scene.frame_end = 1, 3
shots.set_samples(scene, 4, 0)
shots.ball(Base_Color=(0.8, 0.1, 0.05, 1.0))
shots.material(shots.cube(1.0, location=(1, 0, 1)), "ShaderNodeVolumePrincipled", "Volume", Density=1.0)
for frame, x in ((1, 0.0), (3, 0.5)):
    bpy.data.objects["Sphere"].location.x = x
    bpy.data.objects["Sphere"].keyframe_insert("location", frame=frame)
bpy.ops.wm.save_as_mainfile(filepath="/shot/shot.blend")

"""Shots of things that move while the shutter is open; frame 1 is rendered."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy
from shots import camera, cube, lamp, material, place, plane, sky

if TYPE_CHECKING:
    from collections.abc import Callable


def _go(thing: Any, way: Any, turn: Any) -> None:
    """Let an object move by `way` and turn by `turn` within a frame, at an even pace."""
    for frame, sign in ((0, -1), (2, 1)):
        for name, half in (("location", way), ("rotation_euler", turn)):
            before = getattr(thing, name).copy()
            setattr(thing, name, [b + sign * h for b, h in zip(before, half, strict=True)])
            thing.keyframe_insert(name, frame=frame)
            setattr(thing, name, before)
    for curve in _curves(thing.animation_data.action):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def _curves(action: Any) -> Any:
    """Return the curves of an action with one slot; before Blender 4.4 there are no others."""
    if bpy.app.version < (4, 4, 0):
        return action.fcurves
    return action.layers[0].strips[0].channelbag(action.slots[0]).fcurves


def _stage(*, position: str = "CENTER", shutter: float = 1.0) -> None:
    render = bpy.context.scene.render
    render.use_motion_blur, render.motion_blur_position, render.motion_blur_shutter = True, position, shutter
    material(plane(20.0), "ShaderNodeBsdfDiffuse", Color=(0.3, 0.3, 0.3, 1))
    camera((0, -6, 2.0), (math.radians(80), 0, 0), lens=40)
    sky(0.6, (0.8, 0.9, 1.0))
    lamp("AREA", (2, -2, 4), (0.6, 0.5, 0), energy=150, size=2.0)


def moving_cube() -> None:
    """A cube that goes by and turns a quarter about itself."""
    _stage()
    thing = cube(1.2, location=(1.2, 0, 1))
    thing.scale = (1, 0.5, 1)
    material(thing, "ShaderNodeEmission", Color=(1.0, 0.4, 0.1, 1), Strength=4.0)
    _go(thing, (2.0, 0, 0.3), (0, math.radians(45), 0))


def moving_instances() -> None:
    """Two cubes of one collection, one of which moves; the shutter opens at the frame."""
    _stage(position="START", shutter=0.8)
    thing = cube(1.0)
    material(thing, "ShaderNodeEmission", Color=(1.0, 0.4, 0.1, 1), Strength=4.0)
    kept = bpy.data.collections.new("Cubes")
    kept.objects.link(thing)
    bpy.context.scene.collection.objects.unlink(thing)
    for x, way in ((-1.5, None), (0.5, (1.5, 0, 0.5))):
        empty = place("Place", None, (x, 0, 1))
        empty.instance_type, empty.instance_collection = "COLLECTION", kept
        if way is not None:
            _go(empty, way, (0, 0, 0.8))


def moving_camera() -> None:
    """A camera that passes a cube and turns after it; the shutter closes at the frame."""
    _stage(position="END", shutter=1.0)
    material(cube(1.2, location=(0.2, 0, 1)), "ShaderNodeEmission", Color=(1.0, 0.4, 0.1, 1), Strength=4.0)
    _go(bpy.context.scene.camera, (0.8, 0, 0), (0, 0, 0.2))


SHOTS: dict[str, Callable[[], Any]] = {
    "moving cube": moving_cube,
    "moving instances": moving_instances,
    "moving camera": moving_camera,
}

"""The scene that most cases of the engine begin with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import shots

if TYPE_CHECKING:
    from pathlib import Path


def still_life(folder: Path, samples: int = 4) -> Any:
    """Return a scene with a floor, a lamp and fog that writes to FOLDER/image####.exr."""
    scene = shots.new_scene("TYNDALL", resolution=(32, 24))
    shots.ball(Base_Color=(0.6, 0.3, 0.1, 1))
    shots.material(shots.cube(1.0, location=(1, 0, 1)), "ShaderNodeVolumePrincipled", "Volume")
    shots.set_samples(scene, samples, 0)
    scene.render.filepath = f"{folder}/image"
    return scene


def render(*, animation: bool = False) -> str:
    """Render and return what the operator says."""
    try:
        return ",".join(bpy.ops.render.render(write_still=not animation, animation=animation))
    except RuntimeError as error:
        return f"error: {error}"

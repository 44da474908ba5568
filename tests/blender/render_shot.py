"""Run by a Python with bpy: ENGINE SHOT SAMPLES SEEDS FOLDER [GRID [SCALE]] makes FOLDER/ENGINE-SEED.exr."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import lights_and_cameras  # noqa: E402
import media_shots  # noqa: E402
import motion_shots  # noqa: E402
import shots  # noqa: E402
import surface_shots  # noqa: E402
from process import run  # noqa: E402

import blender_addon  # noqa: E402

SHOTS = {
    **lights_and_cameras.SHOTS,
    **media_shots.SHOTS,
    **motion_shots.SHOTS,
    **surface_shots.SHOTS,
}


def main(engine: str, shot: str, samples: str, seeds: str, folder: str, *grid: str) -> None:
    """Render with every seed."""
    blender_addon.register()
    scene = shots.new_scene(engine)
    if shot == "clouds":
        shots.clouds(grid[0])
    elif grid:
        shots.cloud(grid[0], float(grid[1]))
    else:
        SHOTS[shot]()
    # Cycles 5 takes half a minute to bound a procedural medium; the bounds are those of every seed.
    scene.render.use_persistent_data = engine == "CYCLES"
    for seed in range(int(seeds)):
        shots.set_samples(scene, int(samples), seed)
        scene.render.filepath = f"{folder}/{engine}-{seed}.exr"
        bpy.ops.render.render(write_still=True)


run(main)

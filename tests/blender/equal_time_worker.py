"""Run by a Python with bpy: ENGINE SHOT WIDTH HEIGHT SAMPLES SEED TARGET [GRID] renders a shot.

Prints the CPU seconds of a render of one sample, and of all, as JSON on the last line.
"""

from __future__ import annotations

import json
import resource
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import media_shots  # noqa: E402
import shots  # noqa: E402
from process import run  # noqa: E402

import blender_addon  # noqa: E402

_BOUNCES = 32


def timed_render() -> float:
    """Render; return CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_SELF)
    bpy.ops.render.render(write_still=True)
    after = resource.getrusage(resource.RUSAGE_SELF)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(engine: str, shot: str, width: str, height: str, *rest: str) -> None:
    """Render once to tell what building the scene takes, and once to be judged."""
    samples, seed, target, *grid = rest
    blender_addon.register()
    scene = shots.new_scene(engine, resolution=(int(width), int(height)), bounces=_BOUNCES)
    if grid:
        shots.cloud(grid[0])
    else:
        media_shots.SHOTS[shot]()
    scene.render.filepath = target
    shots.set_samples(scene, 1, 1000)
    setup = timed_render()
    shots.set_samples(scene, int(samples), int(seed))
    print("\n" + json.dumps({"setup": setup, "cpu": timed_render()}))  # noqa: T201


run(main)

"""Run by a Python with bpy: ENGINE SHOT WIDTH HEIGHT SECONDS SAMPLES SEED TARGET [GRID] renders a shot.

With SAMPLES 0 it takes as many as fit SECONDS of CPU time. Prints samples and CPU seconds as JSON, last.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import shots  # noqa: E402

import blender_addon  # noqa: E402

#: Samples of the render that tells how fast it goes.
_PILOT = 8
_BOUNCES = 32


def timed_render() -> float:
    """Render; return CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_SELF)
    bpy.ops.render.render(write_still=True)
    after = resource.getrusage(resource.RUSAGE_SELF)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(engine: str, shot: str, width: str, height: str, *rest: str) -> None:
    """Render once for the scene to be built, then to be timed, if need be, and to be judged."""
    seconds, samples, seed, target, *grid = rest
    blender_addon.register()
    scene = shots.new_scene(engine, resolution=(int(width), int(height)), bounces=_BOUNCES)
    if grid:
        shots.cloud(grid[0])
    else:
        shots.SHOTS[shot]()
    scene.render.filepath = target
    # Both engines keep the scene then: what the first render takes is not the price of samples.
    scene.render.use_persistent_data = True
    shots.set_samples(scene, 1, 1000)
    setup, count = timed_render(), int(samples)
    if count == 0:
        shots.set_samples(scene, _PILOT, 1000)
        count = max(int(float(seconds) * _PILOT / timed_render()), 1)
    shots.set_samples(scene, count, int(seed))
    print("\n" + json.dumps({"samples": count, "setup": setup, "cpu": timed_render()}))  # noqa: T201


code = 0
try:
    main(*sys.argv[1:])
except Exception as error:
    print(f"{type(error).__name__}: {error}", file=sys.stderr)  # noqa: T201
    code = 1
sys.stdout.flush()
sys.stderr.flush()
# Some versions crash or hang when Python ends in the ordinary way.
os._exit(code)

"""Renders one scene with one renderer, as often as it is asked to.

Its own process, so that CPU time is the renderer's, and one that stays, so that nothing is compiled twice.
Usage: ``worker.py RENDERER SCENE_JSON OUT_FOLDER --threads N``. Says ``{}`` when it is ready; every line
``{"spp": n, "seed": s}`` on its input is answered by one line with the CPU and wall seconds of that render
and the file of its image. ``sampling_seconds`` are the CPU seconds without what a renderer does each time
before its first sample: we build our world then, Mitsuba when it loads the scene. Whatever a renderer prints
goes to the error stream.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

# Takes samples a pixel and a seed, and gets ready.
Prepare = Callable[[int, int], Callable[[], np.ndarray]]
# Mitsuba keeps all paths of a pass in memory; longer renders are sums of passes.
SAMPLES_PER_PASS = 16


def tyndall(scene: Path, threads: int, **chosen: str) -> Prepare:
    """Return a function that renders with our renderer and `chosen` settings from the scene's USD twin."""
    import tyndall
    from support.render import sync_stage

    delegate = tyndall.RenderDelegate()
    settings = sync_stage(scene.with_suffix(".usda"), delegate)
    committed = delegate.commit()
    settings |= {
        "maxBounces": json.loads(scene.read_text(encoding="utf-8"))["render"]["max_scatter"],
        "filter": "box",
        "threads": threads,
        "aovs": ["rgba"],
        **chosen,
    }

    def prepare(spp: int, seed: int) -> Callable[[], np.ndarray]:
        session = tyndall.Session(committed, {**settings, "samples": spp, "seed": seed})
        return lambda: np.array(session.render().aov("rgba"))[..., :3]

    return prepare


def cycles(scene: Path, threads: int) -> Prepare:
    """Return the same for Cycles."""
    import cycles_scene

    cycles_scene.load(scene, threads)
    return lambda spp, seed: partial(cycles_scene.render, spp, seed)


def mitsuba(variant: str) -> Callable[[Path, int], Prepare]:
    """Return the same for a variant of Mitsuba 3."""

    def build(scene: Path, threads: int) -> Prepare:
        import drjit
        import mitsuba as mi

        mi.set_variant(variant)
        mi.set_log_level(mi.LogLevel.Error)
        drjit.set_thread_count(threads)
        import mitsuba_scene

        loaded, _ = mitsuba_scene.load(scene)

        def render(spp: int, seed: int) -> np.ndarray:
            passes = [SAMPLES_PER_PASS] * (spp // SAMPLES_PER_PASS) or [spp]
            assert sum(passes) == spp, f"{spp} samples are no multiple of {SAMPLES_PER_PASS}"
            total = 0.0
            for i, samples in enumerate(passes):
                total = total + np.array(mi.render(loaded, spp=samples, seed=seed * 4096 + i)) * samples
            return total / spp

        return lambda spp, seed: partial(render, spp, seed)

    return build


RENDERERS: dict[str, Callable[[Path, int], Prepare]] = {
    "tyndall": tyndall,
    "cycles": cycles,
    "mitsuba-llvm": mitsuba("llvm_ad_rgb"),
    "mitsuba-scalar": mitsuba("scalar_rgb"),
    **{
        f"tyndall-{strategy}": partial(tyndall, distanceSampling=strategy, guiding="on")
        for strategy in ("delta", "nds", "nds+", "target", "odds")
    },
}


def cpu_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("renderer", choices=RENDERERS)
    parser.add_argument("scene", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--threads", type=int, required=True)
    arguments = parser.parse_args()

    # Blender prints to the standard output, past Python too.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def answer(value: dict[str, object]) -> None:
        answers.write(json.dumps(value) + "\n")
        answers.flush()

    prepare = RENDERERS[arguments.renderer](arguments.scene, arguments.threads)
    # The first render compiles kernels or loads libraries, which is not what is measured.
    prepare(1, 0)()
    answer({})
    for line in sys.stdin:
        wanted = json.loads(line)
        cpu, wall = cpu_seconds(), time.perf_counter()
        render = prepare(wanted["spp"], wanted["seed"])
        prepared = cpu_seconds()
        image = render()
        sampling = cpu_seconds() - prepared
        cpu, wall = cpu_seconds() - cpu, time.perf_counter() - wall
        file = arguments.out / f"{arguments.scene.stem}_{arguments.renderer}_{wanted['spp']}.npy"
        np.save(file, image.astype(np.float32))
        seconds = {"cpu_seconds": cpu, "sampling_seconds": sampling, "wall_seconds": wall}
        answer({"spp": wanted["spp"], **seconds, "image": file.name})


if __name__ == "__main__":
    main()

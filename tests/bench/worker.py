"""Renders one scene with one renderer at a ladder of sample counts; one JSON line a render.

Its own process, so that CPU time is the renderer's. Usage: ``worker.py RENDERER SCENE_JSON OUT_FOLDER
--threads N --seconds S``: counts double fourfold until a render took S seconds of CPU time a thread.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

Render = Callable[[int, int], np.ndarray]
# Mitsuba keeps all paths of a pass in memory; longer renders are sums of passes.
SAMPLES_PER_PASS = 16
LADDER = (1, 4, 16, 64, 256, 1024, 4096)


def tyndall(scene: Path, threads: int) -> Render:
    """Return a function that renders with our renderer from the USD twin of the scene."""
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
    }

    def render(spp: int, seed: int) -> np.ndarray:
        film = tyndall.Session(committed, {**settings, "samples": spp, "seed": seed}).render()
        return np.array(film.aov("rgba"))[..., :3]

    return render


def mitsuba(variant: str) -> Callable[[Path, int], Render]:
    """Return the same for a variant of Mitsuba 3."""

    def build(scene: Path, threads: int) -> Render:
        import drjit
        import mitsuba as mi

        mi.set_variant(variant)
        mi.set_log_level(mi.LogLevel.Error)
        drjit.set_thread_count(threads)
        import mitsuba_scene

        loaded, _ = mitsuba_scene.load(scene)

        def render(spp: int, seed: int) -> np.ndarray:
            passes = [SAMPLES_PER_PASS] * (spp // SAMPLES_PER_PASS) or [spp]
            total = 0.0
            for i, samples in enumerate(passes):
                total = total + np.array(mi.render(loaded, spp=samples, seed=seed * 4096 + i)) * samples
            return total / sum(passes)

        # The first render compiles the kernels, which is not what is measured.
        render(1, 0)
        return render

    return build


RENDERERS: dict[str, Callable[[Path, int], Render]] = {
    "tyndall": tyndall,
    "mitsuba-llvm": mitsuba("llvm_ad_rgb"),
    "mitsuba-scalar": mitsuba("scalar_rgb"),
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
    parser.add_argument("--seconds", type=float, required=True)
    arguments = parser.parse_args()

    render = RENDERERS[arguments.renderer](arguments.scene, arguments.threads)
    for seed, spp in enumerate(LADDER, start=1):
        cpu, wall = cpu_seconds(), time.perf_counter()
        image = render(spp, seed)
        cpu, wall = cpu_seconds() - cpu, time.perf_counter() - wall
        file = arguments.out / f"{arguments.scene.stem}_{arguments.renderer}_{spp}.npy"
        np.save(file, image.astype(np.float32))
        result = {"spp": spp, "cpu_seconds": cpu, "wall_seconds": wall, "image": file.name}
        sys.stdout.write(json.dumps(result) + "\n")
        sys.stdout.flush()
        # The next rung costs four times as much.
        if cpu / arguments.threads > arguments.seconds / 2:
            break


if __name__ == "__main__":
    main()

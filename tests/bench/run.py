"""Speed and error against time, beside Cycles and Mitsuba 3 in the same run; and what unused features cost.

Every figure is CPU seconds divided by threads (shared machines make wall time meaningless); wall time is in
the JSON. Writes out/bench/results.json and prints the tables. Scenes and references come with the shared
data.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import lean
import shots
import strategies
from measure import Measurement, Pairs, Worker, WorkerError, alternate, error_at, ladder, samples_per_second
from support.shared import REPO, shared_root

SCENES = ("kitchen", "jungle", "cloud", "landscape", "underwater")
RENDERERS = ("tyndall", "cycles", "mitsuba-llvm", "mitsuba-scalar")
PARTS = ("peers", "start", "lean")
#: Measured if asked for: it takes longer than all of these.
FURTHER_PARTS = ("strategies", "shots")
STARTS = 5


def llvm_library() -> str | None:
    """Return an LLVM that Mitsuba's compiler works with: 16 or newer (15 and older abort), or None."""
    if found := os.environ.get("DRJIT_LIBLLVM_PATH"):
        return found
    libraries: list[tuple[int, str]] = []
    for folder in (Path("/usr/lib"), Path("/usr/local/lib")):
        for path in [*folder.glob("*/libLLVM*.so*"), *folder.glob("llvm-*/lib/libLLVM*.so*")]:
            digits = "".join(c if c.isdigit() else " " for c in str(path.resolve().name)).split()
            versions = [int(d) for d in digits if 16 <= int(d) < 40]
            if versions:
                libraries.append((versions[0], str(path)))
    return max(libraries)[1] if libraries else None


def environment() -> dict[str, str]:
    """Return the environment of the workers."""
    library = llvm_library()
    return {**os.environ, **({"DRJIT_LIBLLVM_PATH": library} if library else {})}


def available(wanted: list[str]) -> list[str]:
    """Return the renderers that can run here; say why others cannot."""
    missing = {}
    if not llvm_library():
        missing["mitsuba-llvm"] = "no LLVM 16 or newer (on Debian: apt-get install libllvm19)"
    if importlib.util.find_spec("bpy") is None:
        missing["cycles"] = "bpy 5.0.1 is not installed (its wheel needs Python 3.11)"
    for renderer in wanted:
        if renderer in missing:
            sys.stderr.write(f"{missing[renderer]}: {renderer} is left out\n")
    return [r for r in wanted if r not in missing]


def race(
    scene: str, renderers: list[str], arguments: argparse.Namespace
) -> tuple[list[Measurement], list[Pairs]]:
    """Measure a scene with all renderers, then us and the fastest Mitsuba in turns."""
    threads, measurements, pairs = arguments.threads, [], []
    with contextlib.ExitStack() as stack:
        workers: dict[str, Worker] = {}
        rates: dict[str, float] = {}
        for renderer in renderers:
            try:
                worker = stack.enter_context(Worker(scene, renderer, threads, arguments.out, environment()))
                rungs = ladder(worker.measure, threads, arguments.seconds)
            except WorkerError as error:
                sys.stderr.write(f"{error}\n")
                continue
            measurements += rungs
            workers[renderer], rates[renderer] = worker, samples_per_second(rungs, threads)
            sys.stderr.write(f"{scene} {renderer}: {rates[renderer]:.2f} spp/s\n")
        peers = [r for r in workers if r.startswith("mitsuba")]
        if "tyndall" in workers and peers:
            fastest = max(peers, key=lambda r: rates[r])
            pairs.append(alternate(workers["tyndall"], workers[fastest], rates))
    return measurements, pairs


def start_up() -> dict[str, Any]:
    """Measure from the start of the process to the first finished sample of the cloud scene, and its end."""
    stage = shared_root() / "cases" / "scenes" / "cloud.usda"
    command = Path(sys.executable).parent / "tyndall"
    wall, cpu, stats = [], [], {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(STARTS):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            start = time.perf_counter()
            subprocess.run(
                [
                    *(str(command), "render", str(stage), "-o", f"{folder}/image.exr", "--spp", "1"),
                    *("--filter", "box", "--progress", "none", "--stats", f"{folder}/stats.json"),
                ],
                check=True,
                capture_output=True,
            )
            wall.append(time.perf_counter() - start)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        stats = json.loads(Path(folder, "stats.json").read_text(encoding="utf-8"))
    return {
        "wall_seconds": statistics.median(wall),
        "wall_seconds_best": min(wall),
        "cpu_seconds": statistics.median(cpu),
        "stats_of_last": stats,
    }


def table(rows: list[list[str]]) -> str:
    """Return rows as a Markdown table, the first being its head."""
    head, *body = rows
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in body])


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)


def _in_turns(pairs: list[Pairs], scene: str) -> str:
    """Return the median ratio of a scene's pairs with the range."""
    for found in pairs:
        if found.scene == scene:
            return f"{found.median:.2f} ({min(found.ratios):.2f} to {max(found.ratios):.2f})"
    return "-"


def report(measurements: list[Measurement], pairs: list[Pairs], threads: int, times: list[float]) -> str:
    """Return the tables: speed, error at equal time, means."""
    renderers = [r for r in RENDERERS if any(m.renderer == r for m in measurements)]
    speed = [["scene", *(f"{r} (spp/s)" for r in renderers), "tyndall / Mitsuba in turns"]]
    errors = [["scene", *(f"{r} {seconds:g} s" for seconds in times for r in renderers)]]
    means = [["scene", *renderers]]
    for scene in dict.fromkeys(m.scene for m in measurements):
        of = {r: [m for m in measurements if (m.scene, m.renderer) == (scene, r)] for r in renderers}
        rates = [samples_per_second(of[r], threads) if of[r] else math.nan for r in renderers]
        speed.append([scene, *(_number(rate, ".2f") for rate in rates), _in_turns(pairs, scene)])
        at = [error_at(of[r], threads, seconds) for seconds in times for r in renderers]
        errors.append([scene, *(_number(error, ".4g") for error in at)])
        last = [max(of[r], key=lambda m: m.spp) if of[r] else None for r in renderers]
        means.append([scene, *(" ".join(f"{c:.3f}" for c in m.channel_ratios) if m else "-" for m in last)])
    return (
        f"Samples a pixel in one CPU second of each of {threads} threads:\n\n{table(speed)}\n\n"
        "relMSE at equal CPU time a thread (worst 0.1 % of pixels dropped, reference noise taken off):\n\n"
        f"{table(errors)}\n\n"
        f"Mean of the longest render over the reference's, red green blue:\n\n{table(means)}\n"
    )


def parse() -> argparse.Namespace:
    """Return the arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        *("--seconds", "-s"),
        type=float,
        nargs="+",
        default=[4.0, 10.0],
        help="CPU seconds a thread at which errors are told; the longest render takes the most of them",
    )
    parser.add_argument("--scenes", nargs="+", default=SCENES, choices=SCENES)
    parser.add_argument("--renderers", nargs="+", default=RENDERERS, choices=RENDERERS)
    parser.add_argument("--parts", nargs="+", default=PARTS, choices=(*PARTS, *FURTHER_PARTS))
    parser.add_argument("--shots", nargs="+", default=tuple(shots.SHOTS), choices=shots.SHOTS)
    parser.add_argument("--modes", nargs="+", default=tuple(shots.MODES), choices=shots.MODES)
    parser.add_argument("--shot-spp", type=int, default=128, help="samples a pixel of each frame of a shot")
    parser.add_argument("--shot-frames", type=int, default=shots.N_FRAMES, help="frames of each shot")
    parser.add_argument("--out", type=Path, default=REPO / "out" / "bench")
    arguments = parser.parse_args()
    needs_scenes = {"peers", "start", "strategies"} & set(arguments.parts)
    if needs_scenes and not (shared_root() / "cases" / "scenes").is_dir():
        sys.exit(f"{shared_root()} is absent: set TYNDALL_SHARED to the folder with the benchmark scenes")
    return arguments


def main() -> None:
    """Run the benchmark."""
    arguments = parse()
    arguments.out.mkdir(parents=True, exist_ok=True)
    results: dict[str, Any] = {"threads": arguments.threads}
    texts = []
    if "peers" in arguments.parts:
        renderers = available(arguments.renderers)
        raced = [race(scene, renderers, arguments) for scene in arguments.scenes]
        measurements = [m for found, _ in raced for m in found]
        pairs = [p for _, found in raced for p in found]
        results["measurements"] = [asdict(m) for m in measurements]
        results["pairs"] = [{**asdict(p), "ratios": p.ratios, "median": p.median} for p in pairs]
        texts.append(report(measurements, pairs, arguments.threads, arguments.seconds))
    if "start" in arguments.parts:
        results["start_up"] = started = start_up()
        texts.append(
            f"Start-up, cloud scene, process start to end with 1 sample: {started['wall_seconds']:.2f} s "
            f"(best {started['wall_seconds_best']:.2f} s), {started['cpu_seconds']:.2f} CPU s\n"
        )
    if "lean" in arguments.parts:
        checks = lean.measure()
        results["lean"] = [asdict(check) for check in checks]
        head = ["unused", "measured", "without", "with", "ratio"]
        texts.append("What is not used costs nothing:\n\n" + table([head, *map(lean.row, checks)]) + "\n")
    if "strategies" in arguments.parts:
        found = strategies.measure(
            arguments.scenes, arguments.threads, arguments.seconds, arguments.out, environment()
        )
        results["strategies"] = [asdict(m) for m in found]
        for seconds in arguments.seconds:
            rows = strategies.summary(found, arguments.threads, seconds)
            title = f"relMSE after {seconds:g} CPU s a thread (gain over delta), directions guided:"
            texts.append(f"{title}\n\n{table(rows)}\n")
    if "shots" in arguments.parts:
        frames = shots.measure(arguments.shots, arguments.modes, arguments.shot_spp, arguments.shot_frames)
        results["shots"] = shots.as_json(frames)
        title = (
            f"Frames after the first, warm over cold, {arguments.shot_spp} samples a pixel (geometric means):"
        )
        texts.append(f"{title}\n\n{table(shots.summary(frames))}\n")
    text = "\n".join(texts)
    (arguments.out / "results.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    (arguments.out / "tables.md").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()

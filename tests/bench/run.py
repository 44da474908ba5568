"""Speed and error against time, beside Mitsuba 3 in the same run.

Every figure is CPU seconds divided by threads (shared machines make wall time meaningless); wall time is in
the JSON. Writes out/bench/results.json and prints the tables. Scenes and references come with the shared
data.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from support import exr
from support.shared import REPO, shared_root
from support.statistics import relative_mse

SCENES = ("kitchen", "jungle", "cloud", "landscape", "underwater")
RENDERERS = ("tyndall", "mitsuba-llvm", "mitsuba-scalar")
STARTS = 5


@dataclass(frozen=True, slots=True)
class Measurement:
    """One render of a scene."""

    scene: str
    renderer: str
    spp: int
    cpu_seconds: float
    wall_seconds: float
    relative_mse: float
    mean_ratio: float


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


def measure(scene: str, renderer: str, threads: int, seconds: float, out: Path) -> list[Measurement]:
    """Render a ladder of sample counts in a process of its own."""
    cases = shared_root() / "cases"
    worker = Path(__file__).with_name("worker.py")
    command = [sys.executable, worker, renderer, cases / "scenes" / f"{scene}.json", out]
    options = ["--threads", str(threads), "--seconds", str(seconds)]
    done = subprocess.run(
        [*map(str, command), *options], capture_output=True, text=True, env=environment(), check=False
    )
    if done.returncode != 0:
        sys.stderr.write(f"{scene} with {renderer} failed ({done.returncode}):\n{done.stderr[-2000:]}\n")
    reference = exr.read_rgb(cases / "references" / f"{scene}.exr").astype(np.float64)
    stated = json.loads((cases / "references" / "references.json").read_text(encoding="utf-8"))[scene]
    found = []
    for line in done.stdout.splitlines():
        if not line.startswith("{"):
            continue
        result = json.loads(line)
        image = np.load(out / result.pop("image"))
        found.append(
            Measurement(
                scene=scene,
                renderer=renderer,
                relative_mse=relative_mse(image, reference, stated["relMSE_of_reference"]),
                mean_ratio=float(image.mean() / reference.mean()),
                **result,
            )
        )
    return found


def samples_per_second(measurements: list[Measurement], threads: int) -> float:
    """Return samples a pixel in a second of CPU time a thread, from the longest render."""
    longest = max(measurements, key=lambda m: m.cpu_seconds)
    return longest.spp / (longest.cpu_seconds / threads)


def error_at(measurements: list[Measurement], threads: int, seconds: float) -> float:
    """Return the error at a time by interpolating between the neighbouring renders in log-log."""
    points = sorted((m.cpu_seconds / threads, m.relative_mse) for m in measurements if m.relative_mse > 0)
    for (t0, e0), (t1, e1) in itertools.pairwise(points):
        if t0 <= seconds <= t1:
            share = math.log(seconds / t0) / math.log(t1 / t0)
            return math.exp(math.log(e0) * (1 - share) + math.log(e1) * share)
    if points and seconds > points[-1][0]:  # noise falls with time beyond the last render too
        return points[-1][1] * points[-1][0] / seconds
    return math.nan


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


def report(measurements: list[Measurement], threads: int, times: list[float]) -> str:
    """Return the two tables."""
    speed = [["scene", *(f"{r} (spp/s)" for r in RENDERERS), "tyndall / fastest Mitsuba"]]
    errors = [["scene", "CPU s / thread", *RENDERERS]]
    means = [["scene", *(f"{r}: mean / reference" for r in RENDERERS)]]
    for scene in dict.fromkeys(m.scene for m in measurements):
        by_renderer = {r: [m for m in measurements if (m.scene, m.renderer) == (scene, r)] for r in RENDERERS}
        rates = {r: samples_per_second(ms, threads) if ms else math.nan for r, ms in by_renderer.items()}
        peers = [rate for r, rate in rates.items() if r != "tyndall" and not math.isnan(rate)]
        ratio = rates["tyndall"] / max(peers) if peers else math.nan
        speed.append([scene, *(f"{rates[r]:.2f}" for r in RENDERERS), f"{ratio:.2f}"])
        errors += [
            [scene, f"{seconds:g}", *(f"{error_at(by_renderer[r], threads, seconds):.4g}" for r in RENDERERS)]
            for seconds in times
        ]
        last = {
            r: max(ms, key=lambda m: m.spp).mean_ratio if ms else math.nan for r, ms in by_renderer.items()
        }
        means.append([scene, *(f"{last[r]:.4f}" for r in RENDERERS)])
    return (
        f"Samples a pixel in one CPU second of each of {threads} threads:\n\n{table(speed)}\n\n"
        "relMSE at equal time (worst 0.1 % of pixels dropped, reference noise taken off):\n\n"
        f"{table(errors)}\n\nMeans of the longest renders:\n\n{table(means)}\n"
    )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        "--seconds", type=float, default=10.0, help="CPU seconds a thread of the longest render"
    )
    parser.add_argument("--scenes", nargs="+", default=SCENES, choices=SCENES)
    parser.add_argument("--renderers", nargs="+", default=RENDERERS, choices=RENDERERS)
    parser.add_argument("--out", type=Path, default=REPO / "out" / "bench")
    arguments = parser.parse_args()
    if not (shared_root() / "cases" / "scenes").is_dir():
        sys.exit(f"{shared_root()} is absent: set TYNDALL_SHARED to the folder with the benchmark scenes")
    renderers = [r for r in arguments.renderers if r != "mitsuba-llvm" or llvm_library()]
    if len(renderers) < len(arguments.renderers):
        sys.stderr.write(
            "no LLVM 16 or newer (on Debian: apt-get install libllvm19): mitsuba-llvm is left out\n"
        )

    arguments.out.mkdir(parents=True, exist_ok=True)
    measurements: list[Measurement] = []
    for scene in arguments.scenes:
        for renderer in renderers:
            measurements += measure(scene, renderer, arguments.threads, arguments.seconds, arguments.out)
            rate = samples_per_second(measurements[-1:], arguments.threads) if measurements else math.nan
            sys.stderr.write(f"{scene} {renderer}: {rate:.2f} spp/s\n")
    results: dict[str, Any] = {
        "threads": arguments.threads,
        "measurements": [asdict(m) for m in measurements],
    }
    times = [arguments.seconds / 5, arguments.seconds / 2, arguments.seconds]
    text = report(measurements, arguments.threads, times)
    if "tyndall" in renderers:
        results["start_up"] = started = start_up()
        text += (
            f"\nStart-up, cloud scene, process start to end with 1 sample: {started['wall_seconds']:.2f} s "
            f"(best {started['wall_seconds_best']:.2f} s), {started['cpu_seconds']:.2f} CPU s\n"
        )
    (arguments.out / "results.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    (arguments.out / "tables.md").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()

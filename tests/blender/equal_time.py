"""Volume shots at equal CPU time beside Cycles in the same Blender: `python tests/blender/equal_time.py`.

The squared error of either falls as one over the time: both take the same number of samples, and error times
seconds is what is compared. Seconds are CPU seconds without those of a render of one sample, which is mostly
the building of the scene and is told apart. The reference is a long render of Cycles: where the two differ by
more than noise, ours pays for it. Prints a table and writes OUT/equal_time.json.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from support import exr  # noqa: E402
from support.statistics import relative_mse  # noqa: E402

SHOTS = ("cloud", "world fog", "cube")
ENGINES = ("TYNDALL", "CYCLES")
#: Seeds of the two halves of the reference.
REFERENCE_SEEDS = (77, 78)


def write_cloud(path: Path, size: int = 64) -> None:
    """Write the grid of the shot with one: a lump with waves on it."""
    import tyndall

    axis = np.linspace(-1.0, 1.0, size)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    waves = 0.3 * np.sin(7 * x) * np.cos(5 * y) + 0.2 * np.sin(13 * z + 4 * x)
    density = np.clip(6.0 * (0.8 - np.sqrt(x**2 + y**2 + 2 * z**2) + waves), 0.0, 4.0)
    tyndall.write_vdb(path, "density", density.astype(np.float32), 2.0 / (size - 1), (-1.0, -1.0, -1.0))


def render(
    engine: str, shot: str, arguments: argparse.Namespace, samples: int, seed: int, folder: Path
) -> tuple[Any, dict[str, float]]:
    """Return the picture and the CPU seconds of one render in a process of its own."""
    target = folder / f"{engine}.exr"
    command = [sys.executable, str(HERE / "equal_time_worker.py"), engine, shot]
    command += [*map(str, arguments.resolution), str(samples), str(seed), str(target)]
    if shot == "cloud":
        command.append(str(folder / "cloud.vdb"))
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{engine}, {shot}: {done.stderr[-2000:]}")
    return exr.read_rgb(target), json.loads(done.stdout.strip().splitlines()[-1])


def race(shot: str, arguments: argparse.Namespace, folder: Path) -> list[dict[str, Any]]:
    """Measure a shot; the engines take turns."""
    halves = [
        render("CYCLES", shot, arguments, arguments.reference // 2, s, folder)[0] for s in REFERENCE_SEEDS
    ]
    reference = np.mean(halves, axis=0)
    # Two halves differ by twice the variance of one, which is twice that of their mean.
    own_error = relative_mse(*halves) / 4
    runs: dict[str, list[tuple[float, float, float]]] = {engine: [] for engine in ENGINES}
    for seed in range(1, arguments.seeds + 1):
        for engine in ENGINES:
            image, told = render(engine, shot, arguments, arguments.samples, seed, folder)
            error = relative_mse(image, reference, own_error)
            runs[engine].append((error, told["cpu"] - told["setup"], told["setup"]))
    rows = []
    for engine, measured in runs.items():
        error, seconds, setup = (float(np.mean(column)) for column in zip(*measured, strict=True))
        rows.append(
            {
                "shot": shot,
                "engine": engine,
                "seconds": seconds,
                "relMSE": error,
                "after": error * seconds,
                "setup": setup,
            }
        )
    return rows


def main() -> None:
    """Race and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shots", nargs="+", default=SHOTS, choices=SHOTS)
    parser.add_argument("--resolution", nargs=2, type=int, default=(64, 48))
    parser.add_argument("--samples", type=int, default=128, help="samples per pixel of the renders compared")
    parser.add_argument("--seeds", type=int, default=2, help="renders of each engine")
    parser.add_argument("--reference", type=int, default=2048, help="samples per pixel of the reference")
    parser.add_argument("--out", type=Path, default=HERE.parents[1] / "out")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_cloud(folder / "cloud.vdb")
        for shot in arguments.shots:
            rows += race(shot, arguments, folder)
            for row in rows[-len(ENGINES) :]:
                line = "{shot:10} {engine:8} {seconds:6.2f} s  relMSE {relMSE:.6f}"
                line += "  after 1 s {after:.6f}  setup {setup:.2f} s"
                sys.stdout.write(line.format(**row) + "\n")
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "equal_time.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()

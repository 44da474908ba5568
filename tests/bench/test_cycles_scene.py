"""The Cycles translator against calibration images, each of one convention; skips without bpy or shared data.

Grids are left to the benchmark itself (its table of means): Cycles takes seconds before their first sample.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import exr, pictures
from support.shared import TESTS, shared
from support.statistics import squared_difference

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("bpy") is None, reason="bpy is not installed: scripts/requirements/bench.txt"
)

SPP, SEEDS = 32, 3
# What Cycles' own bias at few samples may leave of relative squared difference, and of the mean. Mistakes are
# far above, such as a sky turned by a quarter or the wrong sign of g.
LARGEST_DIFFERENCE = 2e-3
LARGEST_DEVIATION = 0.02


def cycles(scene: Path, out: Path) -> np.ndarray:
    """Return independent renders by the benchmark's worker, shape (seeds, height, width, 3)."""
    worker = Path(__file__).with_name("worker.py")
    # Different counts, since images are named by them.
    wanted = [{"spp": SPP + seed, "seed": seed} for seed in range(SEEDS)]
    done = subprocess.run(
        [sys.executable, worker, "cycles", scene, out, "--threads", "2"],
        input="".join(json.dumps(line) + "\n" for line in wanted),
        env={**os.environ, "PYTHONPATH": str(TESTS)},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    return np.stack([np.load(out / answer["image"]) for answer in answers if answer])


@pytest.mark.parametrize("name", ["env", "phase", "rect", "sphere"])
def test_conventions(name: str, tmp_path: Path) -> None:
    scene = shared("cases", "calib", f"{name}.json")
    reference = exr.read_rgb(shared("cases", "calib", "references", f"{name}.exr")).astype(np.float64)
    images = cycles(scene, tmp_path)
    ratio = images.mean(axis=(0, 1, 2)) / reference.mean(axis=(0, 1))
    difference = squared_difference(images, reference)
    text = f"{name}: mean/reference {np.round(ratio, 4)}, squared difference {difference}"
    pictures.note(text)
    assert (np.abs(ratio - 1) < LARGEST_DEVIATION).all(), text
    assert difference.value < LARGEST_DIFFERENCE + 3 * difference.error, text

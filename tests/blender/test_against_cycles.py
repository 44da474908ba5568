"""Units and materials against Cycles in the same Blender: means of small shots, by z-test.

Cycles is the artists' reference. Where both are right the means differ by noise alone; what a model of ours
does differently on purpose is stated with its shot.
"""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support import exr
from support.blender_host import needs_bpy
from support.statistics import estimate

if TYPE_CHECKING:
    import numpy.typing as npt

pytestmark = needs_bpy

SEEDS = 4
SAMPLES = 64
#: Largest relative difference of means that counts as agreement, beyond noise.
AGREEMENT = 0.01
#: One of each kind; make test has no time for all of them.
_FEW = frozenset(
    {"area", "sun", "hdri", "parallel camera", "cube", "world fog", "overlap", "plastic", "glass", "noise"}
)
_EXACT = (
    *("point", "sphere", "spot", "area", "ellipse", "spread", "sun", "mesh light"),
    *("hdri", "gradient sky", "sky texture", "shifted camera", "parallel camera"),
    *("cube", "absorption colour", "black body", "scatter and absorption", "coefficients", "overlap"),
    *("noise", "noise 4D", "voronoi", "gradient", "wave", "coloured noise", "glowing ball"),
    *("moving cube", "moving instances", "moving camera"),
    *("world fog", "plastic", "matte", "metal", "glossy", "glass", "half there", "glowing"),
)


def render(engine: str, shot: str, folder: Path, *extra: str) -> npt.NDArray[np.float32]:
    """Return the renders of a shot, shape (seeds, height, width, 3)."""
    script = Path(__file__).with_name("render_shot.py")
    command = [sys.executable, str(script), engine, shot, str(SAMPLES), str(SEEDS), str(folder), *extra]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout[-1500:] + done.stderr[-1500:]
    return np.stack([exr.read_rgb(folder / f"{engine}-{seed}.exr") for seed in range(SEEDS)])


def assert_agrees(shot: str, folder: Path, *extra: str) -> None:
    """Compare means, in all and by quarters of the picture."""
    ours, theirs = (render(engine, shot, folder, *extra) for engine in ("TYNDALL", "CYCLES"))
    h, w = ours.shape[1] // 2, ours.shape[2] // 2
    parts = [(slice(None), slice(None))]
    parts += [(slice(y, y + h), slice(x, x + w)) for y in (0, h) for x in (0, w)]
    for rows, columns in parts:
        a, b = (estimate(images[:, rows, columns]) for images in (ours, theirs))
        allowed = 4 * np.hypot(a.error, b.error) + AGREEMENT * b.mean
        assert (np.abs(a.mean - b.mean) <= allowed).all(), (
            f"{shot}, rows {rows}, columns {columns}: ours {a.mean} +- {a.error}, "
            f"Cycles {b.mean} +- {b.error}, ratio {a.mean / b.mean}"
        )


#: Blender's release that brought what a shot shows; 5.0 gave Voronoi other cells, which are ours.
_SINCE = {"coefficients": (4, 5), "ellipse": (4, 5), "voronoi": (5, 0), "coloured noise": (5, 0)}


def cases(*shots: str) -> list[pytest.param]:
    """Return shots as parameters; most of them are long."""
    return [pytest.param(shot, marks=() if shot in _FEW else pytest.mark.long) for shot in shots]


@pytest.mark.parametrize("shot", cases(*_EXACT))
def test_means(shot: str, tmp_path: Path) -> None:
    release = tuple(int(n) for n in importlib.metadata.version("bpy").split(".")[:2])
    if release < _SINCE.get(shot, release):
        pytest.skip(f"Blender {release} has no such thing yet")
    assert_agrees(shot, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("arguments", [("cloud", "1.0"), ("cloud", "1.7"), ("clouds",)], ids=" ".join)
def test_grid(arguments: tuple[str, ...], tmp_path: Path) -> None:
    """A cloud in a file; in object space, scaling it does not make it thicker, be it an instance or not."""
    tyndall = pytest.importorskip("tyndall")
    axis = np.linspace(-1.0, 1.0, 24)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    bumps = 0.3 * np.sin(7 * x) * np.cos(5 * y)
    density = np.clip(1.2 - 1.5 * np.sqrt(x**2 + y**2 + 2 * z**2) + bumps, 0, None)
    path = tmp_path / "cloud.vdb"
    tyndall.write_vdb(path, "density", density.astype(np.float32), 2.0 / 23, (-1.0, -1.0, -1.0))
    shot, *scale = arguments
    assert_agrees(shot, tmp_path, str(path), *scale)

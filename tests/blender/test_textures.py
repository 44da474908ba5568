"""Procedural textures, pixel by pixel against Cycles in the same Blender."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import exr
from support.blender_host import needs_bpy

pytestmark = needs_bpy

#: Largest difference; jumps of a texture may fall on the other side of a pixel by rounding.
AGREEMENT = 1e-3
MOST_JUMPS = 0.01


def cells_agree() -> bool:
    """Return whether this Blender has our random numbers for Voronoi: 5.0 brought them."""
    return int(importlib.metadata.version("bpy").split(".")[0]) >= 5


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with the squares of both engines."""
    folder = tmp_path_factory.mktemp("textures")
    script = Path(__file__).with_name("textures.py")
    for engine in ("TYNDALL", "CYCLES"):
        command = [sys.executable, str(script), engine, str(folder)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0, done.stdout[-1500:] + done.stderr[-1500:]
        assert "is not supported" not in done.stdout
        says_so = "has other random numbers before Blender 5.0" in done.stdout
        assert says_so == (engine == "TYNDALL" and not cells_agree())
    return folder


def test_every_pixel_agrees(pictures: Path) -> None:
    names = sorted(path.stem.removeprefix("CYCLES-") for path in pictures.glob("CYCLES-*.exr"))
    assert len(names) > 40
    wrong = {}
    for name in names:
        ours, theirs = (exr.read_rgb(pictures / f"{engine}-{name}.exr") for engine in ("TYNDALL", "CYCLES"))
        assert name == "FLOOR" or np.ptp(theirs) > 0 or "1D" in name
        # Only Cycles has light that is negative.
        differs = np.abs(ours - np.maximum(theirs, 0.0)).max(axis=-1) > AGREEMENT
        if differs.mean() > MOST_JUMPS and (cells_agree() or not name.startswith("voronoi")):
            wrong[name] = float(differs.mean())
    assert not wrong

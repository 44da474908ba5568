"""Many frames in one process: memory does not grow, and each frame is the one that is rendered alone."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path
from statistics import median

import numpy as np
import pytest
import tyndall
from pxr import Gf, Sdf, UsdGeom
from robustness.test_parts import assert_same_layers
from support.cli import command
from support.cli import tyndall as run_tyndall
from support.stages import StageBuilder

N_FILES = 3
SETTINGS = ("--spp", "2", "--max-bounces", "2", "--threads", "1")


def smoke_and_waves(folder: Path, n_frames: int) -> Path:
    """Return a stage where everything varies: camera, lamp, points of a mesh, and the file of a grid."""
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 6), (0, 0, 0))
    grey = stage.lambert(0.5)
    path = stage.volume("", stage.medium(2.0, 0.8, field="density"))
    light = stage.sphere_light((0, 2, 1), 0.2, 30)
    axis = np.linspace(-2, 2, 60)
    flat = np.stack(np.meshgrid(axis, [-1.0], axis, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = [(i, i + 1, i + 61, i + 60) for row in range(59) for i in range(60 * row, 60 * row + 59)]
    mesh = stage.mesh(flat, [4] * len(corners), [i for face in corners for i in face], grey)
    files = [folder / f"smoke.{i}.vdb" for i in range(N_FILES)]
    for i, file in enumerate(files):
        density = np.zeros((64, 64, 64), np.float32)
        density[8 * i : 8 * i + 40, 10:50, 10:50] = 1.0
        tyndall.write_vdb(str(file), "density", density, 1 / 32, (-1.0, -1.0, -1.0))
    prims = stage.stage
    camera = UsdGeom.Xformable(prims.GetPrimAtPath("/World/Camera")).GetOrderedXformOps()[0]
    place = camera.Get()
    for frame in range(1, n_frames + 1):
        prims.GetPrimAtPath(f"{path}/density").GetAttribute("filePath").Set(
            Sdf.AssetPath(str(files[frame % N_FILES])), frame
        )
        wave = flat + np.stack([0 * flat[:, 0], 0.1 * np.sin(flat[:, 0] + 0.1 * frame), 0 * flat[:, 0]], 1)
        prims.GetPrimAtPath(mesh).GetAttribute("points").Set([Gf.Vec3f(*map(float, p)) for p in wave], frame)
        UsdGeom.Xformable(prims.GetPrimAtPath(light)).GetOrderedXformOps()[0].Set(
            Gf.Vec3d(0.01 * frame, 2, 1), frame
        )
        camera.Set(place * Gf.Matrix4d(1).SetTranslate(Gf.Vec3d(0.005 * frame, 0, 0)), frame)
    return stage.save(folder / "stage.usda")


def test_frames_of_one_process_are_those_rendered_alone(tmp_path: Path) -> None:
    stage = smoke_and_waves(tmp_path, 5)
    assert run_tyndall("render", stage, "-o", tmp_path / "all.#.exr", "-f", "1:5", *SETTINGS).code == 0
    for frame in (2, 4, 5):
        alone = tmp_path / f"alone.{frame}.exr"
        assert run_tyndall("render", stage, "-o", alone, "-f", frame, *SETTINGS).code == 0
        assert_same_layers(alone, tmp_path / f"all.{frame}.exr")


def resident_megabytes(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return 0.0


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_memory_does_not_grow_over_200_frames(tmp_path: Path) -> None:
    stage = smoke_and_waves(tmp_path, 200)
    cache = ("--cache", tmp_path / "shot.tyc", "--guiding", "on", "--distance-sampling", "odds")
    arguments = ("render", stage, "-o", tmp_path / "image.####.exr", "-f", "1:200", *SETTINGS, *cache)
    found: dict[int, float] = {}
    with subprocess.Popen([command(), *map(str, arguments)], stderr=subprocess.DEVNULL) as process:
        while process.poll() is None:
            n_done = len(list(tmp_path.glob("image.*.exr")))
            try:
                found[n_done] = max(found.get(n_done, 0.0), resident_megabytes(process.pid))
            except FileNotFoundError:
                break
            time.sleep(0.02)
    assert process.returncode == 0
    early = median(value for done, value in found.items() if 30 <= done < 70)
    late = median(value for done, value in found.items() if 160 <= done < 200)
    # A leak of one grid or mesh a frame would be over 100 MB; the list of a cache's frames grows by bytes.
    assert late < early + 8.0, f"{early:.1f} MB at first and {late:.1f} MB in the end"

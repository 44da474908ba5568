"""Stress cases without a file of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from pxr import Gf, UsdGeom
from support import exr
from support.cli import tyndall
from support.oracles import judge
from support.render import Shot
from support.render import tyndall as core
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path


def render(
    stage: StageBuilder, folder: Path, *arguments: str | int, timeout: float = 20
) -> tuple[np.ndarray, str]:
    """Render through the command; return the colour and everything that was said."""
    path = stage.save(folder / "stage.usda")
    image = folder / "image.exr"
    options = ("--spp", 16, "--max-bounces", 64, "--filter", "box", "--progress", "none")
    run = tyndall("render", path, "-o", image, *options, *arguments, timeout=timeout)
    assert run.code == 0, run.text
    rgb = exr.read_rgb(image)
    assert np.isfinite(rgb).all()
    assert (rgb >= 0).all()
    return rgb, run.err


def furnace(width: int = 16, height: int = 12) -> StageBuilder:
    stage = StageBuilder(width, height)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=40)
    stage.dome(1.0)
    return stage


def test_empty_scene_is_black_with_a_message(tmp_path: Path) -> None:
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0))
    rgb, said = render(stage, tmp_path)
    assert rgb.max() == 0
    assert said.strip()


def test_zero_scale_is_skipped_with_a_message(tmp_path: Path) -> None:
    stage = furnace()
    path = stage.sphere((0, 0, 0), 1.0, stage.lambert(0.5))
    UsdGeom.Xformable(stage.stage.GetPrimAtPath(path)).AddScaleOp().Set(Gf.Vec3f(0, 0, 0))
    rgb, said = render(stage, tmp_path)
    assert rgb == pytest.approx(np.ones_like(rgb))
    assert path in said


def test_mirrored_scale_keeps_boundaries_and_normals(tmp_path: Path) -> None:
    stage = furnace()
    ball = stage.sphere((0, 0, 0), 0.8, stage.medium(3.0, 1.0, 0.5))
    wall = stage.quad((-2, -2, -3), (4, 0, 0), (0, 4, 0), stage.lambert(1.0))
    for path in (ball, wall):
        UsdGeom.Xformable(stage.stage.GetPrimAtPath(path)).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))
    judge(Shot(stage, tmp_path).seeds(8, spp=128, max_bounces=4096), 1.0)


@pytest.mark.parametrize("size", [(1, 1), (4096, 1)], ids=["one_texel", "one_row"])
def test_dome_image_with_bad_texels(tmp_path: Path, size: tuple[int, int]) -> None:
    sky = np.ones((size[1], size[0], 3), np.float32)
    sky[0, 0] = (np.nan, np.inf, -1.0)
    exr.write_rgb(tmp_path / "sky.exr", sky)
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=90)
    stage.sphere((0, 0, 0), 1.0, stage.lambert(0.5))
    stage.dome(1.0, texture=tmp_path / "sky.exr")
    _, said = render(stage, tmp_path)
    assert "sky.exr" in said


def test_a_hundred_thousand_lights(tmp_path: Path) -> None:
    """Small downward squares over a card: in time, and with the energy of the sum."""
    count, height, side, radiance, half = 100_000, 5.0, 1e-3, 2e4, 10.0
    stage = StageBuilder()
    stage.camera((0.5, 1.0, 0.8), (0, 0, 0), vfov=0.02)
    stage.quad((-0.1, 0, 0.1), (0.2, 0, 0), (0, 0, -0.2), stage.lambert(1.0))
    places = np.random.default_rng(3).uniform(-half, half, (count, 2))
    lights = {
        f"/Lights/l{i}": core.prims.Light(
            kind="rect",
            params={"width": side, "height": side},
            world_from_light=facing_down(x, height, z),
            intensity=radiance,
        )
        for i, (x, z) in enumerate(places)
    }
    shot = Shot(stage, tmp_path, extra=lights)
    squared = (places**2).sum(axis=1) + height**2
    irradiance = (radiance * side**2 * height**2 / squared**2).sum()
    judge(shot.seeds(8, spp=16, max_bounces=1), irradiance / np.pi, relative_error=0.03)


def facing_down(x: float, y: float, z: float) -> np.ndarray:
    """Return the placement of a light at a point, its -z turned to -y."""
    return np.array([[1, 0, 0, x], [0, 0, 1, y], [0, -1, 0, z], [0, 0, 0, 1]], float)


def test_many_samples_of_one_value(tmp_path: Path) -> None:
    """A million samples of 1 in a pixel are 1 within 1e-5: sums are compensated or wider than float."""
    stage = StageBuilder(1, 1)
    stage.camera((0, 0, 4), (0, 0, 0))
    stage.dome(1.0)
    rgb, _ = render(stage, tmp_path, "--spp", 1_000_000)
    assert rgb == pytest.approx(np.ones_like(rgb), rel=1e-5)


def test_rotated_sheared_grid_equals_its_furnace(tmp_path: Path) -> None:
    """A grid under rotation, shear and uneven scale loses nothing."""
    values = np.zeros((8, 8, 8), np.float32)
    values[1:-1, 1:-1, 1:-1] = 1.0
    core.write_vdb(str(tmp_path / "block.vdb"), "density", values, 0.2, (-0.7, -0.7, -0.7))
    stage = furnace()
    path = stage.volume(tmp_path / "block.vdb", stage.medium(6.0, 1.0, 0.3, field="density"))
    shear = Gf.Matrix4d(1.2, 0.3, 0, 0, -0.4, 0.8, 0.5, 0, 0, -0.2, 1.5, 0, 0.1, 0, 0, 1)
    UsdGeom.Xformable(stage.stage.GetPrimAtPath(path)).AddTransformOp().Set(shear)
    judge(Shot(stage, tmp_path).seeds(8, spp=128, max_bounces=4096), 1.0)


def test_a_sheared_grid_lets_through_what_its_shape_says(tmp_path: Path) -> None:
    """Absorption through a constant block: exp(-sigma * depth), the depth being what the shear makes."""
    values = np.ones((16, 16, 16), np.float32)
    core.write_vdb(str(tmp_path / "block.vdb"), "density", values, 0.1, (-0.75, -0.75, -0.75))
    # Rows are images of the axes: z is stretched to 1.5 and leans, x and y keep the block in view.
    matrix = Gf.Matrix4d(1, 0, 0, 0, 0.2, 1, 0, 0, 0.3, -0.1, 1.5, 0, 0, 0, 0, 1)
    stage = StageBuilder()
    stage.camera((0, 0, 5), (0, 0, 0), vfov=0.02)
    path = stage.volume(tmp_path / "block.vdb", stage.medium(0.7, 0.0, field="density"))
    UsdGeom.Xformable(stage.stage.GetPrimAtPath(path)).AddTransformOp().Set(matrix)
    stage.dome(1.0)
    # Along a view ray the index coordinate k runs over its whole length within i, j of constant value, with
    # linear ramps of half a voxel's worth outside: 15 intervals of full density and two ramps whose integral
    # is one.
    depth = 16 * 0.1 * 1.5
    judge(Shot(stage, tmp_path).seeds(8, spp=4096, max_bounces=0), np.exp(-0.7 * depth))

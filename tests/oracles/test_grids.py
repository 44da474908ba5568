"""Grids that are not densities: level sets, which stand for their inside, and colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.fields import fields, own_medium
from support.oracles import judge
from support.render import Shot, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

VOXEL = 0.04
RADIUS = 0.8
HALF = 24  # voxels


def positions(voxel: float = VOXEL, half: int = HALF) -> npt.NDArray[np.float64]:
    """Return the voxel centres of a cube about the origin."""
    axis = (np.arange(2 * half) - half + 0.5) * voxel
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


ORIGIN = ((-HALF + 0.5) * VOXEL,) * 3


def ball(folder: Path) -> Path:
    """Write the signed distances of a sphere 40 voxels in radius, cut to three voxels on both sides."""
    voxel, half = 0.02, 48
    distance = np.linalg.norm(positions(voxel, half), axis=-1) - RADIUS
    values = np.clip(distance, -3 * voxel, 3 * voxel).astype(np.float32)
    path = folder / "ball.vdb"
    origin = ((-half + 0.5) * voxel,) * 3
    tyndall.write_vdb(str(path), "density", values, voxel, origin, level_set=True, background=3 * voxel)
    return path


def colors(folder: Path, values: npt.NDArray[np.float64]) -> Path:
    path = folder / "Cd.vdb"
    tyndall.write_vdb(str(path), "Cd", np.ascontiguousarray(values, np.float32), VOXEL, ORIGIN)
    return path


def density(folder: Path) -> Path:
    """Write a cube of density 1 that ends well within the grid of colours."""
    inside = (np.abs(positions()) < 0.6).all(axis=-1)
    path = folder / "density.vdb"
    tyndall.write_vdb(str(path), "density", inside.astype(np.float32), VOXEL, ORIGIN)
    return path


def under_the_sky() -> StageBuilder:
    stage = StageBuilder(24, 24)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=28)
    stage.dome(1.0)
    return stage


def difference(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return by how many standard errors two sets of renders differ in the mean of each channel."""
    means = [images.mean(axis=(1, 2)) for images in (a, b)]
    error = np.sqrt(sum(m.var(axis=0, ddof=1) / len(m) for m in means))
    assert (error < 0.003 * means[0].mean(axis=0)).all(), "not sharp enough to judge"
    return np.asarray((means[0].mean(axis=0) - means[1].mean(axis=0)) / error)


def test_a_level_set_is_the_medium_inside_it(tmp_path: Path) -> None:
    """Smooth over one voxel: less than 0.05 % darker than the sphere itself at this depth and size."""
    looks = {"albedo": (0.3, 0.6, 0.9), "anisotropy": 0.3}
    stage = under_the_sky()
    fields(stage, own_medium(stage, density=(1.5, "density"), **looks), density=ball(tmp_path))
    grid = Shot(stage, tmp_path)
    assert not grid.session(spp=1, max_bounces=1).diagnostics
    stage = under_the_sky()
    stage.sphere((0, 0, 0), RADIUS, own_medium(stage, density=1.5, **looks))
    analytic = Shot(stage, tmp_path)
    z = difference(*(shot.seeds(8, spp=64, max_bounces=64) for shot in (grid, analytic)))
    assert (np.abs(z) < 4).all(), z


def test_a_color_grid_is_the_albedo_of_a_density_grid(tmp_path: Path) -> None:
    """Where the colour is the same everywhere it is that of a constant."""
    albedo = (0.2, 0.5, 0.9)
    shots = []
    for value in ((1.0, "Cd"), albedo):
        stage = under_the_sky()
        medium = own_medium(stage, density=(3.0, "density"), albedo=value)
        uniform = np.broadcast_to(albedo, (2 * HALF,) * 3 + (3,))
        fields(stage, medium, density=density(tmp_path), Cd=colors(tmp_path, uniform))
        shots.append(Shot(stage, tmp_path))
    z = difference(*(shot.seeds(8, spp=256, max_bounces=64) for shot in shots))
    assert (np.abs(z) < 4).all(), z


def halves() -> npt.NDArray[np.float64]:
    """Red on the left, blue on the right."""
    left = positions()[..., :1] < 0
    return np.where(left, (0.9, 0.2, 0.1), (0.1, 0.2, 0.9))


@pytest.mark.parametrize("role", ["albedo", "density"])
def test_red_and_blue_halves_mirror_each_other(tmp_path: Path, role: str) -> None:
    """The colours as an albedo, or times the density as a coloured extinction."""
    stage = under_the_sky()
    inputs = {"albedo": (1.0, "Cd"), "density": (3.0, "density")}
    if role == "density":
        inputs = {"albedo": (0.9, 0.9, 0.9), "density": (3.0, "Cd", "density")}
    fields(stage, own_medium(stage, **inputs), density=density(tmp_path), Cd=colors(tmp_path, halves()))
    images = Shot(stage, tmp_path).seeds(8, spp=256, max_bounces=64)
    left, right = images[:, :, 6:12], images[:, :, 12:18]
    assert left[..., 0].mean() > 1.1 * left[..., 2].mean() or role == "density"
    z = difference(left, right[..., ::-1])
    assert (np.abs(z) < 4).all(), z


def test_colors_shine_alone_and_times_a_field(tmp_path: Path) -> None:
    """Without extinction the radiance is the integral of the colour, here through the left half."""
    stage = StageBuilder(4, 4)
    stage.camera((-0.3, 0, 6), (-0.3, 0, 0), orthographic_height=0.3)
    medium = own_medium(stage, density=0.0, emission=(2.0, "Cd"))
    fields(stage, medium, Cd=colors(tmp_path, halves()))
    images = Shot(stage, tmp_path).seeds(8, spp=64, max_bounces=0)
    judge(images, 2 * np.array([0.9, 0.2, 0.1]) * 2 * HALF * VOXEL)
    stage = StageBuilder(4, 4)
    stage.camera((-0.3, 0, 6), (-0.3, 0, 0), orthographic_height=0.3)
    medium = own_medium(stage, density=0.0, emission=(2.0, "density", "Cd"))
    fields(stage, medium, density=density(tmp_path), Cd=colors(tmp_path, halves()))
    images = Shot(stage, tmp_path).seeds(8, spp=64, max_bounces=0)
    judge(images, 2 * np.array([0.9, 0.2, 0.1]) * 30 * VOXEL)


def test_colors_too_bright_for_an_albedo_are_cut_with_a_message(tmp_path: Path) -> None:
    """Light under a white sky would grow without bound; at an albedo of 1 it stays what it is."""
    stage = under_the_sky()
    medium = own_medium(stage, density=(3.0, "density"), albedo=(1.0, "Cd"))
    bright = np.full((*(2 * HALF,) * 3, 3), 1.5)
    fields(stage, medium, density=density(tmp_path), Cd=colors(tmp_path, bright))
    shot = Shot(stage, tmp_path)
    assert any("albedo" in d.what for d in shot.session(spp=1, max_bounces=1).diagnostics)
    judge(shot.seeds(8, spp=64, max_bounces=4096), 1.0)

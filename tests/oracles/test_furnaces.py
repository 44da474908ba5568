"""Set-ups whose answer is one number everywhere: what is lost or gained on the way shows at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.oracles import judge, table
from support.render import Shot, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

BOXES = table()["furnaces"]
MANY = 4096  # bounces; what is lost beyond is far below the noise


def furnace(medium: dict[str, Any], radiance: Any, folder: Path) -> Shot:
    """A unit ball of medium under a constant sky; a third of the picture is beside it."""
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=32)
    stage.sphere((0, 0, 0), 1.0, stage.medium(**medium))
    stage.dome(radiance)
    return Shot(stage, folder)


WHITE = {
    "thin": {"sigma_t": 0.1, "albedo": 1.0},
    "mean_free_path": {"sigma_t": 1.0, "albedo": 1.0},
    "dense": {"sigma_t": 20.0, "albedo": 1.0},
    "forward": {"sigma_t": 5.0, "albedo": 1.0, "g": 0.9},
    "backward": {"sigma_t": 5.0, "albedo": 1.0, "g": -0.7},
    "coloured": {"sigma_t": (0.5, 2.0, 8.0), "albedo": 1.0, "g": 0.3},
    "one_channel": {"sigma_t": (0.0, 0.0, 3.0), "albedo": 1.0},
}


@pytest.mark.parametrize("medium", WHITE.values(), ids=WHITE)
def test_white_furnace(tmp_path: Path, medium: dict[str, Any]) -> None:
    judge(furnace(medium, 1.0, tmp_path).seeds(8, spp=128, max_bounces=MANY), 1.0)


KIRCHHOFF = {
    "absorbing": {"sigma_t": 1.0, "albedo": 0.0},
    "half": {"sigma_t": 2.0, "albedo": 0.5},
    "forward": {"sigma_t": 4.0, "albedo": 0.8, "g": 0.8},
    "coloured": {"sigma_t": (0.3, 1.0, 3.0), "albedo": (0.9, 0.5, 0.1)},
}


@pytest.mark.parametrize("medium", KIRCHHOFF.values(), ids=KIRCHHOFF)
def test_kirchhoff_furnace(tmp_path: Path, medium: dict[str, Any]) -> None:
    """A body as hot as its surroundings cannot be seen."""
    radiance = np.array([2.0, 1.0, 0.5])
    absorption = np.multiply(medium["sigma_t"], 1 - np.asarray(medium["albedo"]))
    shot = furnace({**medium, "emission": absorption * radiance}, radiance, tmp_path)
    judge(shot.seeds(8, spp=256, max_bounces=MANY), radiance)


@pytest.mark.parametrize(("albedo", "emissive"), [(1.0, False), (0.7, True)], ids=["white", "kirchhoff"])
def test_grid_furnace(tmp_path: Path, albedo: float, emissive: bool) -> None:
    """The same for a grid of uneven density: local majorants, interpolation and null collisions are in it."""
    density = np.random.default_rng(7).random((12, 10, 8), np.float32) ** 4
    density[0], density[-1] = 0, 0
    density[:, 0], density[:, -1] = 0, 0
    density[:, :, 0], density[:, :, -1] = 0, 0
    tyndall.write_vdb(str(tmp_path / "uneven.vdb"), "density", density, 0.2, (-1.1, -0.9, -0.7))
    stage = StageBuilder(16, 12)
    stage.camera((0.7, 0.5, 4), (0, 0, 0), vfov=32)
    emission = 12.0 * (1 - albedo) if emissive else None
    stage.volume(tmp_path / "uneven.vdb", stage.medium(12.0, albedo, 0.4, emission=emission, field="density"))
    stage.dome(1.0)
    judge(Shot(stage, tmp_path).seeds(8, spp=128, max_bounces=MANY), 1.0)


def test_overlapping_media_are_a_furnace(tmp_path: Path) -> None:
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=32)
    stage.sphere((-0.3, 0, 0), 0.8, stage.medium(2.0, 1.0, 0.5))
    stage.sphere((0.3, 0, 0), 0.8, stage.medium((1.0, 3.0, 0.2), 1.0, -0.3))
    stage.box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), stage.medium(5.0, 1.0))
    stage.dome(1.0)
    judge(Shot(stage, tmp_path).seeds(8, spp=128, max_bounces=MANY), 1.0)


def test_white_lambert_and_glass_are_invisible(tmp_path: Path) -> None:
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=40)
    stage.sphere((-0.6, 0, 0), 0.6, stage.lambert(1.0))
    stage.sphere((0.7, 0, 0), 0.6, stage.glass(1.5))
    stage.dome(1.0)
    judge(Shot(stage, tmp_path).seeds(8, spp=128, max_bounces=MANY), 1.0)


def room(wall_albedo: float, folder: Path, medium: dict[str, Any] | None = None) -> Shot:
    """Six walls of this albedo that emit 1, the camera inside."""
    stage = StageBuilder(16, 12)
    stage.camera((0.3, 0.2, 0.8), (-0.2, 0, -1), vfov=60)
    stage.box((-1, -1, -1), (1, 1, 1), stage.lambert(wall_albedo, 1.0))
    if medium is not None:
        stage.box((-0.9, -0.9, -0.9), (0.9, 0.9, 0.9), stage.medium(**medium))
    return Shot(stage, folder)


@pytest.mark.parametrize("fog", [None, {"sigma_t": 0.7, "albedo": 1.0, "g": 0.5}], ids=["empty", "fog"])
@pytest.mark.parametrize("row", BOXES["closed_box"], ids=lambda row: f"albedo{row['wall_albedo']:g}")
def test_closed_box(tmp_path: Path, row: dict[str, Any], fog: dict[str, Any] | None) -> None:
    shot = room(row["wall_albedo"], tmp_path, fog)
    judge(shot.seeds(8, spp=64, max_bounces=MANY), row["radiance_everywhere"])


@pytest.mark.parametrize(
    "row", BOXES["closed_box_truncated_after_n_bounces_no_medium"], ids=lambda row: f"bounces{row['bounces']}"
)
def test_closed_box_counts_bounces(tmp_path: Path, row: dict[str, Any]) -> None:
    shot = room(row["wall_albedo"], tmp_path)
    judge(shot.seeds(8, spp=128, max_bounces=row["bounces"]), row["radiance"])


def test_index_matched_boundaries_count_no_bounce(tmp_path: Path) -> None:
    """Twenty invisible shells before the wall do not eat a path that may bounce once."""
    stage = StageBuilder()
    stage.camera((0, 0, 0), (0, 0, -1), vfov=10)
    for i in range(20):
        stage.sphere((0, 0, 0), 0.5 + 0.02 * i, stage.medium(1e-9, 0.0))
    stage.box((-2, -2, -2), (2, 2, 2), stage.lambert(0.8, 1.0))
    judge(Shot(stage, tmp_path).seeds(8, spp=64, max_bounces=1), 1.8)

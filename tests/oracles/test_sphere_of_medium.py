"""A unit ball of medium in parallel light."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.exr import write_rgb
from support.oracles import judge, table
from support.render import Shot
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

SPHERE = table()["sphere_of_medium"]
MANY = 4096
# An orthographic picture of the square around the ball: the ball's disk covers this share.
DISK = math.pi / 4
LIGHT = {"light_from_side": (0, -1, 0), "light_from_camera": (0, 0, -1), "light_from_behind": (0, 0, 1)}


@pytest.mark.parametrize("row", SPHERE["unit_sphere_unscattered"], ids=lambda row: f"sigma{row['sigma_t']:g}")
def test_unscattered_share(tmp_path: Path, row: dict[str, Any]) -> None:
    stage = StageBuilder(16, 16)
    stage.camera((0, 0, 3), (0, 0, 0), orthographic_height=2.0)
    stage.sphere((0, 0, 0), 1.0, stage.medium(row["sigma_t"], 0.0))
    stage.dome(1.0)
    expected = DISK * row["unscattered_fraction"] + (1 - DISK)
    judge(Shot(stage, tmp_path).seeds(8, spp=1024, max_bounces=0), expected, relative_error=0.005)


@pytest.mark.parametrize(
    "row",
    SPHERE["centre_ray_single_scattering"],
    ids=lambda row: f"sigma{row['sigma_t']:g}-{row['geometry']}",
)
def test_single_scattering_on_the_centre_ray(tmp_path: Path, row: dict[str, Any]) -> None:
    stage = StageBuilder()
    stage.camera((0, 0, 3), (0, 0, 0), vfov=0.02)
    stage.sphere((0, 0, 0), 1.0, stage.medium(row["sigma_t"], 1.0))
    stage.distant(LIGHT[row["geometry"]], 1.0)
    judge(Shot(stage, tmp_path).seeds(8, spp=8192, max_bounces=1), row["centre_radiance_albedo1_g0"])


@pytest.mark.parametrize("half", ["back", "forward", "both"])
@pytest.mark.parametrize(
    "row",
    SPHERE["power_balance_monte_carlo"],
    ids=lambda row: f"sigma{row['sigma_t']:g}-albedo{row['albedo']:g}-g{row['g']:g}",
)
def test_power_balance(tmp_path: Path, row: dict[str, Any], half: str) -> None:
    """The share of a beam's power that leaves into a hemisphere.

    By reciprocity it is the mean radiance over the ball's disk, seen along the beam, under a sky that is 1 in
    that hemisphere and 0 elsewhere. The camera looks down, so that the sky's halves are the halves of a
    lat-long image.
    """
    height = 512
    sky = np.zeros((height, 8, 3), np.float32)
    upper, lower = slice(0, height // 2), slice(height // 2, height)
    for rows in {"back": [upper], "forward": [lower], "both": [upper, lower]}[half]:
        sky[rows] = 1.0
    write_rgb(tmp_path / "sky.exr", sky)

    stage = StageBuilder(16, 16)
    stage.camera((0, 3, 0), (0, 0, 0), orthographic_height=2.0)
    stage.sphere((0, 0, 0), 1.0, stage.medium(row["sigma_t"], row["albedo"], row["g"]))
    stage.dome(1.0, texture=tmp_path / "sky.exr")

    through = row["unscattered"] * DISK
    expected = {
        "back": row["scattered_back_hemisphere"] * DISK,
        "forward": row["scattered_forward_hemisphere"] * DISK + through + (1 - DISK),
        "both": (1 - row["absorbed"]) * DISK + (1 - DISK),
    }[half]
    images = Shot(stage, tmp_path).seeds(8, spp=128, max_bounces=MANY)
    judge(images, expected, oracle_error=row["standard_error_below"] * DISK)

"""How much light a medium lets through."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from support.oracles import judge, table
from support.render import Shot, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

ROWS = table()["transmittance"]
EMISSION_ROWS = table()["emission_absorption_slab"]


def row_id(row: dict[str, Any]) -> str:
    return "-".join(f"{value:g}" for key, value in row.items() if key not in ("T", "one_minus_T", "radiance"))


def seen_through_box(folder: Path, medium: dict[str, Any], depth: float, background: float) -> Shot:
    """Look square through a box `depth` deep at an environment of radiance `background`."""
    stage = StageBuilder()
    stage.camera((0, 0, 2 * depth), (0, 0, 0), vfov=0.02)
    stage.box((-depth, -depth, 0), (depth, depth, depth), stage.medium(**medium))
    stage.dome(background)
    return Shot(stage, folder)


@pytest.mark.parametrize("row", ROWS["homogeneous"], ids=row_id)
def test_homogeneous(tmp_path: Path, row: dict[str, Any]) -> None:
    shot = seen_through_box(tmp_path, {"sigma_t": row["sigma_t"], "albedo": 0.0}, row["distance"], 1.0)
    rendered = shot.seeds(4, spp=4096, max_bounces=0)
    if row["T"] > 1e-5:
        judge(rendered, row["T"], relative_error=0.01 if row["T"] > 0.01 else 0.3)
    else:
        assert rendered.mean() < 1e-9, "not one path in 1e9 gets through"


def test_transmittance_aov(tmp_path: Path) -> None:
    shot = seen_through_box(tmp_path, {"sigma_t": (0.5, 1.0, 2.0), "albedo": 0.5}, 1.0, 1.0)
    images = [
        shot.render(spp=1024, seed=seed, max_bounces=4, aovs=["rgba", "transmittance"])["transmittance"]
        for seed in range(1, 5)
    ]
    judge(np.stack(images)[..., :3], np.exp([-0.5, -1.0, -2.0]))


def profile_stage(folder: Path, sigmas: np.ndarray, step: float) -> Shot:
    """Look along the profile `sigmas` (samples `step` apart, linear in between) at a wall of radiance 1.

    The profile is held constant beyond its ends, and camera and wall stand exactly at its first and last
    sample, so that the interpolated density between them is the piecewise linear function through the
    samples.
    """
    margin = 4
    padded = np.pad(sigmas, margin, mode="edge").astype(np.float32)
    side = 9
    values = np.broadcast_to(padded, (side, side, len(padded))).copy()
    half = (side - 1) / 2 * step
    vdb = folder / "profile.vdb"
    tyndall.write_vdb(str(vdb), "density", values, step, (-half, -half, -margin * step))
    length = (len(sigmas) - 1) * step
    stage = StageBuilder()
    stage.camera((0, 0, 0), (0, 0, length), vfov=0.02)
    stage.volume(vdb, stage.medium(1.0, 0.0, field="density"))
    wide = 2 * half
    stage.quad((-wide, -wide, length), (0, 2 * wide, 0), (2 * wide, 0, 0), stage.lambert(0.0, 1.0))
    return Shot(stage, folder)


@pytest.mark.parametrize("row", ROWS["linear_ramp_sigma0_to_sigma1"], ids=row_id)
def test_linear_ramp(tmp_path: Path, row: dict[str, Any]) -> None:
    step = row["length"] / 32
    sigmas = np.linspace(row["sigma0"], row["sigma1"], 33)
    judge(profile_stage(tmp_path, sigmas, step).seeds(8, spp=4096, max_bounces=1), row["T"])


@pytest.mark.parametrize("row", ROWS["exponential_decay"], ids=row_id)
def test_exponential_atmosphere(tmp_path: Path, row: dict[str, Any]) -> None:
    step = row["length"] / 1024
    sigmas = row["sigma0"] * np.exp(-np.arange(1025) * step / row["scale_height"])
    sampled = math.exp(-trapezoid(sigmas, dx=step))
    assert sampled == pytest.approx(row["T"], rel=1e-5), "the profile is sampled finely enough"
    judge(profile_stage(tmp_path, sigmas, step).seeds(8, spp=2048, max_bounces=1), row["T"])


@pytest.mark.parametrize("row", EMISSION_ROWS, ids=row_id)
def test_emission_and_absorption(tmp_path: Path, row: dict[str, Any]) -> None:
    medium = {"sigma_t": row["sigma_a"], "albedo": 0.0, "emission": row["emission_coefficient"]}
    shot = seen_through_box(tmp_path, medium, row["length"], row["background"])
    judge(shot.seeds(8, spp=4096, max_bounces=0), row["radiance"])

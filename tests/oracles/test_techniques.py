"""Light sampling, directional sampling and both combined agree through a slab of optical depth 2."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.render import Shot, tyndall
from support.stages import StageBuilder
from support.statistics import Estimate, estimate

if TYPE_CHECKING:
    from pathlib import Path

LAMP = (1.8, 0.0, -2.0)
RADIANCE = 5.0
BOUNCES = 8


def thickening_slab(stage: StageBuilder, folder: Path) -> None:
    """Add a slab of thickness 1 whose extinction grows from 0 to 4 along the way: 2 in all."""
    voxel, n = 0.125, (32, 32, 12)
    z = (np.arange(n[2]) - 1.5) * voxel
    values = np.broadcast_to(np.where((z >= 0) & (z <= 1), z, 0.0), n).astype(np.float32)
    path = folder / "slab.vdb"
    tyndall.write_vdb(str(path), "density", np.ascontiguousarray(values), voxel, (-1.94, -1.94, -0.7))
    stage.volume(path, stage.medium(4.0, 0.95, 0.3, field="density"))


def layered_slab(stage: StageBuilder, folder: Path) -> None:  # noqa: ARG001
    """Add two layers of homogeneous media that overlap by half."""
    stage.box((-2, -2, -0.5), (2, 2, 0.5), stage.medium((1.0, 0.8, 1.2), 0.95, 0.3))
    stage.box((-2, -2, -0.5), (2, 2, 0.0), stage.medium(2.0, 0.95, -0.2))


def picture(folder: Path, name: str, slab: Any, lamp: Any, *, spp: int, **settings: Any) -> Estimate:
    """Render the slab with a lamp behind it, out of the camera's sight."""
    own = folder / name
    own.mkdir()
    stage = StageBuilder(8, 8)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=12)
    slab(stage, own)
    lamp(stage)
    return estimate(Shot(stage, own).seeds(8, spp=spp, max_bounces=BOUNCES, **settings))


def assert_agree(one: Estimate, other: Estimate, *, within: float) -> None:
    error = np.hypot(one.error, other.error)
    assert (error < within * other.mean).all(), f"not sharp enough: {error / other.mean}"
    z = (one.mean - other.mean) / error
    assert (np.abs(z) < 4).all(), f"{one.mean} against {other.mean}: z {z}"


@pytest.mark.parametrize("slab", [thickening_slab, layered_slab])
@pytest.mark.parametrize("guiding", ["off", "on"])
def test_directions_alone_find_what_both_find(tmp_path: Path, slab: Any, guiding: str) -> None:
    """A ball that glows cannot be sampled as a light: paths must meet it. A light is found both ways."""
    radius = 0.8

    def glowing(stage: StageBuilder) -> None:
        stage.sphere(LAMP, radius, stage.lambert(0.0, emission=RADIANCE))

    def light(stage: StageBuilder) -> None:
        stage.sphere_light(LAMP, radius, RADIANCE)

    met = picture(tmp_path, "met", slab, glowing, spp=2048, guiding=guiding)
    both = picture(tmp_path, "both", slab, light, spp=512, guiding=guiding)
    assert_agree(met, both, within=0.015)


@pytest.mark.parametrize("slab", [thickening_slab, layered_slab])
def test_light_sampling_alone_finds_what_both_find(tmp_path: Path, slab: Any) -> None:
    """No path meets a point; a ball of the same power differs by a quarter of its angular radius squared."""
    radius = 0.05

    def point(stage: StageBuilder) -> None:
        stage.point(LAMP, RADIANCE * math.pi * radius**2)

    def light(stage: StageBuilder) -> None:
        stage.sphere_light(LAMP, radius, RADIANCE)

    sampled = picture(tmp_path, "sampled", slab, point, spp=256)
    both = picture(tmp_path, "both", slab, light, spp=256)
    assert_agree(sampled, both, within=0.01)

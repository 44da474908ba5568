"""Light by how often it scattered, and where it scattered first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from robustness.test_runs import foggy_room
from support.render import Shot
from support.stages import StageBuilder
from support.statistics import estimate

if TYPE_CHECKING:
    from pathlib import Path

AOVS = ("rgba", "emission", "direct", "indirect")


@pytest.mark.parametrize("sampling", ["delta", "odds"])
def test_orders_add_up_and_are_those_of_shorter_paths(tmp_path: Path, sampling: str) -> None:
    """A render in which light scatters at most n times has all orders up to n and no other."""
    shot = Shot(foggy_room(24, 18), tmp_path)

    def mean(part: str, max_bounces: int) -> np.ndarray:
        settings = {"spp": 64, "max_bounces": max_bounces, "distanceSampling": sampling, "aovs": AOVS}
        images = [shot.render(seed=seed, **settings) for seed in range(6)]
        for image in images:
            total = sum(image[name][..., :3] for name in AOVS[1:])
            np.testing.assert_allclose(total, image["rgba"][..., :3], rtol=1e-4, atol=1e-5)
        return estimate(np.stack([image[part][..., :3] for image in images]))

    for max_bounces, parts in ((0, ["emission"]), (1, ["emission", "direct"])):
        short = mean("rgba", max_bounces)
        found = [mean(part, 8) for part in parts]
        total = sum(part.mean for part in found)
        error = np.sqrt(short.error**2 + sum(part.error**2 for part in found))
        assert (np.abs(total - short.mean) <= 4 * error + 1e-6).all(), (max_bounces, total, short)
    assert (mean("indirect", 8).mean > 0.01).all()


@pytest.mark.parametrize("far", [0.0, 1e5])
def test_position_is_that_of_the_first_event(tmp_path: Path, far: float) -> None:
    """On a wall, in the front of a dense slab, and nowhere."""
    stage = StageBuilder(16, 8)
    stage.camera((far, 0, 5), (far, 0, 0), vfov=60)
    stage.quad((far - 9, -9, -1), (9, 0, 0), (0, 9, 0), stage.lambert(0.5))
    stage.box((far, 0, -1), (far + 9, 9, 1), stage.medium(1e4, 0.5))
    stage.dome(1.0)
    position = Shot(stage, tmp_path).render(aovs=("position",), spp=4, max_bounces=2, filter="box")[
        "position"
    ]
    wall, fog, sky = position[4:, :8], position[:4, 8:], position[:4, :8]
    np.testing.assert_allclose(wall[..., 2], -1.0, atol=1e-3)
    np.testing.assert_allclose(fog[..., 2], 1.0, atol=2e-3)
    assert (sky == 0.0).all()
    # Half a picture is as high as the camera is away, times the tangent of half its angle.
    edge = 6.0 * np.tan(np.radians(30.0))
    np.testing.assert_allclose(wall[:, :, 1].mean(axis=1), -edge * (np.arange(4) + 0.5) / 4, atol=0.1)
    assert (np.diff(wall[0, :, 0]) > 0).all()
    assert abs(wall[..., 0].mean() - (far - edge)) < 0.15

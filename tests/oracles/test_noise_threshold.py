"""Adaptive sampling: the noise that was asked for, everywhere, and the mean of uniform sampling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.render import Shot
from support.stages import StageBuilder
from support.statistics import estimate

if TYPE_CHECKING:
    from pathlib import Path

    from support.render import Images
    from support.statistics import Estimate

BOUNCES = 6
PLAIN = {"distanceSampling": "delta", "guiding": "off", "max_bounces": BOUNCES}
GUIDED = {"distanceSampling": "odds", "guiding": "on", "max_bounces": BOUNCES}
DARKEST = 1e-4


def frame(folder: Path, *, fog: float = 0.1, size: tuple[int, int] = (24, 16)) -> Shot:
    """Return a corner in fog with a dense ball; the thicker the fog, the noisier."""
    folder.mkdir()
    stage = StageBuilder(*size)
    stage.camera((0, 0, 6), (0, 0, 0), vfov=40)
    grey = stage.lambert(0.6)
    stage.quad((-2, -2, -2), (4, 0, 0), (0, 4, 0), grey)
    stage.quad((-2, -2, -2), (0, 0, 4), (4, 0, 0), grey)
    stage.box((-3, -3, -3), (3, 3, 3), stage.medium(fog, (0.9, 0.8, 0.7), 0.4))
    stage.sphere((0.5, -0.5, 0), 0.7, stage.medium((3.0, 1.0, 0.5), 0.9))
    stage.sphere_light((1.0, 1.5, 0.5), 0.3, 6.0)
    return Shot(stage, folder)


@pytest.fixture(scope="module")
def foggy(tmp_path_factory: pytest.TempPathFactory) -> Shot:
    return frame(tmp_path_factory.mktemp("noise") / "frame", fog=0.4)


@pytest.fixture(scope="module")
def uniform(foggy: Shot) -> Estimate:
    return estimate(foggy.seeds(40, spp=256, first_seed=5000, **GUIDED))


@pytest.mark.parametrize("guides", [PLAIN, GUIDED], ids=["plain", "guided"])
def test_deciding_by_neighbours_is_no_bias(foggy: Shot, uniform: Estimate, guides: dict[str, object]) -> None:
    """Few samples and a decision that falls differently in each render: where a bias would be largest."""
    images, counts = [], []
    for seed in range(160):
        film = foggy.render(aovs=("rgba", "samples"), spp=256, seed=seed, noiseThreshold=0.04, **guides)
        images.append(film["rgba"][..., :3])
        counts.append(film["samples"])
    varies = np.ptp(np.stack(counts), axis=0) > 0
    assert varies.mean() > 0.7, "chance decides how many samples a pixel gets"
    assert 40 < np.mean(counts) < 160
    adaptive = estimate(np.stack(images).astype(np.float64))
    z = (adaptive.mean - uniform.mean) / np.hypot(adaptive.error, uniform.error)
    assert (np.hypot(adaptive.error, uniform.error) < 0.002 * uniform.mean).all(), "not sharp enough"
    assert (np.abs(z) < 4).all(), f"{adaptive.mean} against {uniform.mean}: z {z}"


def relative_noise(images: Images) -> float:
    """Return the root mean square over pixels of their standard deviation as a threshold measures it."""
    brightness = np.maximum(images.mean(axis=(0, 3)), DARKEST)
    allowed = np.maximum(brightness, np.sqrt(brightness))
    deviation = np.sqrt(images.var(axis=0, ddof=1).mean(axis=2))
    return float(np.sqrt(np.mean((deviation / allowed) ** 2)))


def test_frames_of_any_difficulty_have_the_same_noise(tmp_path: Path) -> None:
    """Measured over seeds, which no render knows, where the least number of samples is not the limit."""
    threshold = 0.01
    noise, cost = [], []
    for i, fog in enumerate((0.02, 0.1, 0.5)):
        shot = frame(tmp_path / str(i), fog=fog, size=(20, 14))
        settings = {"aovs": ("rgba", "samples"), "spp": 16384, "noiseThreshold": threshold, **PLAIN}
        films = [shot.render(seed=seed, **settings) for seed in range(8)]
        noise.append(relative_noise(np.stack([film["rgba"][..., :3] for film in films]).astype(np.float64)))
        cost.append(np.mean([film["samples"].mean() for film in films]))
    assert all(abs(value / threshold - 1) < 0.25 for value in noise), (noise, cost)
    assert max(cost) > 3 * min(cost), cost

"""A guiding cache saves learning, and costs noise at worst: it never moves a mean."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.render import Shot
from support.stages import StageBuilder
from support.statistics import estimate

if TYPE_CHECKING:
    from pathlib import Path

BOUNCES = 6
GUIDED = {"distanceSampling": "odds", "guiding": "on", "max_bounces": BOUNCES}


def room(folder: Path, *, light: float = 6.0, ball: float = 0.5, camera: float = 0.0) -> Shot:
    """Return fog and a dense ball in a corner, lit by a lamp."""
    folder.mkdir()
    stage = StageBuilder(24, 16)
    stage.camera((camera, 0, 6), (0, 0, 0), vfov=40)
    grey = stage.lambert(0.6)
    stage.quad((-2, -2, -2), (4, 0, 0), (0, 4, 0), grey)
    stage.quad((-2, -2, -2), (0, 0, 4), (4, 0, 0), grey)
    stage.box((-3, -3, -3), (3, 3, 3), stage.medium(0.15, (0.9, 0.8, 0.7), 0.4))
    stage.sphere((ball, -0.5, 0), 0.7, stage.medium((3.0, 1.0, 0.5), 0.9))
    stage.sphere_light((1.0, 1.5, 0.5), 0.3, light)
    return Shot(stage, folder)


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Shot:
    return room(tmp_path_factory.mktemp("cache") / "room")


@pytest.fixture(scope="module")
def unguided(shot: Shot) -> Any:
    plain = {"distanceSampling": "delta", "guiding": "off"}
    return shot.seeds(8, spp=1024, max_bounces=BOUNCES, first_seed=500, **plain)


def train(shot: Shot, file: Path, **settings: Any) -> None:
    shot.render(cachePath=str(file), cacheMode="train", **{**GUIDED, **settings})
    assert file.exists()


def same_mean(images: Any, reference: Any) -> None:
    found, expected = estimate(images), estimate(reference)
    z = (found.mean - expected.mean) / np.hypot(found.error, expected.error)
    assert (found.error < 0.015 * expected.mean).all(), f"not sharp enough: {found}"
    assert (np.abs(z) < 4).all(), f"{found.mean} against {expected.mean}: z {z}"


def test_a_cache_learned_from_the_same_random_numbers_is_no_bias(
    shot: Shot, unguided: Any, tmp_path: Path
) -> None:
    images = []
    for seed in range(600):
        file = tmp_path / f"{seed}.tyc"
        train(shot, file, spp=2, seed=seed)
        warm = shot.render(spp=2, seed=seed, cachePath=str(file), cacheMode="read", **GUIDED)
        images.append(warm["rgba"][..., :3])
        file.unlink()
    same_mean(np.stack(images).astype(np.float64), unguided)


@pytest.mark.parametrize(
    "change", [{"light": 60.0}, {"ball": -1.2}, {"camera": 3.0}], ids=["light", "ball", "camera"]
)
def test_a_stale_cache_is_no_bias(
    shot: Shot, unguided: Any, tmp_path: Path, change: dict[str, float]
) -> None:
    file = tmp_path / "other.tyc"
    train(room(tmp_path / "other", **change), file, spp=64)
    images = shot.seeds(300, spp=4, cachePath=str(file), cacheMode="read", **GUIDED)
    same_mean(images, unguided)


def test_the_first_samples_of_a_warm_render_are_cleaner(shot: Shot, tmp_path: Path) -> None:
    file = tmp_path / "shot.tyc"
    train(shot, file, spp=128, seed=77)
    cold = shot.seeds(200, spp=1, **GUIDED)
    warm = shot.seeds(200, spp=1, cachePath=str(file), cacheMode="read", **GUIDED)
    variance = [images.mean(axis=3).var(axis=0).mean() for images in (cold, warm)]
    assert variance[1] < 0.8 * variance[0], variance


def test_odds_go_along_with_a_moving_camera(tmp_path: Path) -> None:
    # .68 of the variance of a render that knows nothing, and .56 with a cache of the very same place.
    odds = {"distanceSampling": "odds", "guiding": "off"}
    file = tmp_path / "shot.tyc"
    train(room(tmp_path / "before"), file, spp=128, seed=77, **odds)
    moved = room(tmp_path / "after", camera=0.4)
    known = {"cachePath": str(file), "cacheMode": "read"}
    cold, warm = (
        moved.seeds(150, spp=1, **{**GUIDED, **odds, **settings}).mean(axis=3).var(axis=0).mean()
        for settings in ({}, known)
    )
    assert warm < 0.85 * cold, (warm, cold)


def test_dropped_caches_leave_no_trace_and_threads_do_not_count(shot: Shot, tmp_path: Path) -> None:
    file = tmp_path / "shot.tyc"
    train(room(tmp_path / "other", light=60.0), file, spp=16)
    cold = shot.render(spp=8, **GUIDED)["rgba"]
    stale = shot.render(spp=8, cachePath=str(file), cacheMode="read", **GUIDED)["rgba"]
    assert np.array_equal(cold, stale)
    files = [tmp_path / f"{threads}.tyc" for threads in (1, 2)]
    train(shot, file, spp=16)
    images = []
    for threads, copy in zip((1, 2), files, strict=True):
        shutil.copy(file, copy)
        images.append(shot.render(spp=8, threads=threads, cachePath=str(copy), **GUIDED)["rgba"])
    assert np.array_equal(*images)
    assert files[0].read_bytes() == files[1].read_bytes() != file.read_bytes()

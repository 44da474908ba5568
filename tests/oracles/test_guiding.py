"""What is learned during a render steers samples and never the mean; where it should help, it does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.render import Shot, tyndall
from support.stages import StageBuilder
from support.statistics import estimate

if TYPE_CHECKING:
    from pathlib import Path

BOUNCES = 6


def room(folder: Path, width: int = 24, height: int = 16) -> Shot:
    """Return fog and a dense coloured ball in a room open towards the camera, lit by a lamp and a sun."""
    stage = StageBuilder(width, height)
    stage.camera((0, 0, 6), (0, 0, 0), vfov=40)
    grey, red = stage.lambert(0.6), stage.lambert((0.7, 0.2, 0.1))
    stage.quad((-2, -2, -2), (4, 0, 0), (0, 4, 0), grey)
    stage.quad((-2, -2, -2), (0, 0, 4), (4, 0, 0), grey)
    stage.quad((-2, -2, -2), (0, 4, 0), (0, 0, 4), red)
    stage.box((-3, -3, -3), (3, 3, 3), stage.medium(0.15, (0.9, 0.8, 0.7), 0.4))
    stage.sphere((0.5, -0.5, 0), 0.7, stage.medium((3.0, 1.0, 0.5), 0.9))
    stage.sphere_light((1.0, 1.5, 0.5), 0.3, 6.0)
    stage.distant((0.3, -1.0, -0.4), 2.0)
    return Shot(stage, folder)


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Shot:
    return room(tmp_path_factory.mktemp("room"))


@pytest.fixture(scope="module")
def unguided(shot: Shot) -> Any:
    settings = {"distanceSampling": "delta", "guiding": "off"}
    return shot.seeds(16, spp=1024, max_bounces=BOUNCES, first_seed=500, **settings)


@pytest.mark.parametrize(
    ("sampling", "guiding"),
    [("odds", "off"), ("target", "off"), ("delta", "on"), ("odds", "on")],
)
@pytest.mark.parametrize("spp", [2, 4, 64])
def test_means_agree_at_any_sample_count(
    shot: Shot, unguided: Any, spp: int, sampling: str, guiding: str
) -> None:
    settings = {"distanceSampling": sampling, "guiding": guiding}
    # As many samples in all, whatever one render takes: a bias of few samples is seen as sharply.
    images = shot.seeds(3072 // spp, spp=spp, max_bounces=BOUNCES, **settings)
    found, expected = estimate(images), estimate(unguided)
    z = (found.mean - expected.mean) / np.hypot(found.error, expected.error)
    assert (found.error < 0.01 * expected.mean).all(), f"not sharp enough: {found}"
    assert (np.abs(z) < 4).all(), f"{found.mean} against {expected.mean}: z {z}"


def test_techniques_that_find_a_lamp_in_fog_share_its_light(tmp_path: Path) -> None:
    """Light before the distance, light at the collision, and directions weigh with the same densities."""
    stage = StageBuilder(6, 6)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=20)
    stage.box((-2, -2, -2), (2, 2, 2), stage.medium(0.8, 0.95, 0.6))
    stage.sphere_light((0, 0.9, 0), 0.4, 6.0)
    lamp = Shot(stage, tmp_path)
    plain = {"distanceSampling": "delta", "guiding": "off"}
    expected = estimate(lamp.seeds(16, spp=2048, max_bounces=3, first_seed=500, **plain))
    found = estimate(lamp.seeds(64, spp=512, max_bounces=3, distanceSampling="delta", guiding="on"))
    z = (found.mean - expected.mean) / np.hypot(found.error, expected.error)
    assert (found.error < 0.002 * expected.mean).all(), f"not sharp enough: {found}"
    assert (np.abs(z) < 4).all(), f"{found.mean} against {expected.mean}: z {z}"


@pytest.mark.parametrize(
    ("sampling", "guiding"), [("odds", "off"), ("target", "off"), ("nds", "off"), ("odds", "on")]
)
@pytest.mark.parametrize("spp", [2, 64])
def test_means_agree_with_light_at_candidates(
    shot: Shot, unguided: Any, spp: int, sampling: str, guiding: str
) -> None:
    settings = {"distanceSampling": sampling, "guiding": guiding, "lightSampling": "candidate"}
    images = shot.seeds(3072 // spp, spp=spp, max_bounces=BOUNCES, **settings)
    found, expected = estimate(images), estimate(unguided)
    z = (found.mean - expected.mean) / np.hypot(found.error, expected.error)
    assert (found.error < 0.01 * expected.mean).all(), f"not sharp enough: {found}"
    assert (np.abs(z) < 4).all(), f"{found.mean} against {expected.mean}: z {z}"


def mist(folder: Path, sigma_t: float) -> Shot:
    """Return mist two units deep before darkness, lit along the view."""
    stage = StageBuilder(8, 8)
    stage.camera((0, 0, 5), (0, 0, 0), vfov=1)
    stage.box((-2, -2, -1), (2, 2, 1), stage.medium(sigma_t, 1.0))
    stage.distant((0, 0, -1), 3.0)
    return Shot(stage, folder)


@pytest.mark.parametrize("sampling", ["odds", "target"])
@pytest.mark.parametrize("sigma_t", [0.05, 1.0])
def test_light_at_candidates_is_single_scattering(tmp_path: Path, sampling: str, sigma_t: float) -> None:
    """E / 4 pi times the integral of s exp(-2 s t) over a depth of 2."""
    shot = mist(tmp_path, sigma_t)
    images = shot.seeds(
        16, spp=128, max_bounces=1, distanceSampling=sampling, lightSampling="candidate", guiding="off"
    )
    found = estimate(images)
    expected = 3.0 / (4 * np.pi) * -np.expm1(-4 * sigma_t) / 2
    # Rays at the corner of the image are longer by 8e-5.
    assert (np.abs(found.mean - expected) < 4 * found.error + 1e-4 * expected).all(), f"{found}, {expected}"


def test_light_at_candidates_needs_no_lessons(tmp_path: Path) -> None:
    """In the first sample of thin mist one path in ten scatters, W = 1 - exp(-.1).

    That makes a variance of S^2 (1/W - 1). With light at candidates all of them see the lamp: what is left is
    that of the depth, below S^2 W^2 / 12.
    """
    shot = mist(tmp_path, 0.05)
    scattered = 3.0 / (4 * np.pi) * -np.expm1(-0.2) / 2
    variance = {}
    for where in ("event", "candidate"):
        images = shot.seeds(
            16, spp=1, max_bounces=1, distanceSampling="odds", lightSampling=where, guiding="off"
        )
        variance[where] = images.var(axis=0, ddof=1).mean() / scattered**2
    assert variance["event"] > 5
    assert variance["candidate"] < 0.01


def smoke(folder: Path) -> Shot:
    """Return uneven smoke over a floor, small enough to be rendered hundreds of times."""
    values = np.random.default_rng(5).uniform(0.0, 1.0, (16, 16, 16)).astype(np.float32)
    values[5:9, :, 6:] = 0.0
    tyndall.write_vdb(str(folder / "smoke.vdb"), "density", values, 0.125, (-1.0, -1.0, -1.0))
    stage = StageBuilder(8, 8)
    stage.camera((0, 1.0, 5), (0, 0, 0), vfov=35)
    stage.volume(folder / "smoke.vdb", stage.medium((1.5, 1.0, 0.6), 0.9, 0.3, field="density"))
    stage.quad((-4, -1.2, 4), (8, 0, 0), (0, 0, -8), stage.lambert((0.7, 0.5, 0.3)))
    stage.distant((0.3, -1.0, -0.4), 2.0)
    return Shot(stage, folder)


@pytest.fixture(scope="module")
def smoke_shot(tmp_path_factory: pytest.TempPathFactory) -> Shot:
    return smoke(tmp_path_factory.mktemp("smoke"))


@pytest.fixture(scope="module")
def plain_smoke(smoke_shot: Shot) -> Any:
    plain = {"distanceSampling": "delta", "guiding": "off"}
    return smoke_shot.seeds(10, spp=4096, max_bounces=BOUNCES, first_seed=900, **plain)


@pytest.mark.parametrize("spp", [1, 4, 16, 64])
@pytest.mark.parametrize(
    ("sampling", "guiding"),
    [("odds", "off"), ("target", "off"), ("nds", "off"), ("nds+", "off"), ("odds", "on"), ("nds+", "on")],
)
def test_smoke_is_as_bright_however_it_is_sampled(
    smoke_shot: Shot, plain_smoke: Any, spp: int, sampling: str, guiding: str
) -> None:
    """Ten seeds for each pixel at 64 samples, and as many more as the samples are fewer."""
    settings = {"distanceSampling": sampling, "guiding": guiding}
    images = smoke_shot.seeds(10 * 64 // spp, spp=spp, max_bounces=BOUNCES, **settings)
    found, expected = estimate(images), estimate(plain_smoke)
    z = (found.mean - expected.mean) / np.hypot(found.error, expected.error)
    assert (found.error < 0.02 * expected.mean).all(), f"not sharp enough: {found}"
    assert (np.abs(z) < 4).all(), f"{found.mean} against {expected.mean}: z {z}"


def test_thin_mist_before_darkness_is_found(tmp_path: Path) -> None:
    """Of twenty rays one scatters by itself, and only scattered light is seen: odds make it most of them."""
    stage = StageBuilder(16, 16)
    stage.camera((0, 0, 5), (0, 0, 0), vfov=20)
    stage.box((-2, -2, -1), (2, 2, 1), stage.medium(0.025, 1.0))
    stage.quad((-9, -9, -3), (18, 0, 0), (0, 18, 0), stage.lambert(0.0))
    stage.distant((0, 0, -1), 3.0)
    shot = Shot(stage, tmp_path)
    variance = {}
    for sampling in ("delta", "odds"):
        images = shot.seeds(12, spp=256, max_bounces=1, distanceSampling=sampling)
        variance[sampling] = images.var(axis=0, ddof=1).mean() / images.mean() ** 2
    assert variance["odds"] < 0.4 * variance["delta"], variance


def test_probabilities_are_seen(tmp_path: Path) -> None:
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 5), (0, 0, 0), vfov=20)
    stage.box((-2, -2, -1), (2, 2, 1), stage.medium(0.05, 1.0))
    stage.distant((0, 0, -1), 3.0)
    shot = Shot(stage, tmp_path)
    aovs = ("rgba", "vsp", "vsp_target")
    means = {}
    for sampling in ("delta", "odds"):
        images = shot.render(aovs=aovs, spp=256, max_bounces=1, distanceSampling=sampling)
        means[sampling] = [float(images[name].mean()) for name in aovs[1:]]
    for achieved, wanted in means.values():
        assert achieved == pytest.approx(wanted, abs=4 * 0.5 / np.sqrt(256 * 16 * 12))
    # W = 1 - exp(-0.05 * 2) by itself; nearly always once learned.
    assert means["delta"][0] == pytest.approx(0.0952, abs=0.005)
    assert means["odds"][0] > 0.5


def test_threads_change_no_bit(shot: Shot) -> None:
    settings = {"distanceSampling": "odds", "guiding": "on", "spp": 16, "max_bounces": BOUNCES, "seed": 3}
    one, two, again = (shot.render(threads=n, **settings)["rgba"] for n in (1, 2, 2))
    assert np.array_equal(one, two)
    assert np.array_equal(two, again)


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1)])
def test_images_of_a_line_or_a_point(tmp_path: Path, size: tuple[int, int]) -> None:
    shot = room(tmp_path, *size)
    settings = {"distanceSampling": "odds", "guiding": "on"}
    image = shot.render(spp=33, max_bounces=BOUNCES, **settings)["rgba"]
    assert np.isfinite(image).all()
    assert image[..., :3].max() > 0


def bounced_light(folder: Path, width: int) -> Shot:
    """Return a closed room whose lamp lights a patch of the ceiling and nothing else."""
    stage = StageBuilder(width, 3 * width // 4)
    stage.camera((0, 0, 1.9), (0, 0, -2), vfov=60)
    stage.box((-2, -1.5, -2), (2, 1.5, 2), stage.lambert(0.7))
    stage.rect_light((-1.2, 1.3, -0.8), (-1.2, 1.5, -0.8), 0.3, 0.3, 100.0)
    return Shot(stage, folder)


def test_auto_finds_out_whether_directions_pay(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("bounced", "fog")]
    for folder in folders:
        folder.mkdir()
    shots = [bounced_light(folders[0], 192), room(folders[1], 96, 64)]
    trials = {}
    for folder, of in zip(folders, shots, strict=True):
        session = of.session(spp=128, max_bounces=BOUNCES)
        session.render()
        trials[folder.name] = session.statistics["guide"]["trial"]
    assert trials["bounced"]["chosen"] == {"directions": True, "odds": False}, trials
    assert trials["bounced"]["arms"][0]["error"] < 0.6, trials
    assert trials["fog"]["chosen"] == {"directions": False, "odds": False}, trials
    assert len(trials["fog"]["arms"]) == 3


def test_auto_learns_nothing_where_that_cannot_pay(shot: Shot, tmp_path: Path) -> None:
    """Few samples; and direct light only, which knows no further segments, and without media no choice."""
    short = shot.session(spp=64, max_bounces=BOUNCES)
    short.render()
    assert "guide" not in short.statistics
    direct = shot.session(spp=128, max_bounces=1)
    direct.render()
    assert "field" not in direct.statistics["guide"]
    closed = bounced_light(tmp_path, 24).session(spp=128, max_bounces=1)
    closed.render()
    assert "guide" not in closed.statistics


def test_auto_is_the_same_on_any_number_of_threads(tmp_path: Path) -> None:
    closed = bounced_light(tmp_path, 48)
    images = [closed.render(threads=n, spp=128, max_bounces=2)["rgba"] for n in (1, 2)]
    assert np.array_equal(*images)


def test_odds_of_the_field_find_mist_behind_the_first_event(tmp_path: Path) -> None:
    """Light reaches the floor from thin mist only, by segments that leave the floor."""
    stage = StageBuilder(12, 12)
    stage.camera((0, 0.8, 0.8), (0, 0, 0), vfov=30)
    stage.quad((-3, 0, 3), (6, 0, 0), (0, 0, -6), stage.lambert(0.8))
    stage.box((-3, -0.5, -3), (3, 2, 3), stage.medium(0.1, 1.0))
    stage.distant((1, 0, 0), 3.0)
    shot = Shot(stage, tmp_path)
    variances, means = {}, {}
    for sampling, guiding in (("delta", "on"), ("odds", "off"), ("odds", "on")):
        settings = {"distanceSampling": sampling, "guiding": guiding}
        images = shot.seeds(16, spp=64, max_bounces=2, **settings)
        variances[sampling, guiding] = images.var(axis=0, ddof=1).mean()
        means[sampling, guiding] = estimate(images)
    found = means["odds", "on"]
    for other in means.values():
        assert (np.abs(found.mean - other.mean) <= 4 * np.hypot(found.error, other.error)).all(), means
    best = min(variances["delta", "on"], variances["odds", "off"])
    assert variances["odds", "on"] < 0.4 * best, variances

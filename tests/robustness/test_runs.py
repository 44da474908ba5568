"""How a run behaves: the same bits again, a stop that keeps the work, files that say what they are."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support import exr
from support.cli import read_stats, tyndall, tyndall_interrupted
from support.render import Shot
from support.render import tyndall as core
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

AOVS = (
    "rgba",
    "albedo",
    "normal",
    "depth",
    "volume",
    "surface",
    "transmittance",
    "samples",
    "variance",
    "guide",
    "volume_depth",
)


def foggy_room(width: int = 48, height: int = 36) -> StageBuilder:
    """All the transport has in one small stage: overlapping media, glass, lights of two kinds."""
    stage = StageBuilder(width, height)
    stage.camera((0, 1, 4), (0, 0.7, 0), vfov=50)
    stage.quad((-4, 0, 4), (8, 0, 0), (0, 0, -8), stage.lambert((0.6, 0.5, 0.4)))
    stage.sphere((-0.8, 0.5, 0), 0.5, stage.glass())
    stage.sphere((0.8, 0.6, 0), 0.6, stage.medium((2, 4, 8), 0.9, 0.6))
    stage.box((-5, -1, -5), (5, 4, 5), stage.medium(0.1, 0.9, 0.3))
    stage.sphere_light((0.5, 2, 1), 0.2, 20)
    stage.dome((0.3, 0.4, 0.5))
    return stage


def test_same_bits_on_one_and_two_threads_and_twice(tmp_path: Path) -> None:
    stage = foggy_room(97, 61).save(tmp_path / "stage.usda")
    images = {}
    for name, threads in (("one", 1), ("two", 2), ("again", 2), ("many", 200)):
        path = tmp_path / f"{name}.exr"
        run = tyndall(
            "render", stage, "-o", path, "--spp", 9, "--threads", threads, "--seed", 5, *aov_options()
        )
        assert run.code == 0, run.text
        images[name] = exr.read_layers(path)
    first = images.pop("one")
    for name, layers in images.items():
        assert layers.keys() == first.keys()
        for layer in first:
            np.testing.assert_array_equal(layers[layer], first[layer], err_msg=f"{layer} of {name}")


def aov_options() -> list[str]:
    return [word for aov in AOVS for word in ("--aov", aov)]


def test_another_seed_is_another_picture(tmp_path: Path) -> None:
    shot = Shot(foggy_room(), tmp_path)
    one, two = (shot.render(spp=4, seed=seed, max_bounces=8)["rgba"] for seed in (1, 2))
    assert not np.array_equal(one, two)


def test_every_aov_is_written_and_means_what_it_says(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    path = tmp_path / "image.exr"
    run = tyndall("render", stage, "-o", path, "--spp", 64, "--filter", "box", *aov_options())
    assert run.code == 0, run.text
    layers = exr.read_layers(path)
    assert set(AOVS) <= set(layers)
    assert all(np.isfinite(layers[name]).all() for name in AOVS if name != "depth")
    assert (layers["guide"] == 0).all(), "nothing is guided unless it is asked for"
    assert (layers["samples"] == 64).all()
    assert ((layers["transmittance"] >= 0) & (layers["transmittance"] <= 1)).all()
    assert (layers["albedo"] >= 0).all()
    assert layers["albedo"].mean() <= 1
    # What is seen first is seen either in a medium or behind it.
    total = layers["volume"][..., :3] + layers["surface"][..., :3]
    half_precision = 2.0**-10
    np.testing.assert_allclose(total, layers["rgba"][..., :3], rtol=half_precision, atol=1e-5)


def test_where_directions_were_guided_is_seen(tmp_path: Path) -> None:
    shot = Shot(foggy_room(), tmp_path)
    guide = shot.render(aovs=("guide",), spp=32, max_bounces=8, guiding="on")["guide"]
    share, samples, lobes = np.moveaxis(guide, -1, 0)
    # The first pass has nothing to be guided by; later paths are guided unless they meet the sky.
    assert share.max() <= 31 / 32
    assert share.mean() > 0.7
    assert ((samples > 0) == (share > 0)).all()
    assert (samples / np.maximum(share, 1e-9)).max() > 100
    assert 1 < (lobes / np.maximum(share, 1e-9)).mean() <= 32


def test_depth_of_scattering_is_that_of_the_medium(tmp_path: Path) -> None:
    """Light scatters in the front of a dense slab: depth is along the viewing axis, in corners as well."""
    stage = StageBuilder(16, 16)
    stage.camera((0, 0, 5), (0, 0, 0), vfov=60)
    stage.box((-9, -9, -1), (9, 9, 1), stage.medium(1e4, 0.5))
    stage.dome(1.0)
    depth = Shot(stage, tmp_path).render(aovs=("volume_depth",), spp=4, max_bounces=2)["volume_depth"]
    np.testing.assert_allclose(depth, 4.0, atol=2e-3)
    empty = StageBuilder(4, 4)
    empty.camera((0, 0, 5), (0, 0, 0), vfov=60)
    empty.dome(1.0)
    nothing = Shot(empty, tmp_path).render(aovs=("volume_depth",), spp=1, max_bounces=2)["volume_depth"]
    assert (nothing == np.float32(1e10)).all()


def test_variance_aov_is_the_variance_of_the_pixel(tmp_path: Path) -> None:
    """The mean of the estimates equals the scatter of pixels over seeds, both averaged over the picture."""
    shot = Shot(foggy_room(24, 18), tmp_path)
    renders = [
        shot.render(spp=32, seed=seed, max_bounces=8, aovs=["rgba", "variance"]) for seed in range(1, 33)
    ]
    estimated = np.stack([render["variance"][..., :3] for render in renders])
    observed = (
        np.stack([render["rgba"][..., :3] for render in renders]).astype(np.float64).var(axis=0, ddof=1)
    )
    # Well distributed samples scatter less than the independent samples the estimate assumes, never more.
    ratio = observed.mean(axis=(0, 1)) / estimated.mean(axis=(0, 1, 2))
    assert (ratio < 1.25).all(), ratio
    assert (ratio > 0.1).all(), ratio


def test_interrupt_writes_what_there_is(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    path, stats = tmp_path / "image.exr", tmp_path / "stats.json"
    run = tyndall_interrupted("render", stage, "-o", path, "--spp", 1_000_000, "--stats", stats, after=1.0)
    assert run.code == 130, run.text
    rgb = exr.read_rgb(path)
    assert rgb.shape == (36, 48, 3)
    assert np.isfinite(rgb).all()
    assert rgb.mean() > 0.05
    assert read_stats(stats)["spp"] < 1_000_000


def test_time_limit_ends_the_render(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    run = tyndall(
        "render", stage, "-o", tmp_path / "image.exr", "--spp", 1_000_000, "--time", 1.5, timeout=30
    )
    assert run.code == 0, run.text
    assert exr.read_rgb(tmp_path / "image.exr").mean() > 0.05


def test_smallest_time_limit_still_gives_an_image(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    run = tyndall(
        "render", stage, "-o", tmp_path / "image.exr", "--spp", 1_000_000, "--time", 1e-6, timeout=30
    )
    assert run.code == 0, run.text
    assert np.isfinite(exr.read_rgb(tmp_path / "image.exr")).all()


def test_one_pixel(tmp_path: Path) -> None:
    stage = foggy_room(1, 1).save(tmp_path / "stage.usda")
    run = tyndall("render", stage, "-o", tmp_path / "image.exr", "--spp", 16)
    assert run.code == 0, run.text
    assert exr.read_rgb(tmp_path / "image.exr").shape == (1, 1, 3)


def test_resolution_option(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    run = tyndall("render", stage, "-o", tmp_path / "image.exr", "--spp", 1, "--resolution", "20x10")
    assert run.code == 0, run.text
    assert exr.read_rgb(tmp_path / "image.exr").shape == (10, 20, 3)


def test_exr_says_how_it_was_made(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    run = tyndall("render", stage, "-o", tmp_path / "image.exr", "--spp", 4, "--seed", 77)
    assert run.code == 0, run.text
    header = exr.read_header(tmp_path / "image.exr")
    text = json.dumps({name: str(value) for name, value in header.items()})
    assert core.version in text
    assert "77" in text, "the seed is part of the settings"
    assert re.search("seconds", text, re.IGNORECASE), text
    assert re.search("samples|spp", text, re.IGNORECASE), text


def test_png_output(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    run = tyndall("render", stage, "-o", tmp_path / "image.png", "--spp", 4)
    assert run.code == 0, run.text
    assert (tmp_path / "image.png").read_bytes().startswith(b"\x89PNG")


def test_stats(tmp_path: Path) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    path = tmp_path / "stats.json"
    run = tyndall("render", stage, "-o", tmp_path / "image.exr", "--spp", 8, "--stats", path)
    assert run.code == 0, run.text
    stats = read_stats(path)
    assert stats["spp"] == 8
    assert stats["diagnostics"] == []
    text = json.dumps(stats)
    for word in ("wall", "cpu", "rays", "nonfinite", "memory", "majorantviolations"):
        assert word in text.lower(), f"no {word} in {text}"


def guided_run(folder: Path, *arguments: object) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the statistics and what the image says about its guide."""
    stage = foggy_room().save(folder / "stage.usda")
    image, path = folder / "image.exr", folder / "stats.json"
    run = tyndall("render", stage, "-o", image, "--stats", path, "--max-bounces", 8, *map(str, arguments))
    assert run.code == 0, run.text
    header = {name: str(value) for name, value in exr.read_header(image).items()}
    return read_stats(path), {name: v for name, v in header.items() if name.startswith("tyndall:guide")}


def test_stats_of_a_guide_are_measured(tmp_path: Path) -> None:
    guided = ("--guiding", "on", "--distance-sampling", "odds", "--spp")
    few, _ = guided_run(tmp_path, *guided, 4)
    many, metadata = guided_run(tmp_path, *guided, 64)
    before, after = (stats["statistics"]["guide"] for stats in (few, many))
    assert (before["lessons"], after["lessons"]) == (3, 7)
    for size in ("samples", "bytes", "lobes", "surfaceRegions"):
        assert after["field"][size] > before["field"][size] > 0, size
    assert before["imageBytes"] == after["imageBytes"] > 48 * 36 * 44
    assert after["field"]["bytes"] > 1000 * after["field"]["surfaceRegions"]
    assert 0 < many["seconds"]["train"] < many["seconds"]["render"]
    assert many["statistics"]["candidatesPerRay"] == 0, "homogeneous media are sampled in closed form"
    assert metadata["tyndall:guide:field:samples"] == str(after["field"]["samples"])
    assert float(metadata["tyndall:guide:trainSeconds"]) > 0


@pytest.mark.parametrize(
    ("arguments", "has_image", "has_field"),
    [
        (("--guiding", "off", "--distance-sampling", "delta"), False, False),
        (("--guiding", "on", "--distance-sampling", "delta"), False, True),
        (("--guiding", "off", "--distance-sampling", "target"), True, False),
    ],
    ids=["nothing", "directions", "odds"],
)
def test_stats_say_nothing_of_guides_there_are_not(
    tmp_path: Path, arguments: tuple[str, ...], has_image: bool, has_field: bool
) -> None:
    stats, metadata = guided_run(tmp_path, *arguments, "--spp", 2)
    guide = stats["statistics"].get("guide", {})
    assert ("imageBytes" in guide, "field" in guide) == (has_image, has_field)
    assert ("train" in stats["seconds"]) == bool(guide) == bool(metadata)


@pytest.mark.parametrize(
    ("style", "pattern"),
    [("lines", r"\d+(\.\d+)?\s*%"), ("alfred", r"ALF_PROGRESS \d+%"), ("none", None)],
    ids=["lines", "alfred", "none"],
)
def test_progress(tmp_path: Path, style: str, pattern: str | None) -> None:
    stage = foggy_room().save(tmp_path / "stage.usda")
    run = tyndall("render", stage, "-o", tmp_path / "image.exr", "--spp", 64, "--progress", style)
    assert run.code == 0, run.text
    if pattern is None:
        assert "%" not in run.text
    else:
        assert re.search(pattern, run.text), run.text
        assert "100" in run.text


def test_help_and_aov_list() -> None:
    assert tyndall("--help").code == 0
    run = tyndall("render", "--list-aovs")
    assert run.code == 0, run.text
    assert all(name in run.out for name in AOVS)

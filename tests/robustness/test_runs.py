"""How a run behaves: the same bits again, a stop that keeps the work, files that say what they are."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support import exr
from support.cli import read_stats, tyndall, tyndall_interrupted
from support.render import Shot
from support.render import tyndall as core
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

AOVS = ("rgba", "albedo", "normal", "depth", "volume", "surface", "transmittance", "samples", "variance")


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
    assert (layers["samples"] == 64).all()
    assert ((layers["transmittance"] >= 0) & (layers["transmittance"] <= 1)).all()
    assert (layers["albedo"] >= 0).all()
    assert layers["albedo"].mean() <= 1
    # What is seen first is seen either in a medium or behind it.
    total = layers["volume"][..., :3] + layers["surface"][..., :3]
    half_precision = 2.0**-10
    np.testing.assert_allclose(total, layers["rgba"][..., :3], rtol=half_precision, atol=1e-5)


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

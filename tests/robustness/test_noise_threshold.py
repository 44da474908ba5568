"""Adaptive sampling on the command line: the same bits however it is run, a clear word where it cannot be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from robustness.test_parts import assert_same_layers
from robustness.test_runs import foggy_room
from support import exr
from support.cli import Run, read_stats, tyndall, tyndall_interrupted

if TYPE_CHECKING:
    from pathlib import Path

OPTIONS = ("--spp", "2000", "--noise-threshold", "0.02", "--max-bounces", "8", "--guiding", "off")
AOVS = ("--aov", "rgba", "samples", "variance", "depth")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("noise")
    stage = foggy_room(37, 21).save(folder / "stage.usda")
    run = tyndall(
        "render",
        stage,
        "-o",
        folder / "one.exr",
        *OPTIONS,
        *AOVS,
        "--threads",
        "1",
        "--stats",
        folder / "s.json",
    )
    assert run.code == 0, run.text
    assert "on average" in run.err
    return folder


def render(folder: Path, image: Path, *options: object) -> Run:
    return tyndall("render", folder / "stage.usda", "-o", image, *OPTIONS, *AOVS, *map(str, options))


def test_threads_do_not_count(folder: Path, tmp_path: Path) -> None:
    assert render(folder, tmp_path / "two.exr", "--threads", 2).code == 0
    assert_same_layers(folder / "one.exr", tmp_path / "two.exr")


def test_samples_say_where_the_noise_was(folder: Path) -> None:
    layers = exr.read_layers(folder / "one.exr")
    samples = layers["samples"]
    assert 32 <= samples.min() < samples.mean() < samples.max() <= 2000
    full = samples[samples < 2000]
    assert (full % 32 == 0).all(), "whole passes"
    error = np.sqrt(layers["variance"].mean(axis=-1))
    brightness = np.maximum(layers["rgba"][..., :3].mean(axis=-1), 1e-4)
    noise = error / np.maximum(brightness, np.sqrt(brightness))
    # The variance of samples is an upper bound of what stratified ones have as noise.
    assert np.median(noise) == pytest.approx(0.02, rel=0.5)
    frame = read_stats(folder / "s.json")["frames"][0]
    assert frame["spp"] == samples.min()
    assert frame["meanSpp"] == pytest.approx(samples.mean())
    assert float(str(exr.read_header(folder / "one.exr")["tyndall:meanSamples"])) == pytest.approx(
        samples.mean(), abs=0.01
    )


def test_a_stopped_render_goes_on_with_the_same_bits(folder: Path, tmp_path: Path) -> None:
    image = tmp_path / "image.exr"
    checkpoint = tmp_path / "image.exr.checkpoint"
    arguments = ("render", folder / "stage.usda", "-o", image, *OPTIONS, *AOVS, "--checkpoint", "0.02")
    stops = 0
    for after in (0.05, 0.15, 0.3):
        run = tyndall_interrupted(*arguments, "--resume", after=after)
        stops += run.code == 130
        assert checkpoint.exists() == (run.code == 130)
    assert stops > 0
    run = tyndall(*arguments, "--resume")
    assert run.code == 0, run.text
    assert_same_layers(folder / "one.exr", image)
    assert not checkpoint.exists(), "a render that is clean is complete"


def test_another_threshold_is_another_render(folder: Path, tmp_path: Path) -> None:
    image = tmp_path / "image.exr"
    limits = ("--checkpoint", "60", "--time", "0.1", "--spp", "99999", "--noise-threshold", "1e-6")
    assert render(folder, image, *limits).code == 0
    assert (tmp_path / "image.exr.checkpoint").exists()
    run = render(folder, image, "--resume", "--strict")
    assert run.code == 3, run.text
    assert "noiseThreshold is 0.02 here and 1e-06 there" in run.err


def test_parts_cannot_decide(folder: Path, tmp_path: Path) -> None:
    run = render(folder, tmp_path / "part.exr", "--sample-range", "0:64")
    assert (run.code, "--noise-threshold 0" in run.err) == (2, True), run.text
    assert render(folder, tmp_path / "part.exr", "--sample-range", "0:64", "--noise-threshold", 0).code == 0


@pytest.mark.parametrize("value", ["-1", "nan", "inf", "little", "1e9"])
def test_bad_thresholds(folder: Path, tmp_path: Path, value: str) -> None:
    run = render(folder, tmp_path / "bad.exr", "--noise-threshold", value)
    assert run.code == 2, run.text
    assert "noise" in run.err

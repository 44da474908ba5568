"""One image from parts rendered apart: the same bits, and a clear word about parts that do not fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from robustness.test_runs import foggy_room
from support import exr
from support.cli import Run, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

AOVS = ("--aov", "rgba", "depth", "volume", "samples", "variance")
COMMON = ("--max-bounces", 8, "--guiding", "off", "--distance-sampling", "delta")


def render(stage: Path, image: Path, *options: object) -> Run:
    run = tyndall("render", stage, "-o", image, *map(str, (*COMMON, *options)))
    assert run.code == 0, run.text
    return run


def assert_same_layers(one: Path, other: Path) -> None:
    expected, layers = exr.read_layers(one), exr.read_layers(other)
    assert layers.keys() == expected.keys()
    for name in expected:
        np.testing.assert_array_equal(layers[name], expected[name], err_msg=name)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stage, its image, and its three parts."""
    folder = tmp_path_factory.mktemp("parts")
    stage = foggy_room(37, 21).save(folder / "stage.usda")
    render(stage, folder / "whole.exr", "--spp", 200, *AOVS)
    for name, range_ in (("a", "0:64"), ("b", "64:160"), ("c", "160:200")):
        render(stage, folder / f"{name}.exr", "--spp", 200, "--sample-range", range_, "--threads", 1, *AOVS)
    return folder


def test_parts_merge_to_the_bits_of_one_render(folder: Path) -> None:
    """In any order, by their images or by their files of sums."""
    parts = [folder / name for name in ("c.exr", "a.exr.film", "b.exr")]
    run = tyndall("merge", *parts, "-o", folder / "merged.exr")
    assert run.code == 0, run.text
    assert_same_layers(folder / "whole.exr", folder / "merged.exr")
    whole, merged = (exr.read_header(folder / name) for name in ("whole.exr", "merged.exr"))
    assert str(merged["tyndall:samples"]) == str(whole["tyndall:samples"])


def test_the_image_of_a_part_is_the_mean_of_its_samples(folder: Path) -> None:
    mean = sum(
        exr.read_layers(folder / f"{name}.exr")["rgba"][..., :3] * n / 200
        for name, n in (("a", 64), ("b", 96), ("c", 40))
    )
    whole = exr.read_layers(folder / "whole.exr")["rgba"][..., :3]
    np.testing.assert_allclose(mean, whole, rtol=3e-3, atol=1e-3)


def refused(folder: Path, *parts: str) -> str:
    run = tyndall("merge", *(folder / part for part in parts), "-o", folder / "refused.exr")
    assert run.code == 1, run.text
    assert not (folder / "refused.exr").exists()
    return run.err


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (("a.exr", "c.exr"), "the samples 64:160 between"),
        (("b.exr", "c.exr"), "0 is missing"),
        (("a.exr", "b.exr"), "the samples 160:200 after"),
        (("a.exr", "a.exr", "b.exr", "c.exr"), "both have the samples 0:64"),
        (("whole.exr",), "--sample-range"),
        (("nothing.exr",), "--sample-range"),
        (("stage.usda.film",), "No such file"),
    ],
)
def test_missing_and_doubled_parts(folder: Path, parts: tuple[str, ...], message: str) -> None:
    assert message in refused(folder, *parts)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--resolution", "20x10"), "resolution"),
        (("--aov", "albedo"), "aovs"),
        (("--seed", 7), "seed"),
        (("--spp", 168), "--spp is 200 here and 168 there"),
    ],
)
def test_parts_of_other_renders(folder: Path, options: tuple[object, ...], message: str) -> None:
    range_ = ("--sample-range", "64:160")
    render(folder / "stage.usda", folder / "other.exr", "--spp", 200, *AOVS, *range_, *options)
    error = refused(folder, "a.exr", "other.exr", "c.exr")
    assert message in error
    assert "a.exr.film and " in error
    assert "other.exr.film are" in error


def test_parts_of_another_scene(folder: Path) -> None:
    edited = (folder / "stage.usda").read_text().replace("0.9", "0.8")
    (folder / "edited.usda").write_text(edited)
    range_ = ("--sample-range", "64:160")
    render(folder / "edited.usda", folder / "other.exr", "--spp", 200, *AOVS, *range_)
    assert "the scenes are not the same" in refused(folder, "a.exr", "other.exr", "c.exr")


def test_damaged_parts(folder: Path) -> None:
    part = (folder / "b.exr.film").read_bytes()
    for content in (b"", part[:-1], part[: len(part) // 2], part[:99] + b"?" + part[100:], b"x" * 999):
        (folder / "damaged.film").write_bytes(content)
        error = refused(folder, "a.exr", "damaged.film", "c.exr")
        assert "damaged" in error or "no film" in error, error


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--sample-range", "0:40"), "multiple of 32"),
        (("--sample-range", "8:64"), "multiple of 32"),
        (("--sample-range", "0:256"), "within 0:200"),
        (("--sample-range", "0:64", "--time", 9), "time limit"),
    ],
)
def test_ranges_that_cannot_be_merged(folder: Path, options: tuple[object, ...], message: str) -> None:
    image = folder / "x.exr"
    run = tyndall("render", folder / "stage.usda", "-o", image, "--spp", 200, *map(str, options))
    assert (run.code, message in run.err) == (2, True), run.text


def test_learning_parts_say_so(folder: Path) -> None:
    guided = ("--guiding", "on", "--spp", 64)
    for range_ in ("0:32", "32:64"):
        image = folder / f"guided.{range_[:2].strip(':')}.exr"
        run = render(folder / "stage.usda", image, *guided, "--sample-range", range_)
        assert "guiding learns in each part" in run.err, run.err
    run = tyndall("merge", folder / "guided.0.exr", folder / "guided.32.exr", "-o", folder / "guided.exr")
    assert run.code == 0, run.text
    assert "guiding learned in each part" in run.err, run.err


def test_files_count_by_their_content(tmp_path: Path) -> None:
    """A part of a scene with another grid under the same name is refused; a copy elsewhere is as good."""
    from support.render import tyndall as core

    for i, (name, density) in enumerate((("here", 1.0), ("copy", 1.0), ("other", 2.0))):
        (tmp_path / name).mkdir()
        core.write_vdb(tmp_path / name / "grid.vdb", "density", np.full((8, 8, 8), density, np.float32), 0.25)
        stage = StageBuilder(8, 8)
        stage.camera((1, 1, 6), (1, 1, 0))
        stage.volume("./grid.vdb", stage.medium(1.0, 0.5, field="density"))
        stage.dome(1.0)
        range_ = "0:32" if i == 0 else "32:64"
        path = stage.save(tmp_path / name / "stage.usda")
        render(path, tmp_path / f"{name}.exr", "--spp", 64, "--sample-range", range_)
    merge = ("merge", tmp_path / "here.exr")
    assert tyndall(*merge, tmp_path / "copy.exr", "-o", tmp_path / "out.exr").code == 0
    assert tyndall(*merge, tmp_path / "other.exr", "-o", tmp_path / "out.exr").code == 1

"""Bad input: a message that names the thing and says what to do, the right exit code, never a crash."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from support import exr
from support.cli import Run, tyndall
from support.render import tyndall as core
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

DONE, FAILED, USAGE, STRICT = 0, 1, 2, 3


def small_stage() -> StageBuilder:
    """A sky that a complete render of shows as 1 in the corners."""
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=40)
    stage.dome(1.0)
    return stage


def render(
    stage: Path | StageBuilder, folder: Path, *arguments: str | int, output: Path | None = None
) -> Run:
    if isinstance(stage, StageBuilder):
        stage = stage.save(folder / "stage.usda")
    options = ("--spp", 4, "--max-bounces", 8, "--progress", "none")
    return tyndall("render", stage, "-o", output or folder / "image.exr", *options, *arguments)


def assert_message(run: Run, code: int, *words: str) -> None:
    """The exit code is `code`, and what was said contains every word."""
    assert run.code == code, run.text
    missing = [word for word in words if word.lower() not in run.err.lower()]
    assert not missing, f"{missing} not in the message:\n{run.err}"


def assert_rest_is_rendered(folder: Path) -> None:
    """The part of the picture that nothing is wrong with is there."""
    rgb = exr.read_rgb(folder / "image.exr")
    assert np.isfinite(rgb).all()
    assert rgb[0, 0] == pytest.approx(np.ones(3), rel=1e-3)


def assert_strict_refuses(folder: Path) -> None:
    run = render(folder / "stage.usda", folder, "--strict", output=folder / "strict.exr")
    assert run.code == STRICT, run.text


def test_missing_stage(tmp_path: Path) -> None:
    run = render(tmp_path / "absent.usda", tmp_path)
    assert_message(run, FAILED, "absent.usda")
    assert not (tmp_path / "image.exr").exists()


def test_stage_that_is_no_usd(tmp_path: Path) -> None:
    (tmp_path / "words.usda").write_text("not a stage", encoding="utf-8")
    assert_message(render(tmp_path / "words.usda", tmp_path), FAILED, "words.usda")


@pytest.mark.parametrize(
    "arguments",
    [
        ("--no-such-option",),
        ("--spp", "many"),
        ("--spp", "0"),
        ("--resolution", "0x4"),
        ("--aov", "no_such_aov"),
        ("--filter", "no_such_filter"),
        ("--threads", "-1"),
    ],
    ids=" ".join,
)
def test_bad_usage(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    run = render(small_stage(), tmp_path, *arguments)
    named = arguments[-1].lstrip("-")
    assert_message(run, USAGE, named.split("x")[0])
    assert not (tmp_path / "image.exr").exists()


def test_missing_camera(tmp_path: Path) -> None:
    run = render(small_stage(), tmp_path, "--camera", "/World/NoSuchCamera")
    assert_message(run, USAGE, "/World/NoSuchCamera", "/World/Camera")


def test_stage_without_camera(tmp_path: Path) -> None:
    stage = StageBuilder()
    stage.dome(1.0)
    assert_message(render(stage, tmp_path), FAILED, "camera")


def test_missing_vdb(tmp_path: Path) -> None:
    stage = small_stage()
    path = stage.volume(tmp_path / "absent.vdb", stage.medium(1.0, 0.5, field="density"))
    assert_message(render(stage, tmp_path), DONE, path, "absent.vdb")
    assert_rest_is_rendered(tmp_path)
    assert_strict_refuses(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.98])
def test_truncated_vdb(tmp_path: Path, share: float) -> None:
    whole = tmp_path / "whole.vdb"
    values = np.random.default_rng(1).random((20, 20, 20), np.float32)
    core.write_vdb(str(whole), "density", values, 0.1, (-1.0, -1.0, -1.0))
    data = whole.read_bytes()
    (tmp_path / "cut.vdb").write_bytes(data[: int(len(data) * share)])
    stage = small_stage()
    path = stage.volume(tmp_path / "cut.vdb", stage.medium(1.0, 0.5, field="density"))
    assert_message(render(stage, tmp_path), DONE, path, "cut.vdb")
    assert_rest_is_rendered(tmp_path)
    assert_strict_refuses(tmp_path)


def test_vdb_without_the_named_grid(tmp_path: Path) -> None:
    core.write_vdb(str(tmp_path / "fog.vdb"), "fog", np.ones((4, 4, 4), np.float32), 0.1, (0.0, 0.0, 0.0))
    stage = small_stage()
    path = stage.volume(tmp_path / "fog.vdb", stage.medium(1.0, 0.5, field="density"))
    assert_message(render(stage, tmp_path), DONE, path, "density", "fog")
    assert_rest_is_rendered(tmp_path)


def test_nan_points(tmp_path: Path) -> None:
    stage = small_stage()
    nan, inf = float("nan"), float("inf")
    points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (nan, 0, 0), (0, inf, 0)]
    path = stage.mesh(points, [3, 3, 3], [0, 1, 2, 0, 1, 3, 1, 2, 4], stage.lambert(0.5))
    assert_message(render(stage, tmp_path), DONE, path, "points")
    assert_rest_is_rendered(tmp_path)
    assert_strict_refuses(tmp_path)


@pytest.mark.parametrize("index", [4, 1_000_000, -1])
def test_index_out_of_range(tmp_path: Path, index: int) -> None:
    stage = small_stage()
    points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    path = stage.mesh(points, [3, 3], [0, 1, 2, 0, 2, index], stage.lambert(0.5))
    assert_message(render(stage, tmp_path), DONE, path, str(index))
    assert_rest_is_rendered(tmp_path)
    assert_strict_refuses(tmp_path)


def test_counts_that_do_not_add_up(tmp_path: Path) -> None:
    stage = small_stage()
    points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0)]
    path = stage.mesh(points, [3, 4], [0, 1, 2], stage.lambert(0.5))
    assert_message(render(stage, tmp_path), DONE, path)
    assert_rest_is_rendered(tmp_path)


def test_unknown_shader(tmp_path: Path) -> None:
    stage = small_stage()
    material = stage.lambert(0.5)
    stage.stage.GetPrimAtPath(f"{material}/preview").GetAttribute("info:id").Set("NoSuchShader")
    stage.sphere((0, 0, 0), 0.5, material)
    assert_message(render(stage, tmp_path), DONE, material, "NoSuchShader")
    assert_rest_is_rendered(tmp_path)
    assert_strict_refuses(tmp_path)


def test_output_folder_absent(tmp_path: Path) -> None:
    target = tmp_path / "no" / "such" / "folder" / "image.exr"
    run = render(small_stage(), tmp_path, output=target)
    assert_message(run, FAILED, "folder")
    assert not target.exists()


def test_output_format_unknown(tmp_path: Path) -> None:
    run = render(small_stage(), tmp_path, output=tmp_path / "image.xyz")
    assert run.code in (FAILED, USAGE)
    assert ".exr" in run.err


def test_good_input_says_nothing_bad(tmp_path: Path) -> None:
    """The counterpart: a clean stage passes `--strict`."""
    stage = small_stage()
    stage.sphere((0, 0, 0), 0.5, stage.lambert(0.5))
    assert render(stage, tmp_path, "--strict").code == DONE
    assert_rest_is_rendered(tmp_path)

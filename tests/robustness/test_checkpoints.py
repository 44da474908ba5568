"""Renders that are killed and go on: the same bits in the end, and no trust in files that do not fit."""

from __future__ import annotations

import random
import subprocess
import time
from typing import TYPE_CHECKING

import pytest
from robustness.test_parts import assert_same_layers
from robustness.test_runs import foggy_room
from support.cli import Run, command, read_stats, tyndall, tyndall_interrupted

if TYPE_CHECKING:
    from pathlib import Path

KILLS = 25
OPTIONS = ("--spp", "1200", "--max-bounces", "8", "--guiding", "off", "--distance-sampling", "delta")
AOVS = ("--aov", "rgba", "depth", "samples", "variance")
RESUMING = ("--checkpoint", "0.02", "--resume")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stage and its image."""
    folder = tmp_path_factory.mktemp("checkpoints")
    stage = foggy_room(16, 12).save(folder / "stage.usda")
    stats = ("--stats", folder / "stats.json")
    assert tyndall("render", stage, "-o", folder / "whole.exr", *OPTIONS, *AOVS, *stats).code == 0
    return folder


def kill_after(seconds: float, *arguments: object) -> bool:
    """Run the command, kill it so long after rendering has begun, and return whether it was still running."""
    with subprocess.Popen(
        [command(), *map(str, arguments), "--progress", "lines"], stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        while line := process.stderr.readline():
            if "%" in line:
                break
        time.sleep(seconds)
        was_running = process.poll() is None
        process.kill()
    return was_running


def test_killed_at_any_moment_the_image_is_the_same(folder: Path, tmp_path: Path) -> None:
    render_seconds = read_stats(folder / "stats.json")["seconds"]["render"]
    moments = random.Random(1)
    image = tmp_path / "image.exr"
    arguments = ("render", folder / "stage.usda", "-o", image, *OPTIONS, *AOVS, *RESUMING)
    kills = finished = 0
    for _ in range(KILLS):
        was_killed = kill_after(moments.uniform(0, render_seconds / 4), *arguments)
        kills += was_killed
        if not was_killed:
            assert_same_layers(folder / "whole.exr", image)
            image.unlink()
            finished += 1
    run = tyndall(*arguments)
    assert run.code == 0, run.text
    assert_same_layers(folder / "whole.exr", image)
    assert kills >= KILLS * 2 // 3, f"{kills} kills and {finished} finished renders"
    left = {path.name for path in tmp_path.iterdir() if not path.name.startswith(".tyndall-")}
    assert left == {"image.exr"}, "a finished render leaves no checkpoint"


def stopped(folder: Path, image: Path, *options: object) -> Path:
    """Interrupt a render and return its checkpoint."""
    arguments = ("render", folder / "stage.usda", "-o", image, *OPTIONS, "--checkpoint", "0.05", *AOVS)
    run = tyndall_interrupted(*arguments, *map(str, options), after=0.3)
    assert run.code == 130, run.text
    return image.with_name(image.name + ".checkpoint")


def resume(folder: Path, image: Path, *options: object) -> Run:
    arguments = ("render", folder / "stage.usda", "-o", image, *OPTIONS, *AOVS, *RESUMING)
    return tyndall(*arguments, *map(str, options))


def test_an_interrupted_render_goes_on(folder: Path, tmp_path: Path) -> None:
    checkpoint = stopped(folder, tmp_path / "image.exr")
    assert checkpoint.exists()
    run = resume(folder, tmp_path / "image.exr")
    assert run.code == 0, run.text
    assert "going on after" in run.err
    assert_same_layers(folder / "whole.exr", tmp_path / "image.exr")
    assert not checkpoint.exists()


def test_frames_that_were_stopped_are_not_skipped(folder: Path, tmp_path: Path) -> None:
    stopped(folder, tmp_path / "image.exr")
    assert resume(folder, tmp_path / "image.exr", "--skip-existing-frames").code == 0
    assert_same_layers(folder / "whole.exr", tmp_path / "image.exr")


def test_damaged_checkpoints_are_left_out(folder: Path, tmp_path: Path) -> None:
    checkpoint = stopped(folder, tmp_path / "image.exr")
    content = checkpoint.read_bytes()
    for damaged in (content[:-1], content[:1000], b"not a checkpoint at all"):
        checkpoint.write_bytes(damaged)
        run = resume(folder, tmp_path / "image.exr", "--strict")
        assert run.code == 3, run.text
        assert str(checkpoint) in run.err
        assert checkpoint.read_bytes() == damaged, "what cannot be used is left as it was"
    run = resume(folder, tmp_path / "image.exr")
    assert run.code == 0, run.text
    assert "the render begins anew" in run.err
    assert_same_layers(folder / "whole.exr", tmp_path / "image.exr")


def test_checkpoints_of_other_renders_are_left_out(folder: Path, tmp_path: Path) -> None:
    checkpoint = stopped(folder, tmp_path / "image.exr", "--seed", 3)
    assert resume(folder, tmp_path / "image.exr", "--strict").code == 3
    assert checkpoint.exists()
    run = resume(folder, tmp_path / "image.exr")
    assert run.code == 0, run.text
    assert "seed is 0 here and 3 there" in run.err, run.err
    assert_same_layers(folder / "whole.exr", tmp_path / "image.exr")


def test_more_samples_may_follow(folder: Path, tmp_path: Path) -> None:
    """Seconds, threads and samples do not change what a sample is."""
    image = tmp_path / "image.exr"
    limits = ("--spp", "99999", "--time", "0.2", "--threads", "1", "--checkpoint", "60")
    run = tyndall("render", folder / "stage.usda", "-o", image, *OPTIONS, *limits, *AOVS)
    assert run.code == 0, run.text
    assert (tmp_path / "image.exr.checkpoint").exists(), "the time limit came before the samples"
    assert "going on after" in resume(folder, image).err
    assert_same_layers(folder / "whole.exr", image)


def test_what_guides_had_learned_is_missed(folder: Path, tmp_path: Path) -> None:
    guided = ("--guiding", "on", "--spp", "64")
    stopped(folder, tmp_path / "image.exr", *guided, "--spp", 100_000)
    assert (
        "does not keep what guiding had learned"
        in resume(folder, tmp_path / "image.exr", *guided, "--strict").err
    )
    run = resume(folder, tmp_path / "image.exr", *guided)
    assert run.code == 0, run.text
    assert "does not keep what guiding had learned" in run.err


def test_a_checkpoint_that_cannot_be_written_is_reported(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "image.exr.checkpoint").mkdir()
    image = tmp_path / "image.exr"
    run = tyndall("render", folder / "stage.usda", "-o", image, *OPTIONS, "--checkpoint", "0.01")
    assert run.code == 1, run.text
    assert image.exists()
    assert "checkpoint" in run.err


def test_without_a_checkpoint_a_resumed_render_begins(folder: Path, tmp_path: Path) -> None:
    run = resume(folder, tmp_path / "image.exr", "--strict")
    assert run.code == 0, run.text
    assert_same_layers(folder / "whole.exr", tmp_path / "image.exr")

"""Renders that are killed and go on: the same bits in the end, and no trust in files that do not fit."""

from __future__ import annotations

import random
import subprocess
import time
from typing import TYPE_CHECKING, Any

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


def check_kills(
    stage: Path, whole: Path, image: Path, options: tuple[str, ...], *, kills: int, seconds: float
) -> None:
    """Kill a render again and again, each time after up to `seconds`; it must end like `whole`."""
    moments = random.Random(1)
    arguments = ("render", stage, "-o", image, *options, *AOVS, *RESUMING)
    n_killed = finished = 0
    for _ in range(kills):
        was_killed = kill_after(moments.uniform(0, seconds), *arguments)
        n_killed += was_killed
        if not was_killed:
            assert_same_layers(whole, image)
            image.unlink()
            finished += 1
    run = tyndall(*arguments)
    assert run.code == 0, run.text
    assert_same_layers(whole, image)
    assert n_killed >= kills * 2 // 3, f"{n_killed} kills and {finished} finished renders"
    left = {path.name for path in image.parent.iterdir() if not path.name.startswith(".tyndall-")}
    assert left == {image.name}, "a finished render leaves no checkpoint"


def test_killed_at_any_moment_the_image_is_the_same(folder: Path, tmp_path: Path) -> None:
    seconds = read_stats(folder / "stats.json")["seconds"]["render"] / 4
    whole, image = folder / "whole.exr", tmp_path / "image.exr"
    check_kills(folder / "stage.usda", whole, image, OPTIONS, kills=KILLS, seconds=seconds)


#: Both guides from the first pass on; and directions on trial, of which a small image is never sure.
GUIDED = {
    "on": ("--guiding", "on", "--distance-sampling", "odds"),
    "auto": ("--guiding", "auto", "--distance-sampling", "target"),
}


def check_guided_kills(
    tmp_path: Path, guiding: str, resolution: tuple[int, int], samples: str, kills: int
) -> dict[str, Any]:
    """Kill a guided render; return what its guides came to."""
    stage = foggy_room(*resolution).save(tmp_path / "stage.usda")
    options = ("--spp", samples, "--max-bounces", "6", *GUIDED[guiding])
    whole, stats = tmp_path / "whole.exr", tmp_path / "stats.json"
    run = tyndall("render", stage, "-o", whole, *options, *AOVS, "--stats", stats)
    assert run.code == 0, run.text
    seconds = read_stats(stats)["seconds"]["render"]
    folder = tmp_path / "killed"
    folder.mkdir()
    # Resumed renders end the sooner: most kills come early enough.
    check_kills(stage, whole, folder / "image.exr", options, kills=kills, seconds=1.5 * seconds / kills)
    return dict(read_stats(stats)["frames"][0]["statistics"]["guide"])


@pytest.mark.parametrize("guiding", GUIDED)
def test_killed_while_guides_learn_the_image_is_the_same(tmp_path: Path, guiding: str) -> None:
    guide = check_guided_kills(tmp_path, guiding, (16, 12), "256", kills=4)
    assert ("trial" in guide) == (guiding == "auto")


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("guiding", GUIDED)
def test_killed_often_while_guides_learn_the_image_is_the_same(tmp_path: Path, guiding: str) -> None:
    # Large enough for a trial to be sure of something.
    check_guided_kills(tmp_path, guiding, (80, 56), "192", kills=KILLS)


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


def test_guided_renders_that_are_interrupted_go_on(folder: Path, tmp_path: Path) -> None:
    options = ("--spp", "512", *GUIDED["on"])
    whole, image = tmp_path / "whole.exr", tmp_path / "image.exr"
    assert tyndall("render", folder / "stage.usda", "-o", whole, *OPTIONS, *options, *AOVS).code == 0
    stopped(folder, image, *options)
    run = resume(folder, image, "--strict", *options)
    assert run.code == 0, run.text
    assert_same_layers(whole, image)


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

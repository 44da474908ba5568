"""Exported jobs are run: by the reference runner of Open Job Description, and as SLURM would run a script."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import exr
from support.cli import command, tyndall
from support.stages import StageBuilder

FRAMES = (1, 2, 3)
OPTIONS = ("--max-bounces", "4", "-r", "16x12")
SPLIT = ("--spp", "64", "--splits", "2", "--", *OPTIONS, "--guiding", "off", "--distance-sampling", "delta")
GUIDED = ("--spp", "8", "--key-frames", "1,3", "--key-spp", "8", "--chunk", "2")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a space in its name, and a stage in it."""
    folder = tmp_path / "a shot"
    folder.mkdir()
    builder = StageBuilder(16, 12)
    builder.camera((0, 0, 6), (0, 0, 0), vfov=40)
    builder.quad((-2, -2, -2), (4, 0, 0), (0, 4, 0), builder.lambert(0.6))
    builder.box((-3, -3, -3), (3, 3, 3), builder.medium(0.3, 0.9))
    builder.sphere_light((1.0, 1.5, 0.5), 0.3, 5.0)
    builder.save(folder / "stage.usda")
    return folder


def export(folder: Path, kind: str, *options: str) -> Path:
    job = folder / f"job.{'json' if kind == 'openjd' else 'sh'}"
    output = folder / "image.####.exr"
    run = tyndall(
        *("job", "export", folder / "stage.usda", "-o", output, "-f", "1:3", "--format", kind, "--to", job),
        *options,
    )
    assert run.code == 0, run.text
    return job


def environment() -> dict[str, str]:
    return {**os.environ, "PATH": f"{command().parent}{os.pathsep}{os.environ['PATH']}"}


def run_openjd(job: Path) -> None:
    openjd = Path(sys.executable).parent / "openjd"
    for arguments in (["check", job], ["run", job]):
        done = subprocess.run(
            [openjd, *map(str, arguments)], capture_output=True, text=True, env=environment(), timeout=300
        )
        assert done.returncode == 0, done.stdout + done.stderr


def run_slurm(job: Path) -> None:
    """Put an `sbatch` on the path that runs at once what it is given, array task by array task."""
    assert subprocess.run(["bash", "-n", job]).returncode == 0
    tools = job.parent / "tools"
    tools.mkdir()
    sbatch = tools / "sbatch"
    sbatch.write_text(
        "#!/bin/bash\n"
        "set -e\n"
        "first=0 last=0\n"
        'while [[ "$1" == --* ]]; do\n'
        '    if [[ "$1" == --array=* ]]; then range=${1#--array=}; first=${range%-*} last=${range#*-}; fi\n'
        "    shift\n"
        "done\n"
        'for i in $(seq "$first" "$last"); do SLURM_ARRAY_TASK_ID=$i bash "$@" >&2; done\n'
        "echo 7\n"
    )
    sbatch.chmod(0o755)
    env = environment()
    env["PATH"] = f"{tools}{os.pathsep}{env['PATH']}"
    done = subprocess.run(["bash", job], capture_output=True, text=True, env=env, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


RUNNERS = {"openjd": run_openjd, "slurm": run_slurm}


@pytest.mark.parametrize("kind", RUNNERS)
def test_split_frames_have_the_bits_of_one_render(folder: Path, kind: str) -> None:
    RUNNERS[kind](export(folder, kind, *SPLIT))
    for frame in FRAMES:
        whole = folder / f"whole.{frame}.exr"
        plain = ("--spp", "64", "--guiding", "off", "--distance-sampling", "delta", *OPTIONS)
        assert tyndall("render", folder / "stage.usda", "-o", whole, "-f", frame, *plain).code == 0
        image = exr.read_layers(folder / f"image.{frame:04d}.exr")["rgba"]
        np.testing.assert_array_equal(image, exr.read_layers(whole)["rgba"])


@pytest.mark.parametrize("kind", RUNNERS)
def test_key_frames_teach_all_frames(folder: Path, kind: str) -> None:
    guided = ("--", *OPTIONS, "--guiding", "on", "--distance-sampling", "odds")
    RUNNERS[kind](export(folder, kind, *GUIDED, *guided))
    info = json.loads(tyndall("cache", "info", folder / "image.tyc", "--json").out)
    assert [frame["frame"] for frame in info["frames"]] == [1, 3]
    for frame in FRAMES:
        header = exr.read_header(folder / f"image.{frame:04d}.exr")
        assert str(header["tyndall:cache:status"]) == "hit"


def test_a_task_that_fails_fails_the_job(folder: Path) -> None:
    job = export(folder, "openjd", "--", "--camera", "nobody")
    openjd = Path(sys.executable).parent / "openjd"
    done = subprocess.run([openjd, "run", job], capture_output=True, text=True, env=environment(), timeout=60)
    assert done.returncode != 0
    assert "nobody" in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--splits", "2"), "--splits needs --spp"),
        (("--splits", "3", "--spp", "64"), "at most 2 parts"),
        (("-f", "1:5000", "--chunk", "1"), "farms take 1024"),
        (("-o", "image.exr"), "put #### in it"),
        (("--chunk", "0"), "at least 1"),
        (("-f", "1-3"), "--frames"),
    ],
)
def test_jobs_that_cannot_be(folder: Path, options: tuple[str, ...], message: str) -> None:
    output = folder / "image.####.exr"
    run = tyndall("job", "export", folder / "stage.usda", "-o", output, "-f", "1:3", *options)
    assert (run.code, message in run.err) == (2, True), run.text

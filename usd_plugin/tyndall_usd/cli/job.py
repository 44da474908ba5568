"""``tyndall job export``: the frames of a shot as a job for render farms.

Key frames teach a guiding cache each, the caches are merged, contiguous chunks of frames are rendered
with the frozen cache, and the sample splits of each frame are merged: four steps, of which a shot has
those it needs. They are described once (`plan_steps`) and written as an Open Job Description template
or a SLURM script.
"""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass, field
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyndall

from tyndall_usd.cli.exit_codes import ExitCode, UsageError
from tyndall_usd.cli.frames import has_placeholder, insert_frame, parse_frames
from tyndall_usd.cli.log import LOG

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

#: Values of a parameter that a template may list.
_MOST_TASKS = 1024


@dataclass(frozen=True, slots=True)
class Step:
    """Commands that may run side by side.

    Parameters
    ----------
    name : str
        A word.
    command : tuple of str
        Arguments of ``tyndall``; ``{Name}`` in them stands for a parameter.
    parameters : dict
        Values of each parameter, one a task.
    after : str, optional
        The step that must be complete before.
    """

    name: str
    command: tuple[str, ...]
    parameters: dict[str, list[str]] = field(default_factory=dict)
    after: str | None = None

    @property
    def n_tasks(self) -> int:
        """How many commands there are."""
        return max((len(values) for values in self.parameters.values()), default=1)

    def arguments(self, form: Callable[[str], str]) -> list[str]:
        """Return the command with parameters in the form that a format has for them."""
        return [_replaced(word, self.parameters, form) for word in self.command]

    def tasks(self) -> list[list[str]]:
        """Return the command of each task."""
        return [
            self.arguments(lambda name, task=task: self.parameters[name][task])  # type: ignore[misc]
            for task in range(self.n_tasks)
        ]


def run_job(options: argparse.Namespace) -> int:
    """Write the job that `options` ask for and return the exit code."""
    steps = plan_steps(options)
    crowded = [step for step in steps if step.n_tasks > _MOST_TASKS]
    if crowded:
        raise UsageError(
            f"the step {crowded[0].name} has {crowded[0].n_tasks} tasks, and farms take {_MOST_TASKS}; "
            "export ranges of --frames one by one, or larger chunks"
        )
    name = Path(options.input).stem
    text = {"openjd": _as_openjd, "slurm": _as_slurm}[options.format](name, steps)
    target = Path(options.to or f"{name}{_SUFFIXES[options.format]}")
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise tyndall.FileError(f"{target} cannot be written: {error.strerror}") from None
    LOG.info("%s: %s", target, ", ".join(f"{step.name} ({step.n_tasks})" for step in steps))
    return ExitCode.DONE


def plan_steps(options: argparse.Namespace) -> list[Step]:
    """Return the steps of a job, in their order.

    Raises
    ------
    UsageError
        Frames, splits and names do not go together.
    """
    frames = parse_frames(options.frames)
    output = str(Path(options.output).resolve())
    if len(frames) > 1 and not has_placeholder(Path(output).name):
        raise UsageError(f"{len(frames)} frames, but {output} has no place for the number; put #### in it")
    stage = Path(options.input).resolve()
    if not stage.exists():
        raise tyndall.FileError(f"{stage} does not exist")
    render = ("render", str(stage), *options.render_options)
    steps = _training(options, render, output) if options.key_frames else []
    cache = ("--cache", _cache_file(output), "--cache-mode", "read") if steps else ()
    after = steps[-1].name if steps else None
    chunks = [_as_range(chunk) for chunk in contiguous_chunks(frames, options.chunk)]
    spp = ("--spp", str(options.spp)) if options.spp else ()
    if options.splits == 1:
        command = (*render, *spp, *cache, "-o", output, "-f", "{Frames}")
        return [*steps, Step("Render", command, {"Frames": chunks}, after)]
    ranges = sample_splits(options.spp, options.splits)
    parameters = {
        "Frames": [chunk for chunk in chunks for _ in ranges],
        "Samples": ranges * len(chunks),
        "Part": [str(part) for part in range(len(ranges))] * len(chunks),
    }
    command = (*render, *spp, *cache, "--sample-range", "{Samples}", "-o", _part(output), "-f", "{Frames}")
    images = {"Image": [insert_frame(output, frame) for frame in frames]}
    return [
        *steps,
        Step("Render", command, parameters, after),
        Step("Merge", ("merge", *part_images("{Image}", len(ranges)), "-o", "{Image}"), images, "Render"),
    ]


def _training(options: argparse.Namespace, render: Sequence[str], output: str) -> list[Step]:
    keys = [f"{frame:g}" for frame in parse_frames(options.key_frames)]
    image, cache = _cache_file(output).removesuffix(".tyc") + ".{Key}.exr", _cache_file(output) + ".{Key}"
    command = (
        *render,
        *("--spp", str(options.key_spp), "--cache", cache, "--cache-mode", "train"),
        *("-o", image, "-f", "{Key}"),
    )
    caches = [cache.replace("{Key}", key) for key in keys]
    return [
        Step("Train", command, {"Key": keys}),
        Step("Caches", ("cache", "merge", *caches, "-o", _cache_file(output)), after="Train"),
    ]


def contiguous_chunks(frames: Sequence[float], size: int) -> list[list[float]]:
    """Return runs of at most `size` frames with one step between them."""
    chunks: list[list[float]] = []
    for frame in frames:
        last = chunks[-1] if chunks else []
        step = last[1] - last[0] if len(last) > 1 else None
        if last and len(last) < size and (step is None or abs(frame - last[-1] - step) < 1e-9):
            last.append(frame)
        else:
            chunks.append([frame])
    return chunks


def sample_splits(spp: int | None, splits: int) -> list[str]:
    """Return ranges that can be merged, as even as those are.

    Raises
    ------
    UsageError
        There are too few samples for so many.
    """
    grid = tyndall.sample_grid
    if spp is None:
        raise UsageError("--splits needs --spp: every part must know how many samples there are in all")
    if spp <= grid * (splits - 1):
        raise UsageError(f"--splits: {spp} samples make at most {-(-spp // grid)} parts of {grid} or more")
    blocks = -(-spp // grid)
    borders = [min(blocks * part // splits * grid, spp) for part in range(splits + 1)]
    return [f"{first}:{end}" for first, end in pairwise(borders)]


def _as_range(chunk: Sequence[float]) -> str:
    if len(chunk) == 1:
        return f"{chunk[0]:g}"
    return f"{chunk[0]:g}:{chunk[-1]:g}x{chunk[1] - chunk[0]:g}"


def _cache_file(output: str) -> str:
    """Return the merged cache, beside the images."""
    path = Path(output)
    return str(path.with_name(path.name.split(".")[0] + ".tyc"))


def part_images(image: str, splits: int) -> list[str]:
    """Return the images of the parts that `image` is merged of."""
    return [_part(image).replace("{Part}", str(part)) for part in range(splits)]


def _part(image: str) -> str:
    return image + ".part{Part}.exr"


def _replaced(word: str, names: dict[str, list[str]], form: Callable[[str], str]) -> str:
    for name in names:
        word = word.replace("{" + name + "}", form(name))
    return word


_SUFFIXES = {"openjd": ".openjd.json", "slurm": ".slurm.sh"}


def _as_openjd(name: str, steps: Sequence[Step]) -> str:
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        "name": name[:128],
        "parameterDefinitions": [
            {"name": "Tyndall", "type": "STRING", "default": "tyndall", "description": "The command."}
        ],
        "steps": [_openjd_step(step) for step in steps],
    }
    return json.dumps(template, indent=2) + "\n"


def _openjd_step(step: Step) -> dict[str, Any]:
    words = [word for word in chain(step.command, *step.parameters.values()) if "{{" in word]
    if words:
        raise UsageError(f"{words[0]!r}: a template would take '{{{{' for an expression; choose another name")
    arguments = step.arguments(lambda name: "{{Task.Param." + name + "}}")
    action = {"command": "{{Param.Tyndall}}", "args": arguments}
    described: dict[str, Any] = {"name": step.name, "script": {"actions": {"onRun": action}}}
    if step.after:
        described["dependencies"] = [{"dependsOn": step.after}]
    if step.parameters:
        definitions = [
            {"name": name, "type": "STRING", "range": values} for name, values in step.parameters.items()
        ]
        space: dict[str, Any] = {"taskParameterDefinitions": definitions}
        if len(definitions) > 1:
            space["combination"] = f"({', '.join(step.parameters)})"
        described["parameterSpace"] = space
    return described


_SLURM = """\
#!/bin/bash
# {name}: `bash` this file to submit it. Each job of it runs one step, each task of its array one command.
# Options for sbatch, such as a partition, are taken from SBATCH_OPTIONS.
set -euo pipefail
tyndall=${{TYNDALL:-tyndall}}
task=${{SLURM_ARRAY_TASK_ID:-0}}

case "${{1:-submit}}" in
submit)
{submission}
    ;;
{cases}
*)
    echo "$0: there is no step $1" >&2
    exit 2
    ;;
esac
"""


def _as_slurm(name: str, steps: Sequence[Step]) -> str:
    return _SLURM.format(
        name=name,
        submission="\n".join(_submission(step) for step in steps),
        cases="\n".join(_slurm_case(step) for step in steps),
    )


def _submission(step: Step) -> str:
    array = f" --array=0-{step.n_tasks - 1}" if step.parameters else ""
    after = f' --dependency="afterok:${step.after}"' if step.after else ""
    options = f"--parsable --job-name={step.name}{array}{after}"
    return f'    {step.name}=$(sbatch {options} ${{SBATCH_OPTIONS:-}} "$0" {step.name})'


def _slurm_case(step: Step) -> str:
    arrays = [f"    {name}=({shlex.join(values)})" for name, values in step.parameters.items()]
    marks = {name: f"\0{name}\0" for name in step.parameters}
    words = [shlex.quote(word) for word in step.arguments(marks.__getitem__)]
    for name, mark in marks.items():
        # Out of the single quotes of the word and in again.
        words = [word.replace(mark, f"'\"${{{name}[$task]}}\"'") for word in words]
    return "\n".join([f"{step.name})", *arrays, f'    "$tyndall" {" ".join(words)}', "    ;;"])

"""Measuring renderers: a ladder of sample counts for error against time, interleaved pairs for speed.

Seconds are CPU seconds; "a thread" means divided by the number of threads.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from support import exr
from support.shared import shared_root
from support.statistics import relative_mse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

# Mitsuba renders more samples than this in passes of this many.
PASS = 16
# A rung of the ladder has at most so many times the samples of the one before: further guesses are bad.
RUNG = 4
# Renders of a pair take about so long a thread (s).
PAIR_SECONDS = 1.5
PAIRS = 5


class WorkerError(RuntimeError):
    """A worker ended early."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """One render of a scene."""

    scene: str
    renderer: str
    spp: int
    cpu_seconds: float
    # Those after the scene was built, where the renderer tells.
    sampling_seconds: float
    wall_seconds: float
    relative_mse: float
    mean_ratio: float
    channel_ratios: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pairs:
    """Samples a second of two renderers, measured in turns, and their ratios."""

    scene: str
    peer: str
    ours: list[float]
    theirs: list[float]

    @property
    def ratios(self) -> list[float]:
        return [a / b for a, b in zip(self.ours, self.theirs, strict=True)]

    @property
    def median(self) -> float:
        return statistics.median(self.ratios)


class Worker:
    """A renderer with a scene, in a process of its own."""

    def __init__(
        self, scene: str, renderer: str, threads: int, out: Path, environment: dict[str, str]
    ) -> None:
        self.scene, self.renderer, self.threads, self.out = scene, renderer, threads, out
        file = shared_root() / "cases" / "scenes" / f"{scene}.json"
        command = [sys.executable, Path(__file__).with_name("worker.py"), renderer, file, out]
        self._log = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115, for later
        self._process = subprocess.Popen(
            [*map(str, command), "--threads", str(threads)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            env=environment,
        )
        self._seed = 0

    def __enter__(self) -> Self:
        try:
            self._answer()
        except WorkerError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait()
        self._log.close()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            code = self._process.wait()
            self._log.seek(0)
            raise WorkerError(
                f"{self.scene} with {self.renderer} ended ({code}):\n{self._log.read()[-2000:]}"
            )
        return json.loads(line)

    def render(self, spp: int) -> dict[str, Any]:
        """Render with a new seed; return spp, the seconds of a Measurement and the image's file."""
        assert self._process.stdin is not None
        self._seed += 1
        self._process.stdin.write(json.dumps({"spp": spp, "seed": self._seed}) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def measure(self, spp: int) -> Measurement:
        """Render and compare with the reference."""
        result = self.render(spp)
        image = np.load(self.out / result.pop("image")).astype(np.float64)
        reference, error = _reference(self.scene)
        channels = image.mean(axis=(0, 1)) / reference.mean(axis=(0, 1))
        return Measurement(
            scene=self.scene,
            renderer=self.renderer,
            relative_mse=relative_mse(image, reference, error),
            mean_ratio=float(image.mean() / reference.mean()),
            channel_ratios=tuple(channels.tolist()),
            **result,
        )


@cache
def _reference(scene: str) -> tuple[np.ndarray, float]:
    """Return the converged image of a scene and the relMSE left in it."""
    folder = shared_root() / "cases" / "references"
    stated = json.loads((folder / "references.json").read_text(encoding="utf-8"))[scene]
    return exr.read_rgb(folder / f"{scene}.exr").astype(np.float64), stated["relMSE_of_reference"]


def samples_for(seconds: float, measured: Sequence[tuple[int, float]]) -> int:
    """Return how many samples take about so many seconds.

    From the last two of the measured (samples, seconds) by a straight line, since some renderers have a cost
    a render; the nearest multiple of PASS above it.
    """
    spp, time = measured[-1]
    slope = time / spp
    if len(measured) > 1 and time > measured[-2][1]:
        slope = (time - measured[-2][1]) / (spp - measured[-2][0])
    return _whole(max(1, round(spp + (seconds - time) / slope)))


def _whole(spp: int) -> int:
    """Return the nearest count that everyone renders."""
    return spp if spp < PASS else PASS * round(spp / PASS)


def ladder(measure: Callable[[int], Measurement], threads: int, times: Sequence[float]) -> list[Measurement]:
    """Render with 1, 4, 16 ... samples and then so many that each of the times (s a thread) is met."""
    # Two at least, to know what a render costs before its first sample.
    found = [measure(1), measure(RUNG)]
    for seconds in sorted(times):
        is_far = True
        while is_far:
            wanted = samples_for(seconds, [(m.spp, m.cpu_seconds / threads) for m in found])
            rung = RUNG * found[-1].spp
            is_far = wanted > rung
            if wanted > found[-1].spp:
                found.append(measure(_whole(min(wanted, rung))))
    return found


def samples_per_second(measurements: Sequence[Measurement], threads: int) -> float:
    """Return samples a pixel in a second of CPU time a thread, from the longest render."""
    longest = max(measurements, key=lambda m: m.cpu_seconds)
    return longest.spp / (longest.sampling_seconds / threads)


def error_at(measurements: Sequence[Measurement], threads: int, seconds: float) -> float:
    """Return the error at a time by interpolating between the neighbouring renders in log-log.

    NaN before the first render; beyond the last one noise falls as one over time.
    """
    points = sorted((m.cpu_seconds / threads, m.relative_mse) for m in measurements if m.relative_mse > 0)
    for (t0, e0), (t1, e1) in itertools.pairwise(points):
        if t0 <= seconds <= t1:
            share = math.log(seconds / t0) / math.log(t1 / t0)
            return math.exp(math.log(e0) * (1 - share) + math.log(e1) * share)
    if points and seconds > points[-1][0]:
        return points[-1][1] * points[-1][0] / seconds
    return math.nan


def alternate(ours: Worker, theirs: Worker, rates: dict[str, float], count: int = PAIRS) -> Pairs:
    """Render in turns, first one first and then the other, so that what else the machine does meets both.

    `rates` are samples a second a thread, to choose renders of equal length by.
    """
    workers = (ours, theirs)
    spp = {w.renderer: samples_for(PAIR_SECONDS, [(PASS, PASS / rates[w.renderer])]) for w in workers}
    speeds: dict[str, list[float]] = {w.renderer: [] for w in workers}
    for turn in range(count):
        for worker in workers if turn % 2 == 0 else reversed(workers):
            done = worker.render(spp[worker.renderer])
            speeds[worker.renderer].append(done["spp"] / (done["sampling_seconds"] / worker.threads))
    return Pairs(ours.scene, theirs.renderer, speeds[ours.renderer], speeds[theirs.renderer])

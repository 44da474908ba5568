"""What a shot does not use costs nothing: pairs that differ in one unused thing, each with a ratio.

Instructions are counted by Valgrind's callgrind, since seconds are too noisy to see two per cent. Each count
is the difference of two renders with other sample counts, so that start-up and the building of the world drop
out. The scenes are in `crates/tyndall-render/benches/lean.rs`.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from support.shared import REPO

# Samples a pixel of the two renders whose instructions are subtracted.
FEW, MANY = 1, 5
# Repeats of what is measured in seconds.
REPEATS = 5
GRID_FILES = ("density.vdb", "all.vdb")


@dataclass(frozen=True, slots=True)
class Check:
    """One unused thing: a figure without it and with it; the ratio says what it costs."""

    unused: str
    measured: str
    without: float
    with_it: float

    @property
    def ratio(self) -> float:
        if self.without == self.with_it:
            return 1.0
        return self.with_it / self.without if self.without else math.inf


def row(check: Check) -> list[str]:
    """Return a check as cells of a table."""
    figures = [f"{figure:.6g}" for figure in (check.without, check.with_it)]
    return [check.unused, check.measured, *figures, f"{check.ratio:.3f}"]


def measure() -> list[Check]:
    """Return all checks that this machine can make."""
    checks = [*_look_ups(), *_unbound_grids()]
    if shutil.which("valgrind") is None:
        sys.stderr.write("no valgrind (on Debian: apt-get install valgrind): no instructions are counted\n")
        return checks
    return [*_instructions(), *checks]


@cache
def _executable(*features: str) -> str:
    """Compile the scenes with features of `tyndall-render`; return the program."""
    command = ["cargo", "bench", "--no-run", "--package", "tyndall-render", "--bench", "lean"]
    if features:
        command += ["--features", ",".join(features)]
    done = subprocess.run(
        [*command, "--message-format", "json"], cwd=REPO, check=True, stdout=subprocess.PIPE, text=True
    )
    messages = (json.loads(line) for line in done.stdout.splitlines() if line.startswith("{"))
    return [message["executable"] for message in messages if message.get("executable")][-1]


def _statistics(case: str, *features: str) -> dict[str, Any]:
    """Return the counts of what the paths of a case did."""
    done = subprocess.run(
        [_executable(*features), case, str(MANY)], check=True, capture_output=True, text=True
    )
    return json.loads(done.stdout)


@cache
def _count(case: str, *features: str) -> float:
    """Return instructions a path."""
    collected = []
    for samples in (FEW, MANY):
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
        command += [_executable(*features), case, str(samples)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found = re.search(r"Collected\s*:\s*(\d+)", done.stderr)
        assert found, done.stderr
        collected.append(int(found[1]))
    paths = _statistics(case, *features)["paths"] * (MANY - FEW) / MANY
    return (collected[1] - collected[0]) / paths


def _instructions() -> list[Check]:
    """Return what is compared by instructions."""
    unit = "instructions a path"
    surfaces, grey = _count("surfaces"), _count("grey_fog")
    return [
        Check(
            "media, in a scene without",
            f"{unit}; compiled out or in",
            _count("surfaces", "without-media"),
            surfaces,
        ),
        Check("a medium that no ray meets", unit, surfaces, _count("far_medium")),
        Check("colour, in grey fog", f"{unit}; coloured fog or grey", _count("coloured_fog"), grey),
        Check("90 % empty bricks", unit, _count("tight_grid"), _count("padded_grid")),
    ]


def _look_ups() -> list[Check]:
    """Return what is compared by look-ups of voxels."""
    unit = "voxel look-ups a path"

    def of(case: str) -> float:
        done = _statistics(case)
        return done["lookups"] / done["paths"]

    return [
        Check("grids, in homogeneous fog", unit, 0.0, of("grey_fog")),
        Check("90 % empty bricks", unit, of("tight_grid"), of("padded_grid")),
    ]


def _unbound_grids() -> list[Check]:
    """Return what grids cost that lie in the file of a bound one: bytes and CPU seconds of loading."""
    worker = Path(__file__).with_name("lean_grids.py")
    with tempfile.TemporaryDirectory() as folder:
        files = [f"{folder}/{name}" for name in GRID_FILES]
        wrote = subprocess.run(
            [sys.executable, worker, "write", *files], check=False, capture_output=True, text=True
        )
        if wrote.returncode != 0:
            sys.stderr.write(f"unbound grids are not measured: {wrote.stderr.strip().splitlines()[-1:]}\n")
            return []
        loaded: dict[str, list[dict[str, float]]] = {file: [] for file in files}
        for _ in range(REPEATS):
            for file in files:
                done = subprocess.run(
                    [sys.executable, worker, "load", file], check=True, stdout=subprocess.PIPE
                )
                loaded[file].append(json.loads(done.stdout))
        sizes = [float(Path(file).stat().st_size) for file in files]
    checks = [Check("temperature and velocity in the file", "bytes of the file", *sizes)]
    for key, unit in (("bytes", "bytes read"), ("cpu_seconds", "CPU s to load")):
        medians = [statistics.median(run[key] for run in loaded[file]) for file in files]
        checks.append(Check("temperature and velocity in the file", unit, *medians))
    return checks

"""Absurd input: every case ends in time with finite, non-negative pixels, and where the answer is known, with
it.

The cases and what a trustworthy renderer does with them come with the shared data
(`cases/stress/expect.json`).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pxr import Gf, Usd
from support import exr
from support.cli import Run, read_stats, tyndall
from support.shared import shared, shared_root
from support.stages import max_scatter

if TYPE_CHECKING:
    from pathlib import Path

SECONDS = 20
SAMPLES = 64
# One pixel of standard deviation 0.22 a sample: two per cent is less than one standard error of 64 samples.
MORE_SAMPLES = {"image_1x1": 4096}


def listed_cases() -> list[dict[str, Any]]:
    """Return the cases that come with a stage."""
    folder = shared_root() / "cases" / "stress"
    table = folder / "expect.json"
    if not table.exists():
        return []
    cases = json.loads(table.read_text(encoding="utf-8"))
    return [case for case in cases if (folder / f"{case['id']}.usda").exists()]


CASES = listed_cases()
# The case's numbers are rounded to seven digits, which at 1e6 changes its box and camera by 0.3 and 0.5: its
# twin is itself, moved back, and not the case at the origin.
MOVED_BACK = {"offset_1e+06_moved_back": "offset_1e+06"}
TWINS = {"offset_1e+06": "offset_1e+06_moved_back"}
OFFSET = Gf.Vec3d(1e6, 0, 1e6)


@dataclass(frozen=True, slots=True)
class Result:
    """A finished render of a case."""

    run: Run
    rgb: np.ndarray | None
    diagnostics: list[Any]


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stress")


@cache
def render(case: str, folder: Path) -> Result:
    """Render a case once, whoever asks for it."""
    if case in MOVED_BACK:
        stage = moved(shared("cases", "stress", f"{MOVED_BACK[case]}.usda"), folder / f"{case}.usda")
    else:
        stage = shared("cases", "stress", f"{case}.usda")
    image, stats = folder / f"{case}.exr", folder / f"{case}.json"
    run = tyndall(
        *("render", stage, "-o", image, "--stats", stats),
        *(
            "--spp",
            MORE_SAMPLES.get(case, SAMPLES),
            "--max-bounces",
            max_scatter(stage),
            "--filter",
            "box",
            "--seed",
            1,
        ),
        *("--progress", "none"),
        timeout=SECONDS,
    )
    rgb = exr.read_rgb(image).astype(np.float64) if image.exists() else None
    diagnostics = read_stats(stats).get("diagnostics", []) if stats.exists() else []
    return Result(run, rgb, diagnostics)


def moved(stage: Path, to: Path) -> Path:
    """Write a copy of a stage with everything moved by -OFFSET."""
    copy = Usd.Stage.Open(Usd.Stage.Open(str(stage)).Flatten())
    for prim in copy.Traverse():
        transform = prim.GetAttribute("xformOp:transform")
        if transform:
            matrix = transform.Get()
            transform.Set(matrix.SetTranslateOnly(matrix.ExtractTranslation() - OFFSET))
    copy.GetRootLayer().Export(str(to))
    return to


def test_the_cases_are_there() -> None:
    shared("cases", "stress", "expect.json")
    assert len(CASES) >= 70


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_case(case: dict[str, Any], folder: Path) -> None:
    result = render(case["id"], folder)
    check, *arguments = case["check"].split()
    told = f"{case['what']}; expected: {case['expect']}\n{result.run.text}"

    if check == "report":
        assert result.diagnostics or result.run.err.strip(), f"nothing was said: {told}"
        if result.run.code != 0:
            assert result.rgb is None, f"a clean error leaves no image: {told}"
            return
    assert result.run.code == 0, told
    assert result.rgb is not None, told
    assert np.isfinite(result.rgb).all(), f"NaN or Inf: {told}"
    assert (result.rgb >= 0).all(), f"negative: {told}"

    mean = result.rgb.mean(axis=(0, 1))
    match check:
        case "const":
            value, tolerance = map(float, arguments)
            assert mean == pytest.approx(np.full(3, value), rel=tolerance), told
        case "same":
            other, tolerance = TWINS.get(case["id"], arguments[0]), float(arguments[1])
            twin = render(other, folder).rgb
            assert twin is not None
            assert mean == pytest.approx(twin.mean(axis=(0, 1)), rel=tolerance), told
        case "zero":
            assert result.rgb.max() == 0, told
        case "finite" | "time" | "report":
            pass
        case _:
            pytest.fail(f"unknown check {case['check']!r}")

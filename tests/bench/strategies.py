"""How the distance to the next scattering is sampled: all strategies at equal time, within this renderer.

All of them guide directions, so that only the distances differ (as in the table of Xu et al. 2024): the
paper's are "nds", "nds+" and "target"; "delta" samples by transmittance, "odds" is ours.
"""

from __future__ import annotations

import math
import statistics
import sys
from typing import TYPE_CHECKING

from measure import Measurement, Worker, error_at, ladder

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

#: Names of the workers' renderers; gains are over the first, the last is what renders do by default.
RENDERERS = ("tyndall-delta", "tyndall-nds", "tyndall-nds+", "tyndall-target", "tyndall-odds", "tyndall")


def measure(
    scenes: Sequence[str], threads: int, seconds: Sequence[float], out: Path, environment: dict[str, str]
) -> list[Measurement]:
    """Render every scene with every strategy, for as long as the last of `seconds`."""
    found = []
    for scene in scenes:
        for renderer in RENDERERS:
            with Worker(scene, renderer, threads, out, environment) as worker:
                found += ladder(worker.measure, threads, seconds)
            sys.stderr.write(f"{scene} {renderer}: done\n")
    return found


def summary(measurements: list[Measurement], threads: int, seconds: float) -> list[list[str]]:
    """Return the rows of a table: relMSE after so many seconds, and the first's over it."""
    rows = [["scene", *RENDERERS]]
    gains: dict[str, list[float]] = {renderer: [] for renderer in RENDERERS}
    for scene in dict.fromkeys(m.scene for m in measurements):
        of = {r: [m for m in measurements if (m.scene, m.renderer) == (scene, r)] for r in RENDERERS}
        errors = {r: error_at(of[r], threads, seconds) for r in RENDERERS}
        for renderer, error in errors.items():
            gains[renderer].append(errors[RENDERERS[0]] / error)
        rows.append([scene, *(f"{errors[r]:.4g} ({gains[r][-1]:.2f})" for r in RENDERERS)])
    known = {r: [g for g in gains[r] if not math.isnan(g)] for r in RENDERERS}
    means = (f"{statistics.geometric_mean(known[r]):.2f}" if known[r] else "-" for r in RENDERERS)
    return [*rows, ["gain (geometric mean)", *means]]

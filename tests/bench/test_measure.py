"""Which renders the benchmark chooses, and what it reads from them."""

from __future__ import annotations

import math

import pytest
from bench.measure import Measurement, error_at, ladder, samples_for

THREADS = 2


def renderer(setup: float, per_sample: float):
    """Return `measure` of a renderer with a cost a render and one a sample (s a thread); noise is 1/spp."""

    def measure(spp: int) -> Measurement:
        cpu = THREADS * (setup + per_sample * spp)
        return Measurement("scene", "renderer", spp, cpu, cpu, cpu, 1 / spp, 1.0, (1.0, 1.0, 1.0))

    return measure


@pytest.mark.parametrize(
    ("setup", "per_sample", "expected"),
    [
        (0.0, 0.1, [1, 4, 16, 32, 96]),  # 40 and 100 are no multiples of 16
        (3.0, 0.5, [1, 4, 14]),  # at 4 s it has no time for more than it had taken already
        (20.0, 5.0, [1, 4]),  # even one sample is too slow, but two renders there must be
    ],
)
def test_the_ladder_meets_the_times(setup: float, per_sample: float, expected: list[int]) -> None:
    rungs = ladder(renderer(setup, per_sample), THREADS, [10.0, 4.0])
    assert [m.spp for m in rungs] == expected


def test_a_cost_a_render_is_not_taken_for_one_of_its_samples() -> None:
    assert samples_for(10.0, [(1, 3.5), (4, 5.0)]) == 14
    assert samples_for(10.0, [(4, 5.0)]) == 8


def test_errors_between_before_and_after_the_renders() -> None:
    rungs = [renderer(0.0, 0.1)(spp) for spp in (10, 40)]
    assert error_at(rungs, THREADS, 2.0) == pytest.approx(1 / 20)
    assert error_at(rungs, THREADS, 8.0) == pytest.approx(1 / 80)
    assert math.isnan(error_at(rungs, THREADS, 0.5))

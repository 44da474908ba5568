"""Each UsdLux light above a white card: the formulas of the schema's text, in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.oracles import judge
from support.render import Shot
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

ALBEDO = 0.8
UP = 2.0  # height of the lights above the card


def rect_factor(width: float, height: float, distance: float) -> float:
    """Return the form factor from a point to a parallel rectangle centred above it."""
    a, b = width / 2 / distance, height / 2 / distance
    ra, rb = math.hypot(1, a), math.hypot(1, b)
    quarter = (a / ra * math.atan(b / ra) + b / rb * math.atan(a / rb)) / (2 * math.pi)
    return 4 * quarter


def tilted(angle_degrees: float) -> tuple[float, float, float]:
    """Return a direction of travel that meets the card at this angle to its normal."""
    angle = math.radians(angle_degrees)
    return (math.sin(angle), -math.cos(angle), 0.0)


# Name: how to add the light, and the irradiance on the card.
Case = tuple[Callable[[StageBuilder], object], float]
CASES: dict[str, Case] = {
    "distant_parallel": (lambda s: s.distant(tilted(60), 3.0), 3.0 * 0.5),
    "distant_sun_normalized": (
        lambda s: s.distant(tilted(0), 3.0, angle=10.0),
        3.0,
    ),
    "distant_sun_radiance": (
        lambda s: s.distant(tilted(0), 3.0, angle=10.0, normalize=False),
        3.0 * math.pi * math.sin(math.radians(5)) ** 2,
    ),
    "dome": (lambda s: s.dome(0.7), 0.7 * math.pi),
    "point": (lambda s: s.point((0, UP, 0), 5.0), 5.0 / UP**2),
    "point_off_axis": (lambda s: s.point((UP, UP, 0), 5.0), 5.0 / (2 * UP**2) * math.sqrt(0.5)),
    "sphere": (lambda s: s.sphere_light((0, UP, 0), 0.5, 4.0), 4.0 * math.pi * (0.5 / UP) ** 2),
    "sphere_off_axis": (
        lambda s: s.sphere_light((UP, UP, 0), 0.5, 4.0),
        4.0 * math.pi * 0.25 / (2 * UP**2) * math.sqrt(0.5),
    ),
    "sphere_normalized": (
        lambda s: s.sphere_light((0, UP, 0), 0.5, 4.0, normalize=True),
        4.0 / (4 * UP**2),
    ),
    "sphere_exposed": (
        lambda s: s.sphere_light((0, UP, 0), 0.5, 4.0, exposure=-2.0),
        math.pi * (0.5 / UP) ** 2,
    ),
    "rect": (
        lambda s: s.rect_light((0, UP, 0), (0, 0, 0), 1.5, 0.8, 6.0),
        6.0 * math.pi * rect_factor(1.5, 0.8, UP),
    ),
    "rect_normalized": (
        lambda s: s.rect_light((0, UP, 0), (0, 0, 0), 1.5, 0.8, 6.0, normalize=True),
        6.0 / (1.5 * 0.8) * math.pi * rect_factor(1.5, 0.8, UP),
    ),
    "rect_scaled": (
        lambda s: s.rect_light((0, UP, 0), (0, 0, 0), 1.5, 0.8, 6.0, scale=2.0),
        6.0 * math.pi * rect_factor(3.0, 1.6, UP),
    ),
    "rect_scaled_normalized": (
        lambda s: s.rect_light((0, UP, 0), (0, 0, 0), 1.5, 0.8, 6.0, scale=2.0, normalize=True),
        6.0 / (3.0 * 1.6) * math.pi * rect_factor(3.0, 1.6, UP),
    ),
    "rect_facing_away": (lambda s: s.rect_light((0, UP, 0), (0, 2 * UP, 0), 1.5, 0.8, 6.0), 0.0),
    "disk": (
        lambda s: s.disk_light((0, UP, 0), (0, 0, 0), 0.7, 6.0),
        6.0 * math.pi * 0.7**2 / (0.7**2 + UP**2),
    ),
    "disk_normalized": (
        lambda s: s.disk_light((0, UP, 0), (0, 0, 0), 0.7, 6.0, normalize=True),
        6.0 / (0.7**2 + UP**2),
    ),
}


@pytest.mark.parametrize("color", [(1.0, 1.0, 1.0), (1.0, 0.5, 0.25)], ids=["white", "coloured"])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_irradiance_on_a_card(tmp_path: Path, case: Case, color: tuple[float, float, float]) -> None:
    add_light, irradiance = case
    stage = StageBuilder()
    stage.camera((0.5, 1.0, 0.8), (0, 0, 0), vfov=0.02)
    card = stage.lambert(np.multiply(ALBEDO, color))
    stage.quad((-0.1, 0, 0.1), (0.2, 0, 0), (0, 0, -0.2), card)
    add_light(stage)
    judge(
        Shot(stage, tmp_path).seeds(4, spp=1024, max_bounces=1),
        np.multiply(ALBEDO / math.pi * irradiance, color),
    )


def test_lights_are_seen_at_their_radiance(tmp_path: Path) -> None:
    stage = StageBuilder()
    stage.camera((0, 0, 3), (0, 0, 0), vfov=1.0)
    stage.sphere_light((0, 0, 0), 0.5, 4.0, color=(1.0, 0.5, 0.25))
    judge(Shot(stage, tmp_path).seeds(4, spp=64, max_bounces=0), np.multiply(4.0, (1.0, 0.5, 0.25)))

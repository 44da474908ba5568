"""Nine calibration stages and five scenes against converged references: see README.md beside this file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support import exr, pictures
from support.render import Shot
from support.shared import TESTS, shared
from support.stages import max_scatter
from support.statistics import estimate, pixel_independence, reference_mean_error, squared_difference

if TYPE_CHECKING:
    from pathlib import Path

CALIBRATION = TESTS / "scenes" / "calib"
# Independent seeds and samples a pixel of each.
CALIBRATION_SAMPLES = dict.fromkeys(
    ("chromatic", "depth1", "depth3", "env", "grid", "phase", "point_fog", "rect", "sphere"), (8, 256)
)
SCENE_SAMPLES = {
    "cloud": (4, 16),
    "jungle": (4, 32),
    "kitchen": (4, 32),
    "landscape": (4, 16),
    "underwater": (4, 32),
}


@dataclass(frozen=True, slots=True)
class Reference:
    """A converged image and what is said about its error."""

    image: np.ndarray
    stated: dict[str, Any]

    @property
    def relative_squared_error(self) -> float:
        return float(self.stated["relMSE_of_reference"])

    def halves_error(self) -> np.ndarray:
        """How far each half's channel mean lies from the merged mean."""
        ratio = np.asarray(self.stated["halves_mean_ratio"])
        return np.abs(ratio - 1) / 2 * self.image.mean(axis=(0, 1))

    def mean_error(self) -> np.ndarray:
        return reference_mean_error(self.image, self.relative_squared_error)


def load_reference(folder: Path, name: str) -> Reference:
    stated = json.loads((folder / "references.json").read_text(encoding="utf-8"))[name]
    image = exr.read_rgb(folder / f"{name}.exr").astype(np.float64)
    return Reference(image, stated)


def compare(name: str, stage: Path, reference: Reference, seeds: int, spp: int) -> None:
    images = Shot(stage).seeds(seeds, spp=spp, max_bounces=max_scatter(stage))
    assert images.shape[1:] == reference.image.shape

    found = estimate(images)
    expected = reference.image.mean(axis=(0, 1))
    error = np.hypot(found.error, reference.mean_error())
    deviation = np.abs(found.mean - expected)
    excess = (deviation - reference.halves_error()) / error
    difference = squared_difference(images, reference.image)
    limit = 2 * reference.relative_squared_error
    independence = pixel_independence(images)
    text = (
        f"{name}: mean/reference {np.round(found.mean / expected, 5)}, beyond the stated error by "
        f"{np.round(excess, 2)} standard errors of {np.round(error / expected, 6)}; "
        f"squared difference {difference.value:.2e} +- {difference.error:.1e}, limit {limit:.2e}; "
        f"independence p {independence:.2g}"
    )
    pictures.note(text)
    right_mean = (excess <= 3).all()
    right_picture = difference.value <= limit + 3 * difference.error
    if not (right_mean and right_picture):
        text += f"; pictures in {pictures.save_failure(name, images.mean(axis=0), reference.image)}"
    assert right_mean, text
    assert right_picture, text
    assert independence > 1e-6, f"pixels are not independent, so standard errors are too small: {text}"


@pytest.mark.parametrize("name", CALIBRATION_SAMPLES)
def test_calibration(name: str) -> None:
    reference = load_reference(CALIBRATION / "references", name)
    compare(name, CALIBRATION / f"{name}.usda", reference, *CALIBRATION_SAMPLES[name])


@pytest.mark.parametrize("name", SCENE_SAMPLES)
def test_scene(name: str) -> None:
    stage = shared("cases", "scenes", f"{name}.usda")
    reference = load_reference(shared("cases", "references"), name)
    compare(name, stage, reference, *SCENE_SAMPLES[name])

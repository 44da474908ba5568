"""Pictures a failing test leaves behind."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from PIL import Image

from support.shared import OUT

if TYPE_CHECKING:
    from pathlib import Path


# Measured figures of the whole run, also of tests that pass.
FIGURES = OUT / "figures.txt"


def _png(path: Path, rgb: npt.NDArray[np.float64]) -> None:
    encoded = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * np.maximum(rgb, 0.0031308) ** (1 / 2.4) - 0.055)
    Image.fromarray((np.clip(encoded, 0, 1) * 255 + 0.5).astype(np.uint8)).save(path)


def save_failure(name: str, image: npt.ArrayLike, reference: npt.ArrayLike) -> Path:
    """Write image, reference and their difference (grey is equal, red brighter, blue darker) as PNG."""
    folder = OUT / name
    folder.mkdir(parents=True, exist_ok=True)
    image = np.nan_to_num(np.asarray(image, np.float64))
    reference = np.asarray(reference, np.float64)
    exposure = 0.8 / max(float(np.percentile(reference, 98)), 1e-12)
    _png(folder / "image.png", image * exposure)
    _png(folder / "reference.png", reference * exposure)
    relative = ((image - reference) / np.sqrt(reference**2 + 0.01)).mean(axis=-1)
    warm, cold = np.clip(relative / 0.2, 0, 1), np.clip(-relative / 0.2, 0, 1)
    grey = np.full_like(relative, 0.5)
    _png(
        folder / "difference.png",
        np.stack([grey + warm / 2, grey - (warm + cold) / 2, grey + cold / 2], axis=-1),
    )
    np.savez_compressed(folder / "arrays.npz", image=image, reference=reference)
    return folder


def note(text: str) -> None:
    """Add a line to the log of measured figures, out/tests/figures.txt; also shown by pytest on failure."""
    OUT.mkdir(parents=True, exist_ok=True)
    with FIGURES.open("a", encoding="utf-8") as file:
        file.write(text + "\n")
    sys.stdout.write(text + "\n")

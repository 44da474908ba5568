"""The regions of the field, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import tyndall

    from tyndall_usd.cli.inspect.view import Array

Indices: TypeAlias = npt.NDArray[np.int64]
Vertices: TypeAlias = Literal["surface", "volume"]
#: Of the samples, this share lies outside the extent that is drawn, on either side.
_OUTSIDE = 0.01


@dataclass(frozen=True, slots=True)
class Cells:
    """One entry a region: its box, what it has learned, and where."""

    lower: Array  #: (n, 3), infinite for outermost boxes
    upper: Array
    pivot: Array
    samples: Array
    fluence: Array
    flow: Array  #: (n, 3): mean direction light comes from; shorter the more evenly it comes from everywhere

    @classmethod
    def of(cls, field: tyndall.Field, vertices: Vertices) -> Cells:
        """Read the regions of vertices in media or on surfaces."""
        cells = field.cells(vertices)

        def corners(name: str, missing: float) -> Array:
            rows = [[missing if v is None else v for v in cell[name]] for cell in cells]
            return np.array(rows, dtype=np.float64).reshape(-1, 3)

        def column(name: str) -> Array:
            return np.array([cell[name] for cell in cells], dtype=np.float64)

        return cls(
            lower=corners("min", -np.inf),
            upper=corners("max", np.inf),
            pivot=column("pivot").reshape(-1, 3),
            samples=column("samples"),
            fluence=column("fluence"),
            flow=np.array([_flow(cell["lobes"]) for cell in cells]).reshape(-1, 3),
        )

    def __len__(self) -> int:
        return len(self.samples)

    def extent(self) -> tuple[Array, Array]:
        """Return the box in which nearly all samples lie."""
        lower, upper = np.empty(3), np.empty(3)
        for axis in range(3):
            order = np.argsort(self.pivot[:, axis])
            share = np.cumsum(self.samples[order]) / max(self.samples.sum(), 1e-30)
            inner = self.pivot[order, axis]
            lower[axis] = inner[np.searchsorted(share, _OUTSIDE).clip(0, len(inner) - 1)]
            upper[axis] = inner[np.searchsorted(share, 1.0 - _OUTSIDE).clip(0, len(inner) - 1)]
        margin = 0.05 * max(float((upper - lower).max()), 1e-30)
        return lower - margin, upper + margin

    def cut(self, axis: int, at: float) -> Indices:
        """Return the numbers of the cells that a plane across `axis` cuts."""
        return np.flatnonzero((self.lower[:, axis] <= at) & (at < self.upper[:, axis]))

    def at(self, points: Array) -> Indices:
        """Return the cell of each point, shape (..., 3); -1 where a coordinate is not finite."""
        found = np.full(points.shape[:-1], -1, dtype=np.int64)
        for number, (lower, upper) in enumerate(zip(self.lower, self.upper, strict=True)):
            found[((lower <= points) & (points < upper)).all(axis=-1)] = number
        found[~np.isfinite(points).all(axis=-1)] = -1
        return found


def _flow(lobes: list[dict[str, Any]]) -> Array:
    """Return the mean direction of a mixture: each lobe's is its own times coth(kappa) - 1/kappa."""
    total = np.zeros(3)
    for lobe in lobes:
        kappa = max(lobe["kappa"], 1e-4)
        mean_cosine = kappa / 3.0 if kappa < 1e-2 else 1.0 / np.tanh(kappa) - 1.0 / kappa
        total += lobe["weight"] * mean_cosine * np.array(lobe["mean"])
    return total

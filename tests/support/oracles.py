"""The table of ground truths, and the one way a render is held against it."""

from __future__ import annotations

import json
import os
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import special

from support.pictures import note
from support.shared import TESTS
from support.statistics import estimate

# A right renderer fails one judgement in 16 000; with fixed seeds it either does or does not.
LARGEST_Z = 4.0


@cache
def table() -> dict[str, Any]:
    """Return `oracles.json`: plain numbers from closed forms and quadratures."""
    data: dict[str, Any] = json.loads((TESTS / "oracles" / "oracles.json").read_text(encoding="utf-8"))
    return data


def judge(
    images: npt.ArrayLike,
    expected: npt.ArrayLike,
    *,
    relative_error: float = 0.01,
    oracle_error: float = 0.0,
) -> None:
    """Fail if the mean of independent renders is more than four standard errors from `expected`.

    Parameters
    ----------
    images : array, shape (seeds, height, width, 3)
    expected : float or 3 floats
    relative_error : float
        The comparison must be at least this sharp, or the test has no power: more samples are needed.
    oracle_error : float
        Standard error of the expected value itself, where it comes from a simulation.
    """
    found = estimate(images)
    expected = np.broadcast_to(np.asarray(expected, np.float64), found.mean.shape)
    z = found.z(expected)
    if oracle_error > 0:
        z = (found.mean - expected) / np.hypot(found.error, oracle_error)
    text = f"mean {found.mean}, standard error {found.error}, expected {expected}, z {np.round(z, 2)}"
    note(f"{os.environ.get('PYTEST_CURRENT_TEST', '')}: {text}")
    allowed = relative_error * np.abs(expected)
    assert (found.error <= allowed).all(), f"not sharp enough to judge, take more samples: {text}"
    assert (np.abs(z) < LARGEST_Z).all(), text


def isotropic_slab_btdf(tau: float, albedo: float) -> float:
    """Return the BTDF along the normal of a layer that scatters isotropically, without the unscattered light.

    Milne's integral equation for the source function S under parallel light from straight above,
    S(t) = albedo (exp(-t) / 4 pi + 1/2 integral of E1(|t - t'|) S(t') dt'), with S constant on each of many
    thin sheets and E1 integrated exactly over them.
    """
    sheets = 1500
    edges = np.linspace(0.0, tau, sheets + 1)
    centers = 0.5 * (edges[1:] + edges[:-1])
    offset = edges[None, :] - centers[:, None]
    kernel = np.diff(np.sign(offset) * (1.0 - special.expn(2, np.abs(offset))), axis=1)
    once = albedo / (4.0 * np.pi) * np.exp(-centers)
    source = np.linalg.solve(np.eye(sheets) - 0.5 * albedo * kernel, once)
    return float((source * np.exp(centers - tau)).sum() * tau / sheets)

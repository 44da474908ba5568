# SPDX-License-Identifier: GPL-3.0-or-later
"""Matrices."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mathutils import Matrix


def to_array(matrix: Matrix) -> np.ndarray:
    """Return a matrix as float64, shape (4, 4); Blender's matrices multiply columns, as the core's do."""
    return np.array(matrix, np.float64)


def to_arrays(matrices: Sequence[Matrix]) -> np.ndarray:
    """Return matrices as float64, shape (n, 4, 4): faster than one by one."""
    rows = chain.from_iterable(matrices)
    flat = np.fromiter(chain.from_iterable(rows), np.float64, 16 * len(matrices))
    return flat.reshape(-1, 4, 4)

"""Matrices: USD's row-vector convention to the delegate's column-vector convention."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pxr import UsdGeom

if TYPE_CHECKING:
    from pxr import Gf, Usd
    from tyndall.prims import Matrix

#: Columns are the images of x, y and z when z is turned onto the axis, keeping handedness.
_FROM_Z: dict[str, Matrix] = {
    "X": np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=np.float64),
    "Y": np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], dtype=np.float64),
    "Z": np.eye(4),
}


def to_matrix(matrix: Gf.Matrix4d) -> Matrix:
    """Return `matrix` for column vectors."""
    return np.array(matrix, dtype=np.float64).T


def axis_from_z(axis: str) -> Matrix:
    """Return the rotation that turns the z axis onto `axis`."""
    return _FROM_Z.get(axis, _FROM_Z["Z"])


def plane_from_z(axis: str) -> Matrix:
    """Return the rotation of a UsdGeomPlane: width along x (z if `axis` is X), length along y (z if Y)."""
    if axis == "X":
        return np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
    if axis == "Y":
        return np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
    return np.eye(4)


def world_matrix(prim: Usd.Prim, time: Usd.TimeCode) -> Gf.Matrix4d:
    """Return USD's local-to-world matrix of `prim` (row vectors)."""
    return UsdGeom.XformCache(time).GetLocalToWorldTransform(prim)

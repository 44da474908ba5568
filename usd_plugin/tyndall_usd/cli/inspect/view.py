"""From pixels to points of the stage."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from tyndall.prims import Camera

Array: TypeAlias = npt.NDArray[np.float64]

#: What the depth AOVs say where nothing is.
NO_DEPTH = 1e10


def forward_of(camera: Camera) -> Array:
    """Return the viewing direction."""
    return _unit(-np.asarray(camera.world_from_camera)[:3, 2])


def position_of(camera: Camera) -> Array:
    """Return where the camera is."""
    return np.asarray(camera.world_from_camera)[:3, 3].copy()


def depth_of(camera: Camera, point: Array) -> float:
    """Return the distance of `point` along the viewing axis."""
    return float((point - position_of(camera)) @ forward_of(camera))


def points_at(camera: Camera, depth: Array) -> Array:
    """Return the points seen at the middles of pixels.

    Parameters
    ----------
    camera : Camera
        Fitted to the image.
    depth : array of shape (height, width)
        Along the viewing axis.

    Returns
    -------
    array of shape (height, width, 3)
        In stage coordinates.
    """
    height, width = depth.shape
    is_perspective = camera.projection == "perspective"
    unit = camera.focal_length if is_perspective else 1.0
    size, center = np.array(camera.aperture) / unit, np.array(camera.aperture_offset) / unit
    x = center[0] + size[0] * ((np.arange(width) + 0.5) / width - 0.5)
    y = center[1] + size[1] * (0.5 - (np.arange(height) + 0.5) / height)
    film_x, film_y = np.meshgrid(x, y)
    spread = depth if is_perspective else np.ones_like(depth)
    right, up, back = _unit(np.asarray(camera.world_from_camera)[:3, :3])
    offsets = (
        (film_x * spread)[..., None] * right + (film_y * spread)[..., None] * up - depth[..., None] * back
    )
    return np.asarray(position_of(camera) + offsets)


def _unit(columns: Array) -> Array:
    """Return a vector, or the columns of a matrix as rows, with length 1."""
    rows = columns.T if columns.ndim == 2 else columns
    return np.asarray(rows / np.linalg.norm(rows, axis=-1, keepdims=True))

"""Directions as a map of the sphere, and what the renderer sees in all of them without any guide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import tyndall
from tyndall.prims import Camera

if TYPE_CHECKING:
    from tyndall_usd.cli.inspect.view import Array
    from tyndall_usd.cli.shot import Shot

_CAMERA = "/__tyndall/inspect"


@dataclass(frozen=True, slots=True)
class Basis:
    """Axes of the map: `ahead` is its middle, `up` its pole; longitude grows to the right."""

    ahead: Array
    right: Array
    up: Array

    @classmethod
    def facing(cls, direction: Array, up: Array) -> Basis:
        """Return the upright basis whose middle is as near to `direction` as can be."""
        level = direction - up * (direction @ up)
        if np.linalg.norm(level) < 1e-3:  # looking straight up or down
            level = np.roll(up, 1)
        ahead = level / np.linalg.norm(level)
        return cls(ahead, np.cross(ahead, up), up)

    def directions(self, longitude: Array, latitude: Array) -> Array:
        """Return unit vectors, shape (..., 3)."""
        level = np.cos(latitude)[..., None]
        around = np.cos(longitude)[..., None] * self.ahead + np.sin(longitude)[..., None] * self.right
        return np.asarray(level * around + np.sin(latitude)[..., None] * self.up)

    def angles(self, directions: Array) -> tuple[Array, Array]:
        """Return longitude and latitude of unit vectors."""
        longitude = np.arctan2(directions @ self.right, directions @ self.ahead)
        return longitude, np.arcsin(np.clip(directions @ self.up, -1.0, 1.0))


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Radiance from all directions as six pictures of a cube around a point."""

    faces: Array  #: (6, n, n)

    def radiance(self, directions: Array) -> Array:
        """Return the radiance from unit vectors, shape (..., 3)."""
        n = self.faces.shape[1]
        # The face a direction goes through is that of its largest component.
        depths = np.stack([directions @ forward for forward, _, _ in _FACES])
        face = depths.argmax(axis=0)
        frames = np.array(_FACES)[face]
        depth = np.take_along_axis(depths, face[None], axis=0)[0]
        right = (directions * frames[..., 1, :]).sum(-1) / depth
        up = (directions * frames[..., 2, :]).sum(-1) / depth
        column, row = ((v * 0.5 + 0.5) * n for v in (right, -up))
        last = n - 1
        indices = (face, row.astype(int).clip(0, last), column.astype(int).clip(0, last))
        return np.asarray(self.faces[indices])


def see_all_around(
    shot: Shot, settings: dict[str, Any], point: Array, *, size: int, samples: int, bounces: int
) -> Surroundings:
    """Render what arrives at `point`, unguided, by cameras that look through the faces of a cube."""
    plain = {"guiding": "off", "distanceSampling": "delta", "filter": "box", "timeLimit": 0.0}
    image = {"resolution": [size, size], "pixelAspect": 1.0, "aovs": ["rgba"], "camera": _CAMERA}
    limits = {"samples": samples, "maxBounces": bounces}
    faces = []
    try:
        for number, (forward, right, up) in enumerate(_FACES):
            shot.delegate.sync(_CAMERA, _face_camera(point, forward, right, up))
            own = {"seed": settings["seed"] + 1 + number}
            session = tyndall.Session(shot.delegate.commit(), {**settings, **plain, **image, **limits, **own})
            faces.append(session.render().aov("rgba")[..., :3].mean(axis=-1))
    finally:
        shot.delegate.remove(_CAMERA)
    return Surroundings(np.array(faces, dtype=np.float64))


def _face_camera(point: Array, forward: Array, right: Array, up: Array) -> Camera:
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = np.stack([right, up, -forward], axis=1)
    world_from_camera[:3, 3] = point
    return Camera(world_from_camera=world_from_camera, aperture=(2.0, 2.0), focal_length=1.0)


def _faces() -> list[tuple[Array, Array, Array]]:
    """Return forward, right and up of each face."""
    axes = np.eye(3)
    faces = []
    for i in range(3):
        for sign in (1.0, -1.0):
            forward, up = sign * axes[i], axes[(i + 1) % 3]
            faces.append((forward, np.cross(forward, up), up))
    return faces


_FACES = _faces()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of scenes and of viewports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from tyndall.prims import Camera

from .xform import to_array

if TYPE_CHECKING:
    import bpy
    from tyndall.messages import Messages

#: Path of the one camera that renders.
PATH = "/__tyndall/camera"
_MILLIMETRE = 1e-3


@dataclass(frozen=True)
class Frame:
    """The pixels to be made: all of the image, or a region of it.

    Parameters
    ----------
    width, height : int
        Of the full image.
    region : tuple of 4 int
        First and end column, first and end row counted from the bottom.
    """

    width: int
    height: int
    pixel_aspect: float
    region: tuple[int, int, int, int]

    @property
    def resolution(self) -> tuple[int, int]:
        """Pixels across and down of the region."""
        x0, x1, y0, y1 = self.region
        return x1 - x0, y1 - y0

    def crop(self, camera: Camera) -> Camera:
        """Return the camera that sees just the region."""
        x0, x1, y0, y1 = self.region
        (a, b), (u, v) = camera.aperture, camera.aperture_offset
        center = ((x0 + x1) / 2 / self.width - 0.5, (y0 + y1) / 2 / self.height - 0.5)
        return replace(
            camera,
            aperture=(a * (x1 - x0) / self.width, b * (y1 - y0) / self.height),
            aperture_offset=(u + a * center[0], v + b * center[1]),
        )


def read_frame(render: bpy.types.RenderSettings) -> Frame:
    """Return the pixels that a final render makes."""
    scale = render.resolution_percentage / 100.0
    width, height = (max(int(n * scale), 1) for n in (render.resolution_x, render.resolution_y))
    region = (0, width, 0, height)
    if render.use_border:
        region = (
            int(render.border_min_x * width),
            int(render.border_max_x * width),
            int(render.border_min_y * height),
            int(render.border_max_y * height),
        )
        if region[0] >= region[1] or region[2] >= region[3]:
            region = (0, width, 0, height)
    return Frame(width, height, render.pixel_aspect_x / render.pixel_aspect_y, region)


def read_camera(
    camera: bpy.types.Object, frame: Frame, path: str, messages: Messages, *, world: np.ndarray | None = None
) -> Camera:
    """Read a camera object as it sees `frame`."""
    data = camera.data
    if data.type not in ("PERSP", "ORTHO"):
        kind = {"PANO": "panoramic"}.get(data.type, data.type.lower())
        messages.error(path, f"{kind} cameras are not supported", "a perspective camera is used")
    across, up = frame.width * frame.pixel_aspect, float(frame.height)
    is_wide = data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and across >= up)
    is_ortho = data.type == "ORTHO"
    size = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    if is_ortho:
        size = data.ortho_scale
    aperture = (size, size * up / across) if is_wide else (size * across / up, size)
    placed = to_array(camera.matrix_world) if world is None else world
    radius, distance = _lens(camera, is_ortho, placed, path, messages)
    return frame.crop(
        Camera(
            world_from_camera=placed,
            projection="orthographic" if is_ortho else "perspective",
            aperture=aperture,
            aperture_offset=(data.shift_x * size, data.shift_y * size),
            focal_length=data.lens,
            lens_radius=radius,
            focus_distance=distance,
            clipping_range=(data.clip_start, data.clip_end),
        )
    )


def _lens(
    camera: bpy.types.Object, is_ortho: bool, world: np.ndarray, path: str, messages: Messages
) -> tuple[float, float]:
    """Return the radius of the lens, 0 for a pinhole, and the distance in focus."""
    dof = camera.data.dof
    if not dof.use_dof or dof.aperture_fstop <= 0.0:
        return 0.0, 1.0
    if dof.aperture_blades > 2 or dof.aperture_ratio != 1.0:
        messages.warning(path, "apertures with blades or a ratio are not supported", "the lens is round")
    if is_ortho:
        messages.warning(path, "orthographic cameras have no depth of field here", "all is sharp")
        return 0.0, 1.0
    distance = dof.focus_distance
    if dof.focus_object is not None:
        offset = to_array(dof.focus_object.matrix_world)[:3, 3] - world[:3, 3]
        axis = world[:3, 2] / np.linalg.norm(world[:3, 2])
        distance = abs(float(offset @ axis))
    return camera.data.lens * _MILLIMETRE / (2.0 * dof.aperture_fstop), max(distance, 1e-6)


def read_view(region_data: bpy.types.RegionView3D, far: float) -> Camera:
    """Read what a viewport shows; it may be looked at through a camera, zoomed, or orthographic.

    Everything is in the two matrices, which is why nothing else is asked.
    """
    projection = to_array(region_data.window_matrix)
    world = np.linalg.inv(to_array(region_data.view_matrix))
    (p00, p11) = projection[0, 0], projection[1, 1]
    if projection[3, 3] == 0.0:
        offset = (projection[0, 2] / p00, projection[1, 2] / p11)
        return Camera(
            world_from_camera=world, aperture=(2 / p00, 2 / p11), aperture_offset=offset, focal_length=1.0
        )
    # Orthographic views begin behind the eye.
    back = np.eye(4)
    back[2, 3] = far
    offset = (-projection[0, 3] / p00, -projection[1, 3] / p11)
    return Camera(
        world_from_camera=world @ back,
        projection="orthographic",
        aperture=(2 / p00, 2 / p11),
        aperture_offset=offset,
    )

"""UsdGeomCamera, and how its aperture conforms to an image (UsdRenderSettings' five policies)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pxr import Gf, Usd, UsdGeom
from tyndall.prims import Camera, TransformKey

from tyndall_usd.read.xform import to_matrix, world_matrix

if TYPE_CHECKING:
    from tyndall.messages import Messages

#: Stage units in the unit of apertures and focal lengths.
APERTURE_UNIT = 0.1


def read_camera(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    messages: Messages,
    *,
    depth_of_field: bool = True,
    motion_blur: bool = True,
) -> Camera:
    """Read the camera `prim` with its own aperture; `conform_aperture` fits it to an image."""
    camera = UsdGeom.Camera(prim)
    focal_length = float(camera.GetFocalLengthAttr().Get(time))
    aperture = (
        float(camera.GetHorizontalApertureAttr().Get(time)),
        float(camera.GetVerticalApertureAttr().Get(time)),
    )
    offset = (
        float(camera.GetHorizontalApertureOffsetAttr().Get(time)),
        float(camera.GetVerticalApertureOffsetAttr().Get(time)),
    )
    is_perspective = camera.GetProjectionAttr().Get(time) != "orthographic"
    if not is_perspective:
        aperture = (aperture[0] * APERTURE_UNIT, aperture[1] * APERTURE_UNIT)
        offset = (offset[0] * APERTURE_UNIT, offset[1] * APERTURE_UNIT)
    lens_radius = _lens_radius(camera, time, focal_length) if is_perspective and depth_of_field else 0.0
    near, far = camera.GetClippingRangeAttr().Get(time)
    _report_unsupported(camera, time, messages)
    return Camera(
        world_from_camera=to_matrix(world_matrix(prim, time)),
        motion=_motion(prim, shutter_interval(prim, time)) if motion_blur else (),
        projection="perspective" if is_perspective else "orthographic",
        aperture=aperture,
        aperture_offset=offset,
        focal_length=focal_length,
        lens_radius=lens_radius,
        focus_distance=float(camera.GetFocusDistanceAttr().Get(time)) if lens_radius else 1.0,
        clipping_range=(float(near), float(far)),
        exposure_scale=float(camera.ComputeLinearExposureScale(time)),
    )


def shutter_interval(camera: Usd.Prim, time: Usd.TimeCode) -> Gf.Interval:
    """Return when the shutter of `camera` is open around the frame at `time`; empty if it has no duration."""
    if not time.IsNumeric() or time.IsEarliestTime():
        return Gf.Interval()
    shutter = UsdGeom.Camera(camera)
    opened, closed = shutter.GetShutterOpenAttr().Get(time), shutter.GetShutterCloseAttr().Get(time)
    return (
        Gf.Interval(time.GetValue() + opened, time.GetValue() + closed) if opened < closed else Gf.Interval()
    )


def _motion(prim: Usd.Prim, interval: Gf.Interval) -> tuple[TransformKey, ...]:
    """Return where the camera is when its shutter opens and closes, and at the samples in between."""
    if interval.IsEmpty():
        return ()
    times = {interval.min, interval.max}
    ancestor = prim
    while ancestor:
        if UsdGeom.Xformable(ancestor):
            times.update(UsdGeom.Xformable(ancestor).GetTimeSamplesInInterval(interval))
        ancestor = ancestor.GetParent()
    keys = [to_matrix(world_matrix(prim, Usd.TimeCode(at))) for at in sorted(times)]
    if all(np.array_equal(keys[0], key) for key in keys):
        return ()
    scale = 1.0 / interval.GetSize()
    return tuple(
        TransformKey((at - interval.min) * scale, key) for at, key in zip(sorted(times), keys, strict=True)
    )


def conform_aperture(
    camera: Camera, *, resolution: tuple[int, int], pixel_aspect: float, policy: str
) -> tuple[Camera, float]:
    """Return `camera` with its aperture in the image's aspect ratio, and the pixel aspect ratio.

    Parameters
    ----------
    resolution : tuple of int
        Pixels across and down.
    policy : str
        UsdRenderSettings' ``aspectRatioConformPolicy``.
    """
    width, height = camera.aperture
    if width <= 0 or height <= 0:
        return camera, pixel_aspect
    image = resolution[0] * pixel_aspect / resolution[1]
    film = width / height
    if policy == "adjustPixelAspectRatio":
        return camera, film * resolution[1] / resolution[0]
    keep_height = {
        "adjustApertureWidth": True,
        "adjustApertureHeight": False,
        "cropAperture": image < film,
    }.get(policy, image > film)
    aperture = (height * image, height) if keep_height else (width, width / image)
    return replace(camera, aperture=aperture), pixel_aspect


def _lens_radius(camera: UsdGeom.Camera, time: Usd.TimeCode, focal_length: float) -> float:
    """Half the aperture's diameter, which is the focal length over the f-number."""
    f_stop = float(camera.GetFStopAttr().Get(time))
    distance = float(camera.GetFocusDistanceAttr().Get(time))
    return focal_length * APERTURE_UNIT / (2.0 * f_stop) if f_stop > 0 and distance > 0 else 0.0


def _report_unsupported(camera: UsdGeom.Camera, time: Usd.TimeCode, messages: Messages) -> None:
    path = camera.GetPath()
    if camera.GetClippingPlanesAttr().Get(time):
        messages.warning(path, "clippingPlanes are not supported", "the camera sees what they would hide")

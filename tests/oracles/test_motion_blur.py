"""A camera that moves while its shutter is open sees an edge as a ramp: how long each place is covered."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom
from support.render import Shot
from support.stages import StageBuilder
from tyndall.messages import Messages
from tyndall_usd.motion import report_unblurred

if TYPE_CHECKING:
    from pathlib import Path

WIDTH, HEIGHT = 24, 4
#: Stage units across the image; a pixel is a quarter of one.
ACROSS = 6.0
SPP = 256
#: Where the camera is at the frame's samples; the shutter is open from 0.9 to 1.7.
PLACES = {0.0: 0.0, 1.0: 0.2, 1.5: 2.0, 2.0: 1.4}
SHUTTER = (-0.1, 0.7)


def moving_camera(*, lens: bool, fog: bool) -> StageBuilder:
    """Return a view on a glowing half-plane that ends at x = 0.3."""
    stage = StageBuilder(WIDTH, HEIGHT)
    stage.camera((0, 0, 5), (0, 0, 0), orthographic_height=None if lens else ACROSS * HEIGHT / WIDTH)
    camera = UsdGeom.Camera(stage.stage.GetPrimAtPath("/World/Camera"))
    if lens:
        # Wide open, and sharp at the plane: its numbers and those of time are not each other's.
        camera.CreateHorizontalApertureAttr(60)
        camera.CreateVerticalApertureAttr(60 * HEIGHT / WIDTH)
        camera.CreateFStopAttr(2.0)
        camera.CreateFocusDistanceAttr(5.0)
    camera.ClearXformOpOrder()
    move = camera.AddTranslateOp()
    for time, x in PLACES.items():
        move.Set(Gf.Vec3d(x, 0, 5), time)
    camera.CreateShutterOpenAttr(SHUTTER[0])
    camera.CreateShutterCloseAttr(SHUTTER[1])
    stage.quad((-50, -50, 0), (50.3, 0, 0), (0, 100, 0), stage.lambert(0.0, emission=1.0))
    if fog:
        # So thin that it changes nothing, and yet there.
        stage.box((-60, -60, -1), (60, 60, 1), stage.medium(1e-7, 0.5))
    stage.stage.SetStartTimeCode(1)
    stage.stage.SetEndTimeCode(1)
    return stage


def expected() -> np.ndarray:
    """Return the share of time and of the pixel's width at which each column sees the half-plane."""
    n = 4000
    times = 1 + SHUTTER[0] + (np.arange(n) + 0.5) / n * (SHUTTER[1] - SHUTTER[0])
    camera = np.interp(times, list(PLACES), list(PLACES.values()))
    pixel = ACROSS / WIDTH
    left = -ACROSS / 2 + np.arange(WIDTH) * pixel
    covered = (0.3 - (left[:, None] + camera[None, :])) / pixel
    return np.clip(covered, 0, 1).mean(axis=1)


@pytest.mark.parametrize("lens", [False, True], ids=["pinhole", "lens"])
@pytest.mark.parametrize("fog", [False, True], ids=["clear", "fog"])
def test_an_edge_becomes_the_ramp_of_its_motion(tmp_path: Path, *, lens: bool, fog: bool) -> None:
    shot = Shot(moving_camera(lens=lens, fog=fog), tmp_path)
    image = shot.render(spp=SPP, max_bounces=2, seed=3)["rgba"][..., 0].astype(np.float64)
    share = expected()
    assert ((share > 0.01) & (share < 0.99)).sum() > 6, "there is a ramp to be seen"
    error = np.sqrt(np.maximum(share * (1 - share), 1e-4) / (SPP * HEIGHT))
    z = (image.mean(axis=0) - share) / error
    assert np.abs(z).max() < 4.5, (z, image.mean(axis=0), share)


def test_a_shutter_without_motion_changes_no_bit(tmp_path: Path) -> None:
    images = []
    for name, shutter in (("open", SHUTTER), ("instant", (0.0, 0.0))):
        stage = moving_camera(lens=True, fog=True)
        camera = UsdGeom.Camera(stage.stage.GetPrimAtPath("/World/Camera"))
        camera.ClearXformOpOrder()
        camera.AddTranslateOp(opSuffix="still").Set(Gf.Vec3d(0.2, 0, 5))
        camera.CreateShutterOpenAttr(shutter[0])
        camera.CreateShutterCloseAttr(shutter[1])
        folder = tmp_path / name
        folder.mkdir()
        images.append(Shot(stage, folder).render(spp=16, max_bounces=2)["rgba"])
    assert np.array_equal(*images)


def test_what_is_not_blurred_is_named() -> None:
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Cube.Define(stage, "/still")
    move = UsdGeom.Xform.Define(stage, "/parent").AddTranslateOp()
    move.Set(Gf.Vec3d(0), 1.0)
    move.Set(Gf.Vec3d(1), 2.0)
    UsdGeom.Cube.Define(stage, "/parent/cube")
    mesh = UsdGeom.Mesh.Define(stage, "/wave")
    mesh.CreatePointsAttr().Set([(0, 0, 0)], 1.0)
    mesh.GetPointsAttr().Set([(0, 0, 1)], 2.0)
    paths = ["/still", "/parent/cube", "/wave", "/no/such[3]"]
    messages = Messages()
    report_unblurred(stage, paths, Gf.Interval(1.0, 1.5), messages)
    assert [(m.path, m.severity) for m in messages] == [("/parent/cube", "warning"), ("/wave", "warning")]
    messages = Messages()
    report_unblurred(stage, paths, Gf.Interval(2.0, 2.5), messages)
    assert not messages, "nothing moves then"

"""Cameras: units, lenses, exposure and the five conform policies."""

from __future__ import annotations

import pytest
from pxr import Gf, Usd, UsdGeom
from tyndall.messages import Messages
from tyndall_usd.read.camera import conform_aperture, read_camera


@pytest.fixture
def camera():
    stage = Usd.Stage.CreateInMemory()
    camera = UsdGeom.Camera.Define(stage, "/c")
    camera.CreateHorizontalApertureAttr(40)
    camera.CreateVerticalApertureAttr(20)
    camera.CreateFocalLengthAttr(50)
    yield camera
    del stage


def _read(camera, **options):
    messages = Messages()
    return read_camera(camera.GetPrim(), Usd.TimeCode.Default(), messages, **options), list(messages)


def test_a_pinhole_by_default(camera):
    camera.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    read, messages = _read(camera)
    assert (read.aperture, read.focal_length, read.lens_radius, read.exposure_scale) == ((40, 20), 50, 0, 1)
    assert read.world_from_camera[:3, 3].tolist() == [1, 2, 3]
    assert not messages


def test_the_lens_is_in_stage_units(camera):
    camera.CreateFStopAttr(2.5)
    camera.CreateFocusDistanceAttr(7)
    read, _ = _read(camera)
    assert read.lens_radius == pytest.approx(1.0), "focal length 50 tenths = 5 units, over 2.5, halved"
    assert read.focus_distance == 7
    assert _read(camera, depth_of_field=False)[0].lens_radius == 0


def test_orthographic_apertures_are_in_stage_units(camera):
    camera.CreateProjectionAttr("orthographic")
    camera.CreateHorizontalApertureOffsetAttr(10)
    camera.CreateFStopAttr(2.5)
    camera.CreateFocusDistanceAttr(7)
    read, _ = _read(camera)
    assert (read.projection, read.aperture, read.aperture_offset) == ("orthographic", (4, 2), (1, 0))
    assert read.lens_radius == 0


def test_exposure_is_a_factor(camera):
    camera.CreateExposureAttr(2)
    assert _read(camera)[0].exposure_scale == pytest.approx(4)
    camera.CreateExposureTimeAttr(0.5)
    assert _read(camera)[0].exposure_scale == pytest.approx(2)


def test_what_is_not_supported_is_named(camera):
    camera.CreateClippingPlanesAttr([(1, 0, 0, 0)])
    _, messages = _read(camera)
    assert "clippingPlanes" in str(messages[0])


def test_the_shutter_tells_how_the_camera_moves(camera):
    move = camera.AddTranslateOp()
    for time, x in ((0, 0), (9.75, 1), (10, 3), (11, 4)):
        move.Set((x, 0, 0), time)
    camera.CreateShutterOpenAttr(-0.5)
    camera.CreateShutterCloseAttr(0.5)
    read = read_camera(camera.GetPrim(), Usd.TimeCode(10), Messages())
    assert [key.time for key in read.motion] == [0.0, 0.25, 0.5, 1.0]
    assert read.motion[0].world_from_object[0, 3] == pytest.approx(9.5 / 9.75)
    assert [key.world_from_object[0, 3] for key in read.motion[1:]] == [1, 3, 3.5]
    assert read_camera(camera.GetPrim(), Usd.TimeCode(10), Messages(), motion_blur=False).motion == ()
    assert read_camera(camera.GetPrim(), Usd.TimeCode(12), Messages()).motion == (), "it stands still there"
    camera.GetShutterCloseAttr().Set(-0.5)
    assert read_camera(camera.GetPrim(), Usd.TimeCode(10), Messages()).motion == ()


@pytest.mark.parametrize(
    ("policy", "resolution", "aperture", "pixel_aspect"),
    [
        ("expandAperture", (100, 100), (40, 40), 1),
        ("expandAperture", (400, 100), (80, 20), 1),
        ("cropAperture", (100, 100), (20, 20), 1),
        ("cropAperture", (400, 100), (40, 10), 1),
        ("adjustApertureWidth", (100, 100), (20, 20), 1),
        ("adjustApertureWidth", (400, 100), (80, 20), 1),
        ("adjustApertureHeight", (100, 100), (40, 40), 1),
        ("adjustApertureHeight", (400, 100), (40, 10), 1),
        ("adjustPixelAspectRatio", (100, 100), (40, 20), 2),
        ("adjustPixelAspectRatio", (400, 100), (40, 20), 0.5),
    ],
)
def test_the_aperture_conforms_to_the_image(camera, policy, resolution, aperture, pixel_aspect):
    read, got = conform_aperture(_read(camera)[0], resolution=resolution, pixel_aspect=1.0, policy=policy)
    assert read.aperture == aperture
    assert got == pixel_aspect
    assert read.aperture[0] / read.aperture[1] == resolution[0] * got / resolution[1]

"""Motion while the shutter is open: an edge becomes a ramp, how long each place is covered."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdVol
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
#: Pixels along a side of the picture that has a twin of so many still ones.
TWIN = 48
STILLS = 128


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


def expected(opened: float = SHUTTER[0], closed: float = SHUTTER[1]) -> np.ndarray:
    """Return the share of time and of the pixel's width at which each column sees the half-plane."""
    n = 4000
    times = 1 + opened + (np.arange(n) + 0.5) / n * (closed - opened)
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


def moving_edge(kind: str) -> StageBuilder:
    """Return a view on a glowing half-plane that moves as much as the camera above, the other way."""
    stage = StageBuilder(WIDTH, HEIGHT)
    stage.camera((0, 0, 5), (0, 0, 0), orthographic_height=ACROSS * HEIGHT / WIDTH)
    camera = UsdGeom.Camera(stage.stage.GetPrimAtPath("/World/Camera"))
    camera.CreateShutterOpenAttr(SHUTTER[0])
    camera.CreateShutterCloseAttr(SHUTTER[1])
    glow = stage.lambert(0.0, emission=1.0)
    places = {time: Gf.Vec3d(-x, 0, 0) for time, x in PLACES.items()}
    usd = stage.stage
    if kind == "points":
        place_points(usd, {time: [Gf.Vec3f(place)] for time, place in places.items()}, glow)
    elif kind == "velocity":
        # Two stretches of one shutter are more than a velocity can say: only one is open.
        instancer = place_points(usd, {1.0: [Gf.Vec3f(-0.2, 0, 0)]}, glow)
        instancer.GetVelocitiesAttr().Set([Gf.Vec3f(-3.6 * usd.GetTimeCodesPerSecond(), 0, 0)], 1.0)
        camera.CreateShutterOpenAttr(0.0)
        camera.CreateShutterCloseAttr(0.5)
    else:
        mover = UsdGeom.Xform.Define(usd, "/World/Mover")
        move = mover.AddTranslateOp()
        for time, place in places.items():
            move.Set(place, time)
        if kind in ("instances", "nested"):
            if kind == "nested":
                # Half of the way by instances of an instance.
                for time, place in places.items():
                    move.Set(place / 2, time)
                UsdGeom.Xform.Define(usd, "/Class")
                halves = {time: [Gf.Vec3f(place / 2)] for time, place in places.items()}
                place_points(usd, halves, glow, path="/Class/Points")
            else:
                half(usd, "/Class", 0.3, glow)
            usd.GetPrimAtPath("/Class").SetSpecifier(Sdf.SpecifierClass)
            one = usd.DefinePrim("/World/Mover/One")
            one.GetReferences().AddInternalReference("/Class")
            one.SetInstanceable(True)
        else:
            half(usd, "/World/Mover/Half", 0.3, glow, as_mesh=kind == "mesh")
    stage.stage.SetStartTimeCode(1)
    stage.stage.SetEndTimeCode(1)
    return stage


def half(stage: Usd.Stage, path: str, edge: float, material: str, *, as_mesh: bool = True) -> None:
    """Define what covers everything left of `edge`, below an Xform at `path`."""
    root = UsdGeom.Xform.Define(stage, path)
    if as_mesh:
        mesh = UsdGeom.Mesh.Define(stage, f"{path}/Surface")
        mesh.CreatePointsAttr([(-50, -50, 0), (edge, -50, 0), (edge, 50, 0), (-50, 50, 0)])
        mesh.CreateFaceVertexCountsAttr([4])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    else:
        # Upright: its axis is another one than the delegate's.
        shape = UsdGeom.Cylinder.Define(stage, f"{path}/Surface")
        shape.CreateAxisAttr("X")
        shape.CreateHeightAttr(50.0)
        shape.CreateRadiusAttr(40.0)
        UsdGeom.XformCommonAPI(shape).SetTranslate((edge - 25.0, 0, -41))
    UsdShade.MaterialBindingAPI.Apply(root.GetPrim()).Bind(UsdShade.Material.Get(stage, material))


def place_points(
    stage: Usd.Stage, positions: dict[float, list[Gf.Vec3f]], material: str, *, path: str = "/World/Points"
) -> UsdGeom.PointInstancer:
    instancer = UsdGeom.PointInstancer.Define(stage, path)
    half(stage, f"{path}/Half", 0.3, material)
    instancer.CreatePrototypesRel().SetTargets([f"{path}/Half"])
    instancer.CreateProtoIndicesAttr([0])
    instancer.CreateVelocitiesAttr()
    for time, places in positions.items():
        instancer.GetPositionsAttr().Set(places, time)
    return instancer


@pytest.mark.parametrize("kind", ["mesh", "shape", "instances", "nested", "points", "velocity"])
def test_edges_that_move_become_ramps(tmp_path: Path, kind: str) -> None:
    image = Shot(moving_edge(kind), tmp_path).render(spp=SPP, max_bounces=2, seed=3)["rgba"][..., 0]
    opened, closed = (0.0, 0.5) if kind == "velocity" else SHUTTER
    share = expected(opened, closed)
    error = np.sqrt(np.maximum(share * (1 - share), 1e-4) / (SPP * HEIGHT))
    z = (image.astype(np.float64).mean(axis=0) - share) / error
    assert ((share > 0.01) & (share < 0.99)).sum() > 6, "there is a ramp to be seen"
    assert np.abs(z).max() < 4.5, (z, image.mean(axis=0), share)


def propeller(*, shutter: tuple[float, float], at: float = 1.0) -> StageBuilder:
    """Return blades that turn about a hub that moves, over a floor that they shade and light, in thin fog."""
    stage = StageBuilder(TWIN, TWIN)
    stage.camera((0, 2.5, 5), (0, 0.2, 0))
    camera = UsdGeom.Camera(stage.stage.GetPrimAtPath("/World/Camera"))
    camera.CreateShutterOpenAttr(shutter[0])
    camera.CreateShutterCloseAttr(shutter[1])
    stage.quad((-4, -0.8, 4), (8, 0, 0), (0, 0, -8), stage.lambert(0.5))
    stage.box((-4, -1, -4), (4, 2, 4), stage.medium(0.05, 0.9))
    stage.dome(1.0)
    usd = stage.stage
    hub = UsdGeom.Xform.Define(usd, "/World/Hub")
    move = hub.AddTranslateOp()
    move.Set(Gf.Vec3d(-0.4, 0, 0), 1.0)
    move.Set(Gf.Vec3d(0.4, 0.2, 0), 2.0)
    arm = UsdGeom.Xform.Define(usd, "/World/Hub/Arm")
    turn = arm.AddRotateYOp()
    turn.Set(0.0, 1.0)
    turn.Set(150.0, 2.0)
    red, glow = stage.lambert((0.8, 0.2, 0.1)), stage.lambert(0.2, emission=0.5)
    for i, (material, x) in enumerate(((red, 1.0), (glow, -1.0))):
        blade = UsdGeom.Cube.Define(usd, f"/World/Hub/Arm/Blade{i}")
        UsdGeom.XformCommonAPI(blade).SetTranslate((x, 0, 0))
        UsdGeom.XformCommonAPI(blade).SetScale((0.6, 0.1, 0.25))
        UsdShade.MaterialBindingAPI.Apply(blade.GetPrim()).Bind(UsdShade.Material.Get(usd, material))
    ball = UsdGeom.Sphere.Define(usd, "/World/Hub/Arm/Ball")
    UsdGeom.XformCommonAPI(ball).SetScale((0.2, 0.5, 0.3))
    UsdShade.MaterialBindingAPI.Apply(ball.GetPrim()).Bind(UsdShade.Material.Get(usd, red))
    usd.SetStartTimeCode(at)
    usd.SetEndTimeCode(at)
    return stage


def test_a_blurred_picture_is_the_mean_of_still_ones(tmp_path: Path) -> None:
    stills = []
    for i in range(STILLS):
        at = 1.0 + (i + 0.5) / STILLS
        folder = tmp_path / str(i)
        folder.mkdir()
        shot = Shot(propeller(shutter=(0.0, 0.0), at=at), folder)
        stills.append(blocks(shot.render(spp=16, max_bounces=4, seed=100 + i)["rgba"]))
    stills = np.array(stills)
    # Neighbouring times look alike: half of the squared steps between them is more than the noise of one.
    error_of_mean = np.sqrt((np.diff(stills, axis=0) ** 2).mean(axis=0) / 2 / STILLS)
    shot = Shot(propeller(shutter=(0.0, 1.0)), tmp_path)
    blurred = np.array(
        [blocks(shot.render(spp=64, max_bounces=4, seed=seed)["rgba"]) for seed in range(1, 17)]
    )
    error = np.hypot(error_of_mean, blurred.std(axis=0, ddof=1) / np.sqrt(len(blurred)))
    z = (blurred.mean(axis=0) - stills.mean(axis=0)) / error
    frozen = blocks(
        Shot(propeller(shutter=(0.0, 0.0), at=1.5), tmp_path).render(spp=64, max_bounces=4)["rgba"]
    )
    assert np.abs(frozen - stills.mean(axis=0)).max() > 20 * error.max(), "motion shows"
    assert np.abs(z).max() < 4.5, z
    assert abs(z.mean()) < 4.5 / np.sqrt(z.size), z.mean()


def blocks(image: np.ndarray) -> np.ndarray:
    """Return the means of blocks of 8x8 pixels, red and blue."""
    n = TWIN // 8
    return image[..., [0, 2]].astype(np.float64).reshape(n, 8, n, 8, 2).mean(axis=(1, 3))


def test_threads_do_not_change_a_blurred_picture(tmp_path: Path) -> None:
    shot = Shot(propeller(shutter=(0.0, 1.0)), tmp_path)
    one, two = (shot.render(spp=4, max_bounces=4, threads=n)["rgba"] for n in (1, 2))
    assert np.array_equal(one, two)


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


def test_a_medium_inside_what_moves_is_named(tmp_path: Path) -> None:
    stage = moving_edge("mesh")
    fog = stage.box((-1, -1, -1), (1, 1, 1), stage.medium(0.5, 0.5))
    UsdGeom.Xformable(stage.stage.GetPrimAtPath(fog)).AddTranslateOp(opSuffix="shake").Set(Gf.Vec3d(0), 1.0)
    still = Shot(stage, tmp_path).session(spp=1, max_bounces=1).diagnostics
    assert not [d for d in still if "medium" in d.what]
    shake = UsdGeom.Xformable(stage.stage.GetPrimAtPath(fog)).GetOrderedXformOps()[-1]
    shake.Set(Gf.Vec3d(0.5), 2.0)
    (told,) = (
        d for d in Shot(stage, tmp_path).session(spp=1, max_bounces=1).diagnostics if "medium" in d.what
    )
    assert told.path == fog
    assert "only surfaces and cameras are blurred" in told.action


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
    UsdLux.SphereLight.Define(stage, "/parent/lamp")
    smoke = UsdVol.Volume.Define(stage, "/smoke")
    smoke.CreateFieldRelationship("vel", UsdVol.OpenVDBAsset.Define(stage, "/smoke/vel").GetPath())
    paths = ["/still", "/parent/cube", "/wave", "/parent/lamp", "/smoke", "/no/such[3]"]
    messages = Messages()
    report_unblurred(stage, paths, Gf.Interval(1.0, 1.5), messages)
    assert [(m.path, m.severity) for m in messages] == [
        (path, "warning") for path in ("/wave", "/parent/lamp", "/smoke")
    ]
    messages = Messages()
    report_unblurred(stage, paths, Gf.Interval(2.0, 2.5), messages)
    assert [m.path for m in messages] == ["/smoke"], "nothing moves then, but what velocities may say"

"""UsdLux lights."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux
from tyndall.prims import Light
from usd.collector import translate


@pytest.fixture
def stage():
    return Usd.Stage.CreateInMemory()


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("SphereLight", ("sphere", {"radius": 0.5, "as_point": False})),
        ("RectLight", ("rect", {"width": 1.0, "height": 1.0})),
        ("DiskLight", ("disk", {"radius": 0.5})),
        ("CylinderLight", ("cylinder", {"length": 1.0, "radius": 0.5, "as_line": False})),
        ("DomeLight", ("dome", {})),
        ("DomeLight_1", ("dome", {})),
    ],
)
def test_every_kind_has_its_parameters(stage, kind, expected):
    stage.DefinePrim("/l", kind)
    light = translate(stage).prims["/l"]
    assert (light.kind, light.params) == expected
    assert (light.intensity, light.exposure, light.normalize) == (1.0, 0.0, False)


def test_distant_lights_have_the_schema_default_intensity(stage):
    UsdLux.DistantLight.Define(stage, "/l")
    light = translate(stage).prims["/l"]
    assert light.intensity == 50000
    assert light.params["angle"] == pytest.approx(0.53)


def test_color_temperature_multiplies_the_color(stage):
    light = UsdLux.SphereLight.Define(stage, "/l")
    light.CreateColorAttr((0.5, 1, 1))
    light.CreateColorTemperatureAttr(3000)
    assert translate(stage).prims["/l"].color == (0.5, 1, 1), "only if enabled"
    light.CreateEnableColorTemperatureAttr(True)
    warm = UsdLux.BlackbodyTemperatureAsRgb(3000)
    np.testing.assert_allclose(
        translate(stage).prims["/l"].color, (0.5 * warm[0], warm[1], warm[2]), rtol=1e-6
    )


def test_point_and_line_hints(stage):
    UsdLux.SphereLight.Define(stage, "/p").CreateTreatAsPointAttr(True)
    UsdLux.CylinderLight.Define(stage, "/l").CreateTreatAsLineAttr(True)
    prims = translate(stage).prims
    assert prims["/p"].params["as_point"] is True
    assert prims["/l"].params["as_line"] is True


def test_shaping(stage):
    light = UsdLux.SphereLight.Define(stage, "/l")
    shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
    shaping.CreateShapingConeAngleAttr(30)
    shaping.CreateShapingConeSoftnessAttr(0.25)
    shaping.CreateShapingFocusAttr(2)
    shaping.CreateShapingFocusTintAttr((1, 0, 0))
    read = translate(stage).prims["/l"].shaping
    assert (read.cone_angle, read.cone_softness, read.focus, read.focus_tint) == (30, 0.25, 2, (1, 0, 0))


@pytest.mark.parametrize(
    ("up", "pole_axis", "pole", "front"),
    [
        ("Y", "scene", (0, 1, 0), (0, 0, 1)),
        ("Z", "scene", (0, 0, 1), (0, -1, 0)),
        ("Y", "Z", (0, 0, 1), (0, -1, 0)),
        ("Z", "Y", (0, 1, 0), (0, 0, 1)),
    ],
)
def test_the_pole_axis_of_the_newer_dome(stage, up, pole_axis, pole, front):
    UsdGeom.SetStageUpAxis(stage, up)
    UsdLux.DomeLight_1.Define(stage, "/l").CreatePoleAxisAttr(pole_axis)
    UsdLux.DomeLight.Define(stage, "/old")
    prims = translate(stage).prims
    matrix = prims["/l"].world_from_light
    np.testing.assert_allclose((matrix @ [0, 1, 0, 0])[:3], pole)
    np.testing.assert_allclose((matrix @ [0, 0, 1, 0])[:3], front)
    np.testing.assert_allclose(prims["/old"].world_from_light, np.eye(4))


def test_textures_are_resolved_and_missing_ones_named(stage, tmp_path):
    image = tmp_path / "sky.exr"
    image.write_bytes(b"")
    dome = UsdLux.DomeLight.Define(stage, "/l")
    dome.CreateTextureFileAttr(str(image))
    assert translate(stage).prims["/l"].params == {"texture": str(image)}
    dome.CreateTextureFormatAttr("angular")
    read = translate(stage)
    assert read.prims["/l"].params == {}
    assert read.said("/l", "angular", "latlong")
    dome.CreateTextureFileAttr("/nowhere/sky.exr")
    assert translate(stage).said("/l", "/nowhere/sky.exr")


def test_invisible_lights_do_not_shine(stage):
    UsdLux.SphereLight.Define(stage, "/l").MakeInvisible()
    assert not translate(stage).of_type(Light)


def _exclude(prim):
    UsdLux.LightAPI(prim).GetLightLinkCollectionAPI().ExcludePath("/x")


def _filter(prim):
    prim.CreateRelationship("light:filters").AddTarget("/x")


def _ies(prim):
    UsdLux.ShapingAPI.Apply(prim).CreateShapingIesFileAttr("x.ies")


def _no_shadow(prim):
    UsdLux.ShadowAPI.Apply(prim).CreateShadowEnableAttr(False)


@pytest.mark.parametrize(
    ("change", "word"),
    [(_exclude, "lightLink"), (_filter, "filters"), (_ies, "x.ies"), (_no_shadow, "shadow:enable")],
)
def test_what_lights_do_not_support_is_named(stage, change, word):
    change(UsdLux.SphereLight.Define(stage, "/l").GetPrim())
    assert translate(stage).said("/l", word)


@pytest.mark.parametrize("kind", ["PortalLight", "GeometryLight", "PluginLight"])
def test_unsupported_types_are_named(stage, kind):
    stage.DefinePrim("/l", kind)
    assert translate(stage).said("/l", kind)


def test_light_schemas_on_gprims_are_named(stage):
    UsdLux.MeshLightAPI.Apply(UsdGeom.Sphere.Define(stage, "/s").GetPrim())
    read = translate(stage)
    assert read.said("/s", "MeshLightAPI")
    assert "/s" in read.prims


def test_an_ordinary_light_says_nothing(stage):
    light = UsdLux.RectLight.Define(stage, "/l")
    light.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    light.GetPrim().CreateAttribute("ri:light:something", Sdf.ValueTypeNames.Float).Set(1.0)
    read = translate(stage)
    assert not read.messages
    assert read.prims["/l"].world_from_light[:3, 3].tolist() == [1, 2, 3]

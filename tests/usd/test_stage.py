"""Opening stages, skinning, edits, and every stage of the shared data."""

from __future__ import annotations

import pytest
import tyndall
import tyndall_usd
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade
from support.shared import shared, shared_root
from tyndall.delegate import DirtyBits
from tyndall.messages import Messages
from tyndall.prims import Mesh, Shape
from usd.collector import Collector, translate

_FOLDERS = (
    "cases",
    "data/usd_wg",
    "data/openusd_lux_geom",
    "data/openusd_vdbvolume",
    "data/openusd_simplevolumes",
    "data/openusd_volinstancing",
    "data/openusd_volumematerial",
    "data/hdmitsuba_assets",
    "data/arnold_2239",
)


def _stages():
    found = [p for folder in _FOLDERS for p in sorted((shared_root() / folder).rglob("*.usd*"))]
    return found or [shared_root() / "cases"]


@pytest.mark.parametrize("path", _stages(), ids=lambda p: p.name)
def test_every_shared_stage_is_translated(path):
    if not path.is_file():
        pytest.skip(f"{path} is absent: set TYNDALL_SHARED to the folder with the shared test data")
    messages = Messages()
    stage = tyndall_usd.open_stage(path, messages=messages)
    read = translate(stage)
    for prim in (p for p in read.prims.values() if isinstance(p, (Mesh, Shape))):
        assert prim.material in read.prims
        assert prim.instancer is None or prim.instancer in read.prims
    for severity, _, what, action in read.messages:
        assert severity in ("info", "warning", "error")
        assert what
        assert action


def test_a_missing_file_and_a_file_of_another_kind(tmp_path):
    with pytest.raises(tyndall.FileError, match=r"gone\.usda does not exist"):
        tyndall_usd.open_stage(tmp_path / "gone.usda")
    (tmp_path / "broken.usda").write_text("#usda 1.0\ndef Xform {{{")
    with pytest.raises(tyndall.FileError, match=r"broken\.usda"):
        tyndall_usd.open_stage(tmp_path / "broken.usda")
    (tmp_path / "text.txt").write_text("hello")
    with pytest.raises(tyndall.FileError, match=r"text\.txt"):
        tyndall_usd.open_stage(tmp_path / "text.txt")
    with pytest.raises(tyndall.FileError, match="folder"):
        tyndall_usd.open_stage(tmp_path)


def test_composition_errors_are_messages(tmp_path):
    (tmp_path / "s.usda").write_text('#usda 1.0\ndef "a" (references = @gone.usda@) {}\ndef Cube "b" {}')
    messages = Messages()
    stage = tyndall_usd.open_stage(tmp_path / "s.usda", messages=messages)
    assert "gone.usda" in str(next(iter(messages)))
    assert translate(stage).of_type(Shape)


def test_materialx_layers_say_what_to_install():
    messages = Messages()
    path = shared(
        "data", "usd_wg", "test_assets", "TextureCoordinateTest", "TextureCoordinateTestMaterialX.usda"
    )
    tyndall_usd.open_stage(path, messages=messages)
    if not len(messages):
        pytest.skip("this OpenUSD reads MaterialX")
    assert "usd-exchange" in str(next(iter(messages)))


_VARIANTS = """#usda 1.0
def Xform "prop" (
    variants = { string shape = "ball" }
    prepend variantSets = "shape"
)
{
    variantSet "shape" = {
        "ball" {
            def Sphere "s" {
            }
        }
        "box" {
            def Cube "s" {
            }
        }
    }
}
"""


def test_variants_are_selected(tmp_path):
    path = tmp_path / "v.usda"
    path.write_text(_VARIANTS)
    assert translate(tyndall_usd.open_stage(path)).prims["/prop/s"].kind == "sphere"
    assert (
        translate(tyndall_usd.open_stage(path, variants=["/prop:shape=box"])).prims["/prop/s"].kind == "cube"
    )
    for wrong, words in [
        ("/prop:shape=cone", "ball, box"),
        ("/prop:size=big", "shape"),
        ("/nowhere:shape=box", "/nowhere"),
        ("nonsense", "PRIM:SET=NAME"),
    ]:
        with pytest.raises(tyndall.SettingsError, match=words):
            tyndall_usd.open_stage(path, variants=[wrong])


def test_masks_and_session_layers(tmp_path):
    (tmp_path / "s.usda").write_text('#usda 1.0\ndef Cube "a" {}\ndef Cube "b" {}')
    (tmp_path / "over.usda").write_text('#usda 1.0\nover "a" {\n double size = 7\n}')
    assert list(translate(tyndall_usd.open_stage(tmp_path / "s.usda", mask=["/b"])).of_type(Shape)) == ["/b"]
    stage = tyndall_usd.open_stage(tmp_path / "s.usda", session_layer=tmp_path / "over.usda")
    assert translate(stage).prims["/a"].params == {"size": 7}


def test_skinned_meshes_move():
    stage = tyndall_usd.open_stage(shared("data", "hdmitsuba_assets", "shapes", "skinned_mesh.usda"))
    collector = Collector()
    index = tyndall_usd.SceneIndex(stage, collector)
    shapes = []
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    for time in (start, end, start):
        index.sync(Usd.TimeCode(time))
        shapes.append({path: mesh.points.copy() for path, mesh in collector.of_type(Mesh).items()})
    assert any((shapes[0][path] != shapes[1][path]).any() for path in shapes[0]) or start == end
    for path in shapes[0]:
        assert (shapes[0][path] == shapes[2][path]).all(), "a second bake does not add to the first"


@pytest.fixture
def live():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/w")
    UsdGeom.Cube.Define(stage, "/w/cube")
    UsdLux.SphereLight.Define(stage, "/w/light")
    mesh = UsdGeom.Mesh.Define(stage, "/w/mesh")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    look = UsdShade.Material.Define(stage, "/look")
    shader = UsdShade.Shader.Define(stage, "/look/s")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("roughness", tyndall_usd_types().Float).Set(0.5)
    look.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    collector = Collector()
    index = tyndall_usd.SceneIndex(stage, collector)
    index.sync(Usd.TimeCode.Default())
    return stage, collector, index


def tyndall_usd_types():
    from pxr import Sdf

    return Sdf.ValueTypeNames


def _bind(stage):
    prim = stage.GetPrimAtPath("/w/mesh")
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material(stage.GetPrimAtPath("/look")))


def _move(stage):
    UsdGeom.Xformable(stage.GetPrimAtPath("/w")).AddTranslateOp().Set(Gf.Vec3d(1))


def _color(stage):
    UsdGeom.Gprim(stage.GetPrimAtPath("/w/cube")).CreateDisplayColorAttr([(1, 0, 0)])


def _set(prim, name, value):
    return lambda stage: stage.GetPrimAtPath(prim).GetAttribute(name).Set(value)


_EDITS = [
    (_move, {"/w/cube", "/w/light", "/w/mesh"}, "TRANSFORM"),
    (_set("/w/mesh", "points", [(0, 0, 1)] * 3), {"/w/mesh"}, "POINTS"),
    (_set("/w/mesh", "orientation", "leftHanded"), {"/w/mesh"}, "TOPOLOGY"),
    (_color, {"/w/cube"}, "PRIMVARS"),
    (_set("/w/light", "inputs:intensity", 3.0), {"/w/light"}, "PARAMS"),
]


@pytest.mark.parametrize(("edit", "paths", "bits"), _EDITS, ids=[bits for *_, bits in _EDITS])
def test_an_edit_syncs_what_it_touches_and_nothing_else(live, edit, paths, bits):
    stage, collector, index = live
    collector.bits.clear()
    assert index.sync(Usd.TimeCode.Default()) == 0, "nothing changed"
    edit(stage)
    index.sync(Usd.TimeCode.Default())
    assert collector.bits == dict.fromkeys(paths, DirtyBits[bits])


def test_binding_and_hiding_and_adding(live):
    stage, collector, index = live
    collector.bits.clear()
    _bind(stage)
    index.sync(Usd.TimeCode.Default())
    assert collector.bits["/w/mesh"] == DirtyBits.MATERIAL_ID
    assert collector.bits["/look"] == DirtyBits.ALL
    stage.GetPrimAtPath("/look/s").GetAttribute("inputs:roughness").Set(0.25)
    collector.bits.clear()
    index.sync(Usd.TimeCode.Default())
    assert collector.bits == {"/look": DirtyBits.PARAMS}
    UsdGeom.Imageable(stage.GetPrimAtPath("/w/cube")).MakeInvisible()
    UsdGeom.Sphere.Define(stage, "/w/new")
    index.sync(Usd.TimeCode.Default())
    assert collector.removed == ["/w/cube"]
    assert collector.prims["/w/new"].kind == "sphere"

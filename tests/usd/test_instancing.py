"""Native instancing and point instancers: stored once, drawn everywhere, against plain recursion."""

from __future__ import annotations

import numpy as np
import pytest
import tyndall_usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade
from support.shared import shared, shared_root
from tyndall.prims import Instancer, Light, Mesh, Shape
from usd.collector import drawn_matrices, expected_matrices, placements, translate

_STAGES = sorted(
    [
        *shared_root().glob("data/openusd_lux_geom/PointInstancer/*.usda"),
        *shared_root().glob("data/openusd_lux_geom/Implicits/*.usda"),
        shared_root() / "cases/scenes/jungle.usda",
        shared_root() / "data/usd_wg/test_assets/schemaTests/usdGeom/transforms/complex_transform.usda",
    ]
)


@pytest.mark.parametrize("path", _STAGES, ids=lambda p: p.stem)
def test_everything_drawn_lies_where_plain_recursion_puts_it(path):
    if not path.exists():
        pytest.skip(f"{path} is absent: set TYNDALL_SHARED")
    stage = tyndall_usd.open_stage(path)
    for time in [tyndall_usd.first_time(stage), Usd.TimeCode(3), Usd.TimeCode(7.5)]:
        drawn = translate(stage, time=time)
        if path.stem == "implicits":
            assert len(drawn_matrices(drawn)) > 0
            continue
        np.testing.assert_allclose(drawn_matrices(drawn), expected_matrices(stage, time), atol=1e-9)


def test_the_jungle_stores_each_prototype_once():
    drawn = translate(tyndall_usd.open_stage(shared("cases", "scenes", "jungle.usda")))
    instancers = drawn.of_type(Instancer)
    assert sorted(len(i.transforms) for i in instancers.values()) == [46, 220, 320]
    instanced = [mesh for mesh in drawn.of_type(Mesh).values() if mesh.instancer]
    assert len(instanced) == 3
    assert not drawn.messages


def _stage_with_prototype():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/World")
    prototype = stage.CreateClassPrim("/Prototype")
    prototype.SetTypeName("Xform")
    cube = UsdGeom.Cube.Define(stage, "/Prototype/cube")
    cube.AddTranslateOp().Set(Gf.Vec3d(0, 1, 0))
    return stage


def _instance(stage, path, x=0.0):
    xform = UsdGeom.Xform.Define(stage, path)
    xform.AddTranslateOp().Set(Gf.Vec3d(x, 0, 0))
    xform.GetPrim().GetReferences().AddInternalReference("/Prototype")
    xform.GetPrim().SetInstanceable(True)
    return xform.GetPrim()


def test_instances_that_hand_down_other_materials_are_other_looks():
    stage = _stage_with_prototype()
    for i in range(4):
        prim = _instance(stage, f"/World/i{i}", float(i))
        material = UsdShade.Material.Define(stage, f"/World/m{i % 2}")
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)
    drawn = translate(stage)
    assert sorted(len(i.transforms) for i in drawn.of_type(Instancer).values()) == [2, 2]
    assert len(drawn.of_type(Shape)) == 2


def test_instances_that_hand_down_other_display_colors_are_other_looks():
    stage = _stage_with_prototype()
    for i in range(3):
        prim = _instance(stage, f"/World/i{i}", float(i))
        color = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
            "displayColor", Sdf.ValueTypeNames.Color3fArray, "constant"
        )
        color.Set([Gf.Vec3f(1 if i else 0, 0, 0)])
        UsdGeom.PrimvarsAPI(prim).CreatePrimvar("id", Sdf.ValueTypeNames.Int, "constant").Set(i)
    shapes = translate(stage).of_type(Shape)
    assert sorted(float(s.primvars["displayColor"].values[0, 0]) for s in shapes.values()) == [0.0, 1.0]


def test_a_prototype_met_in_two_places_is_stored_once():
    stage = _stage_with_prototype()
    _instance(stage, "/World/direct", 5.0)
    outer = stage.CreateClassPrim("/Outer")
    outer.SetTypeName("Xform")
    _instance(stage, "/Outer/a", 1.0)
    _instance(stage, "/Outer/b", 2.0)
    for i in range(3):
        xform = UsdGeom.Xform.Define(stage, f"/World/o{i}")
        xform.AddTranslateOp().Set(Gf.Vec3d(0, 0, i))
        xform.GetPrim().GetReferences().AddInternalReference("/Outer")
        xform.GetPrim().SetInstanceable(True)
    drawn = translate(stage)
    assert len(drawn.of_type(Shape)) == 1
    (shape,) = drawn.of_type(Shape).values()
    assert len(placements(drawn, shape.instancer)) == 7
    np.testing.assert_allclose(drawn_matrices(drawn), expected_matrices(stage, Usd.TimeCode.Default()))


def test_lights_in_prototypes_shine_once_an_instance():
    stage = _stage_with_prototype()
    UsdLux.SphereLight.Define(stage, "/Prototype/light").AddTranslateOp().Set(Gf.Vec3d(0, 0, 2))
    for i in range(3):
        _instance(stage, f"/World/i{i}", float(i))
    lights = translate(stage).of_type(Light)
    assert sorted(light.world_from_light[:3, 3].tolist() for light in lights.values()) == [
        [0, 0, 2],
        [1, 0, 2],
        [2, 0, 2],
    ]


def _point_instancer(stage, n=3):
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/PI")
    UsdGeom.Sphere.Define(stage, "/World/PI/Protos/sphere")
    instancer.CreatePrototypesRel().SetTargets(["/World/PI/Protos/sphere"])
    instancer.CreateProtoIndicesAttr([0] * n)
    instancer.CreatePositionsAttr([Gf.Vec3f(i, 0, 0) for i in range(n)])
    return instancer


def test_invisible_and_inactive_ids_are_left_out():
    stage = Usd.Stage.CreateInMemory()
    instancer = _point_instancer(stage, 5)
    instancer.CreateIdsAttr([10, 11, 12, 13, 14])
    instancer.CreateInvisibleIdsAttr([11])
    instancer.DeactivateId(13)
    (prim,) = translate(stage).of_type(Instancer).values()
    assert prim.transforms[:, 0, 3].tolist() == [0, 2, 4]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda i: i.CreatePositionsAttr([Gf.Vec3f(0)]), ("3 protoIndices", "1 positions")),
        (lambda i: i.CreateProtoIndicesAttr([0, 7, -1]), ("2 protoIndices", "outside")),
        (lambda i: i.CreateScalesAttr([Gf.Vec3f(1)] * 2), ("2 scales",)),
        (lambda i: i.CreateIdsAttr([1]), ("1 ids",)),
        (lambda i: i.CreatePrototypesRel().SetTargets(["/nowhere"]), ("/nowhere",)),
        (lambda i: i.CreatePrototypesRel().SetTargets([]), ("prototypes",)),
    ],
)
def test_invalid_point_instancers_give_a_message(change, words):
    stage = Usd.Stage.CreateInMemory()
    change(_point_instancer(stage))
    assert translate(stage).said("/World/PI", *words)


def test_a_point_instancer_that_instances_itself_ends():
    stage = Usd.Stage.CreateInMemory()
    instancer = _point_instancer(stage)
    instancer.CreatePrototypesRel().SetTargets(["/World"])
    drawn = translate(stage)
    assert not drawn.of_type(Instancer)
    loop = UsdGeom.PointInstancer.Define(stage, "/Other/Inner")
    loop.CreatePrototypesRel().SetTargets(["/Other2"])
    loop.CreateProtoIndicesAttr([0])
    loop.CreatePositionsAttr([Gf.Vec3f(0)])
    back = UsdGeom.PointInstancer.Define(stage, "/Other2/Back")
    back.CreatePrototypesRel().SetTargets(["/Other2"])
    back.CreateProtoIndicesAttr([0])
    back.CreatePositionsAttr([Gf.Vec3f(0)])
    assert translate(stage).said("/Other2/Back", "instances itself")


def test_primvars_that_differ_between_point_instances_give_a_message():
    stage = Usd.Stage.CreateInMemory()
    prim = _point_instancer(stage).GetPrim()
    color = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex")
    color.Set([Gf.Vec3f(1, 0, 0)] * 3)
    assert translate(stage).said("/World/PI", "displayColor")

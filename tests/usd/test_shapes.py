"""Implicit shapes, visibility, purpose and transforms."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom
from tyndall.prims import Shape
from usd.collector import translate


@pytest.fixture
def stage():
    return Usd.Stage.CreateInMemory()


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize("kind", ["Cone", "Cylinder", "Capsule", "Cylinder_1", "Capsule_1"])
def test_the_axis_is_folded_into_the_transform(stage, kind, axis):
    stage.DefinePrim("/s", kind).GetAttribute("axis").Set(axis)
    matrix = translate(stage).prims["/s"].world_from_object
    up = matrix @ [0, 0, 1, 0]
    assert up[:3].tolist() == [float(axis == a) for a in "XYZ"]
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize(("axis", "width_along", "length_along"), [("X", 2, 1), ("Y", 0, 2), ("Z", 0, 1)])
def test_a_plane_spans_the_axes_of_its_schema(stage, axis, width_along, length_along):
    stage.DefinePrim("/s", "Plane").GetAttribute("axis").Set(axis)
    matrix = translate(stage).prims["/s"].world_from_object
    assert abs((matrix @ [1, 0, 0, 0])[width_along]) == 1
    assert abs((matrix @ [0, 1, 0, 0])[length_along]) == 1
    assert (matrix @ [0, 0, 1, 0])["XYZ".index(axis)] == 1


def test_parameters_have_the_names_of_the_delegate(stage):
    stage.DefinePrim("/a", "Cylinder_1").GetAttribute("radiusTop").Set(0.25)
    stage.DefinePrim("/b", "Capsule").GetAttribute("radius").Set(0.75)
    stage.DefinePrim("/c", "Sphere")
    prims = translate(stage).prims
    assert prims["/a"].params == {"radius_top": 0.25, "radius_bottom": 1.0, "height": 2.0}
    assert prims["/b"].params == {"radius_top": 0.75, "radius_bottom": 0.75, "height": 1.0}
    assert prims["/c"].params == {"radius": 1.0}


def test_invisible_prims_hide_what_is_below(stage):
    UsdGeom.Xform.Define(stage, "/x").MakeInvisible()
    UsdGeom.Cube.Define(stage, "/x/cube").CreateVisibilityAttr("inherited")
    UsdGeom.Cube.Define(stage, "/shown")
    assert list(translate(stage).of_type(Shape)) == ["/shown"]


def test_purpose_is_inherited_unless_authored(stage):
    UsdGeom.Xform.Define(stage, "/x").CreatePurposeAttr("proxy")
    UsdGeom.Cube.Define(stage, "/x/inherits")
    UsdGeom.Cube.Define(stage, "/x/own").CreatePurposeAttr("render")
    UsdGeom.Cube.Define(stage, "/guide").CreatePurposeAttr("guide")
    assert list(translate(stage).of_type(Shape)) == ["/x/own"]
    purposes = ("default", "render", "proxy")
    assert set(translate(stage, purposes=purposes).of_type(Shape)) == {"/x/own", "/x/inherits"}


def test_reset_xform_stack_forgets_the_parents(stage):
    UsdGeom.Xform.Define(stage, "/x").AddTranslateOp().Set(Gf.Vec3d(5, 0, 0))
    cube = UsdGeom.Cube.Define(stage, "/x/cube")
    cube.AddTranslateOp().Set(Gf.Vec3d(0, 1, 0))
    assert translate(stage).prims["/x/cube"].world_from_object[:3, 3].tolist() == [5, 1, 0]
    cube.SetResetXformStack(True)
    assert translate(stage).prims["/x/cube"].world_from_object[:3, 3].tolist() == [0, 1, 0]


def test_abstract_inactive_and_undefined_prims_are_not_drawn(stage):
    stage.CreateClassPrim("/class").SetTypeName("Cube")
    stage.OverridePrim("/over").SetTypeName("Cube")
    UsdGeom.Cube.Define(stage, "/inactive").GetPrim().SetActive(False)
    assert not translate(stage).of_type(Shape)


@pytest.mark.parametrize(
    "kind", ["BasisCurves", "Points", "NurbsPatch", "TetMesh", "HermiteCurves", "NurbsCurves"]
)
def test_unsupported_types_are_named_once_a_prim(stage, kind):
    stage.DefinePrim("/x", kind)
    messages = translate(stage).messages
    assert [m[1] for m in messages] == ["/x"]
    assert kind in messages[0][2]


def test_unknown_types_are_named(stage):
    stage.DefinePrim("/x", "MyOwnGeometry")
    assert translate(stage).said("/x", "MyOwnGeometry")

"""Meshes: topology, primvars, normals, subsets, and what is wrong with them."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt
from tyndall.prims import Mesh
from usd.collector import translate


def _quads(stage, path="/m", scheme="none"):
    """Two quads sharing an edge."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 1, 4, 5, 2])
    mesh.CreateSubdivisionSchemeAttr(scheme)
    return mesh


@pytest.fixture
def stage():
    return Usd.Stage.CreateInMemory()


def _mesh(stage, path="/m"):
    return translate(stage).prims[path]


def test_a_mesh_is_what_the_stage_says(stage):
    mesh = _quads(stage)
    mesh.CreateHoleIndicesAttr([1])
    mesh.CreateOrientationAttr("leftHanded")
    mesh.CreateDoubleSidedAttr(True)
    mesh.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    mesh.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    read = _mesh(stage)
    assert read.left_handed
    assert read.double_sided
    assert read.hole_indices.tolist() == [1]
    assert read.face_vertex_indices.tolist() == [0, 1, 2, 3, 1, 4, 5, 2]
    corner = read.world_from_object @ [*read.points[2], 1]
    assert corner.tolist() == [3, 4, 3, 1], "column vectors, translation last"


def test_the_default_scheme_is_catmull_clark(stage):
    mesh = _quads(stage)
    mesh.GetPrim().RemoveProperty("subdivisionScheme")
    mesh.CreateCreaseIndicesAttr([0, 1])
    mesh.CreateCreaseLengthsAttr([2])
    mesh.CreateCreaseSharpnessesAttr([3.5])
    mesh.CreateNormalsAttr([(0, 0, 1)] * 6)
    read = _mesh(stage)
    assert read.subdivision.scheme == "catmullClark"
    assert read.subdivision.crease_sharpnesses.tolist() == [3.5]
    assert read.normals is None, "a subdivided mesh has the limit surface's normals"


def test_primvar_normals_win_over_normals(stage):
    mesh = _quads(stage)
    mesh.CreateNormalsAttr([(0, 0, 1)] * 6)
    assert _mesh(stage).normals.values[0].tolist() == [0, 0, 1]
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "normals", Sdf.ValueTypeNames.Normal3fArray, "faceVarying"
    )
    primvar.Set([(1, 0, 0), (0, 1, 0)])
    primvar.SetIndices(Vt.IntArray([0, 0, 0, 0, 1, 1, 1, 1]))
    normals = _mesh(stage).normals
    assert normals.interpolation == "faceVarying"
    assert normals.values.tolist() == [[1, 0, 0]] * 4 + [[0, 1, 0]] * 4


@pytest.mark.parametrize(
    ("interpolation", "count"),
    [("constant", 1), ("uniform", 2), ("varying", 6), ("vertex", 6), ("faceVarying", 8)],
)
def test_every_interpolation_has_its_count(stage, interpolation, count):
    mesh = _quads(stage)
    mesh.CreateDisplayColorPrimvar(interpolation).Set([(i, 0, 0) for i in range(count)])
    primvar = _mesh(stage).primvars["displayColor"]
    assert primvar.interpolation == interpolation
    assert primvar.values[:, 0].tolist() == list(range(count))
    mesh.GetDisplayColorPrimvar().Set(
        [(i, 0, 0) for i in range(count + 2)][2 if count > 1 else 0 :][: count - 1 or None]
    )
    if count > 2:
        read = translate(stage)
        assert "displayColor" not in read.prims["/m"].primvars
        assert read.said("/m", "displayColor", interpolation)


def test_primvars_of_any_number_type_are_read(stage):
    mesh = _quads(stage)
    for kind, value in [
        (Sdf.ValueTypeNames.TexCoord2hArray, [(0.5, 0.25)] * 6),
        (Sdf.ValueTypeNames.TexCoord2dArray, [(0.5, 0.25)] * 6),
        (Sdf.ValueTypeNames.Float2Array, [(0.5, 0.25)] * 6),
    ]:
        UsdGeom.PrimvarsAPI(mesh).RemovePrimvar("st")
        UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", kind, "vertex").Set(value)
        assert _mesh(stage).primvars["st"].values.tolist() == [[0.5, 0.25]] * 6


def test_constant_primvars_are_inherited(stage):
    root = UsdGeom.Xform.Define(stage, "/Model")
    UsdGeom.PrimvarsAPI(root).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "constant").Set(
        [(1, 0, 0)]
    )
    _quads(stage, "/Model/m")
    assert _mesh(stage, "/Model/m").primvars["displayColor"].values.tolist() == [[1, 0, 0]]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: m.CreateFaceVertexCountsAttr([4, 3]), ("sum to 7", "8 faceVertexIndices")),
        (lambda m: m.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 1, 4, 99, 2]), ("99", "6 points")),
        (lambda m: m.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 1, 4, -1, 2]), ("-1", "6 points")),
        (lambda m: m.CreatePointsAttr([]), ("no points",)),
    ],
)
def test_broken_topology_gives_a_message_and_no_mesh(stage, change, words):
    change(_quads(stage))
    read = translate(stage)
    assert read.said("/m", *words)
    assert not read.of_type(Mesh)


def test_primvar_indices_out_of_range_give_a_message(stage):
    primvar = _quads(stage).CreateDisplayColorPrimvar("uniform")
    primvar.Set([(1, 0, 0)])
    primvar.SetIndices(Vt.IntArray([0, 5]))
    assert translate(stage).said("/m", "displayColor", "index")


def test_subsets_of_family_material_bind_have_their_materials(stage):
    mesh = _quads(stage)
    for name, face in (("a", 0), ("b", 1)):
        material = UsdShade.Material.Define(stage, f"/mat_{name}")
        shader = UsdShade.Shader.Define(stage, f"/mat_{name}/s")
        shader.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        subset = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).CreateMaterialBindSubset(
            name, Vt.IntArray([face, 7] if face else [face])
        )
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)
    UsdGeom.Subset.CreateGeomSubset(mesh, "other", "face", Vt.IntArray([0]), "somethingElse")
    read = translate(stage)
    subsets = {s.material: s.faces.tolist() for s in read.prims["/m"].subsets}
    assert subsets == {"/mat_a": [0], "/mat_b": [1]}
    assert read.said("/m/b", "outside")


def test_animated_points_are_interpolated(stage):
    points = _quads(stage).GetPointsAttr()
    points.Set([(0, 0, 0)] * 6, 1)
    points.Set([(0, 0, 4)] * 6, 3)
    assert translate(stage, time=Usd.TimeCode(2)).prims["/m"].points[0].tolist() == [0, 0, 2]


def test_a_foreign_type_of_attribute_gives_a_message(stage):
    text = '#usda 1.0\ndef Mesh "m" { float points = 3\n int[] faceVertexCounts = [3]\n }'
    stage.GetRootLayer().ImportFromString(text)
    read = translate(stage)
    assert read.said("/m", "points")
    assert not read.of_type(Mesh)


def test_arrays_are_contiguous_and_of_their_types(stage):
    read = _mesh(stage) if _quads(stage) else None
    assert read.points.dtype == np.float32
    assert read.face_vertex_counts.dtype == np.int32
    assert all(a.flags.c_contiguous for a in (read.points, read.face_vertex_indices, read.world_from_object))

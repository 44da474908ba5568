"""Volumes and their fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tyndall_usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdVol
from support.shared import shared
from tyndall.prims import Field, Instancer, Volume
from usd.collector import translate


@pytest.fixture
def vdb(tmp_path):
    path = tmp_path / "grid.vdb"
    path.write_bytes(b"not read by the front end")
    return path


def _volume(stage, vdb, path="/v", rel="density"):
    volume = UsdVol.Volume.Define(stage, path)
    field = UsdVol.OpenVDBAsset.Define(stage, f"{path}/f")
    field.CreateFilePathAttr(str(vdb))
    volume.CreateFieldRelationship(rel, field.GetPath())
    return volume, field


def test_the_field_prim_places_the_grid(vdb):
    stage = Usd.Stage.CreateInMemory()
    volume, field = _volume(stage, vdb)
    volume.AddTranslateOp().Set(Gf.Vec3d(1, 0, 0))
    UsdGeom.Xformable(field).AddTranslateOp().Set(Gf.Vec3d(0, 1, 0))
    outside = UsdVol.OpenVDBAsset.Define(stage, "/elsewhere")
    outside.CreateFilePathAttr(str(vdb))
    outside.AddTranslateOp().Set(Gf.Vec3d(0, 0, 9))
    volume.CreateFieldRelationship("heat", "/elsewhere")
    read = translate(stage)
    assert read.prims["/v/f"].world_from_field[:3, 3].tolist() == [1, 1, 0]
    assert read.prims["/elsewhere"].world_from_field[:3, 3].tolist() == [0, 0, 9]
    assert dict(read.prims["/v"].fields) == {"density": "/v/f", "heat": "/elsewhere"}
    assert read.prims["/v"].material is None
    assert not read.said("/v", "material"), "the core says that there is none"


def test_field_name_picks_the_grid_and_the_relationship_is_the_fallback(vdb):
    stage = Usd.Stage.CreateInMemory()
    _, field = _volume(stage, vdb, rel="smoke")
    assert translate(stage).prims["/v/f"].grid == "smoke"
    field.CreateFieldNameAttr("density")
    field.CreateFieldIndexAttr(2)
    read = translate(stage).prims["/v/f"]
    assert (read.grid, read.index) == ("density", 2)


def test_paths_are_relative_to_the_layer_and_may_be_time_sampled(tmp_path, vdb):
    second = tmp_path / "second.vdb"
    second.write_bytes(b"")
    text = """#usda 1.0
def Volume "v" {
    rel field:density = </v/f>
    def OpenVDBAsset "f" {
        asset filePath.timeSamples = { 1: @./grid.vdb@, 2: @second.vdb@, 3: @gone.vdb@ }
        token fieldName = "density"
    }
}
"""
    (tmp_path / "scene.usda").write_text(text)
    stage = tyndall_usd.open_stage(tmp_path / "scene.usda")
    assert translate(stage, time=Usd.TimeCode(1)).prims["/v/f"].path == str(vdb)
    assert translate(stage, time=Usd.TimeCode(2)).prims["/v/f"].path == str(second)
    missing = translate(stage, time=Usd.TimeCode(3))
    assert not missing.of_type(Volume)
    assert missing.said("/v/f", "gone.vdb", "not found")


@pytest.mark.parametrize(
    ("change", "path", "words"),
    [
        (lambda s: s.GetPrimAtPath("/v/f").SetTypeName("Field3DAsset"), "/v/f", ("Field3DAsset",)),
        (
            lambda s: s.GetPrimAtPath("/v").GetRelationship("field:density").SetTargets(["/no"]),
            "/v",
            ("/no",),
        ),
        (lambda s: s.GetPrimAtPath("/v/f").GetAttribute("filePath").Set(""), "/v/f", ("empty",)),
        (lambda s: s.GetPrimAtPath("/v").RemoveProperty("field:density"), "/v", ("no field",)),
    ],
)
def test_fields_that_cannot_be_read_give_a_message(vdb, change, path, words):
    stage = Usd.Stage.CreateInMemory()
    _volume(stage, vdb)
    change(stage)
    read = translate(stage)
    assert read.said(path, *words)
    assert not read.of_type(Volume), "a volume without fields would fill all space"


def test_one_bad_field_leaves_the_others(vdb):
    stage = Usd.Stage.CreateInMemory()
    volume, _ = _volume(stage, vdb)
    UsdVol.OpenVDBAsset.Define(stage, "/v/bad").CreateFilePathAttr("missing.vdb")
    volume.CreateFieldRelationship("heat", "/v/bad")
    assert translate(stage).prims["/v"].fields == [("density", "/v/f")]


def test_instanced_volumes_have_fields_relative_to_the_instance(vdb):
    stage = Usd.Stage.CreateInMemory()
    instancer = UsdGeom.PointInstancer.Define(stage, "/pi")
    UsdGeom.Xform.Define(stage, "/pi/p").AddScaleOp().Set(Gf.Vec3f(2))
    _, field = _volume(stage, vdb, "/pi/p/v")
    UsdGeom.Xformable(field).AddTranslateOp().Set(Gf.Vec3d(0, 3, 0))
    instancer.CreatePrototypesRel().SetTargets(["/pi/p"])
    instancer.CreateProtoIndicesAttr([0, 0])
    instancer.CreatePositionsAttr([Gf.Vec3f(10, 0, 0), Gf.Vec3f(20, 0, 0)])
    instancer.AddTranslateOp().Set(Gf.Vec3d(0, 0, 1))
    read = translate(stage)
    (volume,) = read.of_type(Volume).values()
    np.testing.assert_allclose(read.prims["/pi/p/v/f"].world_from_field[:3, 3], [0, 6, 0])
    assert read.prims[volume.instancer].transforms[:, :3, 3].tolist() == [[10, 0, 1], [20, 0, 1]]


def test_arnold_scene_with_another_field_name_than_the_relationship():
    stage = tyndall_usd.open_stage(shared("data", "arnold_2239", "test.usda"))
    read = translate(stage, time=Usd.TimeCode(2))
    (field,) = read.of_type(Field).values()
    assert field.grid == "voxel_fog_density"
    assert field.path.endswith("torus01.vdb")


def test_case_grids_are_at_the_relationship_names():
    read = translate(tyndall_usd.open_stage(shared("cases", "scenes", "cloud.usda")))
    volume = read.prims["/World/Volumes/v0"]
    assert volume.fields == [("density", "/World/Volumes/v0/density")]
    assert volume.material == "/World/Looks/vol_smoke_grid"
    assert not read.of_type(Instancer)
    assert not read.messages


def test_files_in_packages_are_unpacked(tmp_path, vdb):
    layer = Sdf.Layer.CreateNew(str(tmp_path / "scene.usda"))
    stage = Usd.Stage.Open(layer)
    _volume(stage, "./grid.vdb")
    layer.Save()
    package = tmp_path / "scene.usdz"
    with Sdf.ZipFileWriter.CreateNew(str(package)) as writer:
        writer.AddFile(str(tmp_path / "scene.usda"), "scene.usda")
        writer.AddFile(str(vdb), "grid.vdb")
    field = translate(tyndall_usd.open_stage(package)).prims["/v/f"]
    assert Path(field.path).read_bytes() == vdb.read_bytes()

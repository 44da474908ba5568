"""Frames of one stage: what does not vary in time is read once, what does is read again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import tyndall_usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdVol
from tyndall.dirty import is_same
from tyndall_usd import materials, scene_index
from usd.collector import Collector, translate

if TYPE_CHECKING:
    from pathlib import Path

TIMES = (1.0, 2.0, 2.5, 4.0, 1.0)


def add_mesh(stage: Usd.Stage, path: str) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3, 3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 0, 2, 3])
    return mesh


def add_look(stage: Usd.Stage, path: str) -> UsdShade.Input:
    """Return the roughness of a new material."""
    look = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/shader")
    shader.CreateIdAttr("UsdPreviewSurface")
    look.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return shader.CreateInput("roughness", Sdf.ValueTypeNames.Float)


def vary(attribute: Usd.Attribute, first: object, last: object) -> None:
    attribute.Set(first, 1.0)
    attribute.Set(last, 4.0)


@pytest.fixture
def stage() -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    add_mesh(stage, "/still")
    # A single sample is the value at every time.
    once = add_mesh(stage, "/once").GetPointsAttr()
    once.Set([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], 2.0)
    points = add_mesh(stage, "/points").GetPointsAttr()
    vary(points, [(0, 0, i) for i in range(4)], [(1, i, 0) for i in range(4)])
    moves = UsdGeom.Xform.Define(stage, "/moves").AddTranslateOp()
    vary(moves, Gf.Vec3d(0), Gf.Vec3d(3, 0, 0))
    add_mesh(stage, "/moves/mesh")
    tint = UsdGeom.PrimvarsAPI(UsdGeom.Xform.Define(stage, "/tinted")).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, "constant"
    )
    vary(tint.GetAttr(), [(1, 0, 0)], [(0, 0, 1)])
    add_mesh(stage, "/tinted/mesh")
    parts = add_mesh(stage, "/parts")
    subset = UsdGeom.Subset.CreateGeomSubset(parts, "part", "face", [0], "materialBind")
    vary(subset.GetIndicesAttr(), [0], [1])
    add_look(stage, "/look").Set(0.5)
    vary(add_look(stage, "/shimmer").GetAttr(), 0.1, 0.9)
    for path, look in (("/still", "/look"), ("/points", "/shimmer"), ("/parts/part", "/look")):
        prim = stage.GetPrimAtPath(path)
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material.Get(stage, look))
    return stage


def counted(monkeypatch: pytest.MonkeyPatch, module: object, name: str) -> list[str]:
    """Return the growing list of prims that the reader `name` is called with."""
    read, calls = getattr(module, name), []

    def reader(prim, *args: object, **options: object) -> object:
        calls.append(str(prim.GetPath()))
        return read(prim, *args, **options)

    monkeypatch.setattr(module, name, reader)
    return calls


def test_every_time_is_that_of_a_fresh_index(stage: Usd.Stage) -> None:
    collector = Collector()
    index = tyndall_usd.SceneIndex(stage, collector)
    for time in TIMES:
        index.sync(Usd.TimeCode(time))
        fresh = translate(stage, time=Usd.TimeCode(time))
        assert collector.prims.keys() == fresh.prims.keys()
        for path, prim in fresh.prims.items():
            assert is_same(prim, collector.prims[path]), f"{path} at {time}"


def test_what_does_not_vary_is_read_once(stage: Usd.Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    meshes = counted(monkeypatch, scene_index, "read_mesh")
    looks = counted(monkeypatch, materials, "read_material")
    index = tyndall_usd.SceneIndex(stage, Collector())
    for time in TIMES:
        index.sync(Usd.TimeCode(time))
    reads = {path: meshes.count(path) for path in dict.fromkeys(meshes)}
    many = len(TIMES)
    assert reads == {
        "/still": 1,
        "/once": 1,
        "/points": many,
        "/moves/mesh": 1,
        "/tinted/mesh": many,
        "/parts": many,
    }
    assert (looks.count("/look"), looks.count("/shimmer")) == (1, many)


def test_messages_are_told_at_every_time(stage: Usd.Stage) -> None:
    add_mesh(stage, "/broken").GetFaceVertexIndicesAttr().Set([0, 1, 9, 0, 2, 3])
    index = tyndall_usd.SceneIndex(stage, Collector())
    for time in TIMES:
        index.sync(Usd.TimeCode(time))
        assert [message.path for message in index.messages] == ["/broken"]


def test_edits_between_times_are_seen(stage: Usd.Stage) -> None:
    collector = Collector()
    index = tyndall_usd.SceneIndex(stage, collector)
    index.sync(Usd.TimeCode(1))
    stage.GetPrimAtPath("/still").GetAttribute("points").Set([(0, 0, 5)] * 4)
    stage.GetPrimAtPath("/look/shader").GetAttribute("inputs:roughness").Set(0.25)
    index.sync(Usd.TimeCode(2))
    assert (collector.prims["/still"].points == np.float32((0, 0, 5))).all()
    assert any(node.inputs.get("roughness") == 0.25 for node in collector.prims["/look"].nodes)


def test_grids_of_another_time(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "stage.usda"))
    volume = UsdVol.Volume.Define(stage, "/volume")
    for name in ("smoke", "still"):
        (tmp_path / f"{name}.2.vdb").touch()
        asset = UsdVol.OpenVDBAsset.Define(stage, f"/volume/{name}")
        asset.CreateFieldNameAttr("density")
        asset.CreateFilePathAttr(str(tmp_path / "still.2.vdb"))
        volume.CreateFieldRelationship(name, asset.GetPath())
    for frame in (1, 2):
        (tmp_path / f"smoke.{frame}.vdb").touch()
        path = str(tmp_path / f"smoke.{frame}.vdb")
        stage.GetPrimAtPath("/volume/smoke").GetAttribute("filePath").Set(path, float(frame))
    index = tyndall_usd.SceneIndex(stage, Collector())
    index.sync(Usd.TimeCode(1))
    assert index.grids_at(Usd.TimeCode(1)) == []
    assert index.grids_at(Usd.TimeCode(2)) == [(str(tmp_path / "smoke.2.vdb"), "density", None)]

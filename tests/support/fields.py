"""Volumes of grids under ``tyndall:volume``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pxr import Sdf, UsdGeom, UsdShade, UsdVol

if TYPE_CHECKING:
    from pathlib import Path

    from support.stages import StageBuilder

T = Sdf.ValueTypeNames
TYPES = {"phase": T.Token, "albedo": T.Color3f, "emission": T.Color3f, "blackbodyIntensity": T.Color3f}


def own_medium(stage: StageBuilder, **inputs: Any) -> str:
    """Add a material whose volume is ``tyndall:volume``; an input (factor, field, ...) reads fields."""
    path = f"/World/Own{len(stage.stage.GetPrimAtPath('/World').GetChildren())}"
    material = UsdShade.Material.Define(stage.stage, path)
    shader = UsdShade.Shader.Define(stage.stage, f"{path}/v")
    shader.CreateIdAttr("tyndall:volume")
    for name, value in inputs.items():
        target = shader.CreateInput(name, TYPES.get(name, T.Float))
        if isinstance(value, tuple) and isinstance(value[1], str):
            factor, *names = value
            product = _product(stage, f"{path}/{name}", factor, names)
            target.ConnectToSource(product.ConnectableAPI(), "out")
        else:
            target.Set(value)
    material.CreateVolumeOutput().ConnectToSource(shader.ConnectableAPI(), "out")
    return path


def _product(stage: StageBuilder, path: str, factor: Any, names: list[str]) -> UsdShade.Shader:
    color = factor if isinstance(factor, tuple) else (factor,) * 3
    before = None
    for name in names:
        reader = UsdShade.Shader.Define(stage.stage, f"{path}_{name}")
        reader.CreateIdAttr("ND_geompropvalue_color3")
        reader.CreateInput("geomprop", T.String).Set(name)
        product = UsdShade.Shader.Define(stage.stage, f"{path}_times_{name}")
        product.CreateIdAttr("ND_multiply_color3")
        first = product.CreateInput("in1", T.Color3f)
        if before is None:
            first.Set(color)
        else:
            first.ConnectToSource(before.ConnectableAPI(), "out")
        product.CreateInput("in2", T.Color3f).ConnectToSource(reader.ConnectableAPI(), "out")
        before = product
    assert before is not None
    return before


def fields(stage: StageBuilder, material: str, **files: Path) -> None:
    """Add a volume with these fields."""
    volume = UsdVol.Volume.Define(stage.stage, "/World/Fire")
    for name, path in files.items():
        asset = UsdVol.OpenVDBAsset.Define(stage.stage, f"/World/Fire/{name}")
        asset.CreateFilePathAttr(Sdf.AssetPath(str(path)))
        asset.CreateFieldNameAttr(name)
        volume.CreateFieldRelationship(name, asset.GetPath())
    prim = volume.GetPrim()
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material(stage.stage.GetPrimAtPath(material)))
    assert UsdGeom.Gprim(prim)

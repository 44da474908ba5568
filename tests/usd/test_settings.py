"""UsdRender settings, products, variables, and the tyndall: attributes with their schema."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import tyndall_usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdRender
from support.shared import shared
from tyndall.messages import Messages
from tyndall_usd.read.settings import StageSettings, find_settings, read_settings
from tyndall_usd.schema import generate, table

AOVS = ("rgba", "albedo", "normal", "depth", "position", "samples")
TIME = Usd.TimeCode.Default()


@pytest.fixture
def stage():
    stage = Usd.Stage.CreateInMemory()
    UsdRender.Settings.Define(stage, "/Render/S")
    stage.SetMetadata("renderSettingsPrimPath", "/Render/S")
    return stage


def _read(stage) -> tuple[StageSettings, list[str]]:
    messages = Messages()
    prim = find_settings(stage, messages)
    return read_settings(prim, TIME, messages, known_aovs=AOVS), [str(m) for m in messages]


def test_the_metadata_names_the_settings(stage):
    settings, messages = _read(stage)
    assert settings.path == "/Render/S"
    assert settings.products[0].view.resolution == (2048, 1080), "the schema's own default"
    assert not messages
    stage.SetMetadata("renderSettingsPrimPath", "/nowhere")
    found = Messages()
    assert find_settings(stage, found) is None
    assert len(found) == 1


@pytest.mark.parametrize("name", ["disableMotionBlur", "instantaneousShutter"])
def test_motion_blur_can_be_turned_off(stage, name):
    assert _read(stage)[0].products[0].view.motion_blur
    stage.GetPrimAtPath("/Render/S").GetAttribute(name).Set(True)
    assert not _read(stage)[0].products[0].view.motion_blur


def test_products_win_over_settings(stage):
    settings = UsdRender.Settings(stage.GetPrimAtPath("/Render/S"))
    settings.CreateResolutionAttr(Gf.Vec2i(100, 50))
    settings.CreateAspectRatioConformPolicyAttr("cropAperture")
    UsdGeom.Camera.Define(stage, "/cam")
    settings.CreateCameraRel().SetTargets(["/cam"])
    product = UsdRender.Product.Define(stage, "/Render/P")
    product.CreateResolutionAttr(Gf.Vec2i(20, 10))
    product.CreateProductNameAttr("beauty.####.exr")
    settings.CreateProductsRel().SetTargets(["/Render/P", "/Render/none"])
    names = [("c", "Ci"), ("z", "z"), ("n", "N"), ("own", "albedo"), ("odd", "deep"), ("lpe", "lpe:C<RD>A")]
    for name, source in names:
        UsdRender.Var.Define(stage, f"/Render/{name}").CreateSourceNameAttr(source)
    product.CreateOrderedVarsRel().SetTargets([f"/Render/{name}" for name, _ in names])
    read, messages = _read(stage)
    (made,) = read.products
    assert (made.name, made.aovs) == ("beauty.####.exr", ("rgba", "depth", "normal", "albedo"))
    assert (made.view.resolution, made.view.policy, made.view.camera) == ((20, 10), "cropAperture", "/cam")
    assert len(messages) == 3
    assert any("'deep'" in m for m in messages)


@pytest.mark.parametrize(
    ("attribute", "value", "word"),
    [
        ("dataWindowNDC", (0.25, 0, 1, 1), "dataWindowNDC"),
        ("resolution", Gf.Vec2i(0, 4), "0 x 4"),
        ("aspectRatioConformPolicy", "stretch", "stretch"),
        ("pixelAspectRatio", 0.0, "pixelAspectRatio"),
        ("renderingColorSpace", "acescg", "acescg"),
    ],
)
def test_what_cannot_be_honoured_is_named(stage, attribute, value, word):
    stage.GetPrimAtPath("/Render/S").GetAttribute(attribute).Set(value)
    _, messages = _read(stage)
    assert len(messages) == 1
    assert word in messages[0]


def test_tyndall_attributes_are_settings(stage):
    prim = stage.GetPrimAtPath("/Render/S")
    prim.CreateAttribute("tyndall:samples", Sdf.ValueTypeNames.Int).Set(16)
    prim.CreateAttribute("tyndall:filter", Sdf.ValueTypeNames.Token).Set("box")
    prim.CreateAttribute("tyndall:maxBounce", Sdf.ValueTypeNames.Int).Set(3)
    prim.CreateAttribute("tyndall:seed", Sdf.ValueTypeNames.String).Set("seven")
    prim.CreateAttribute("karma:global:foo", Sdf.ValueTypeNames.Int).Set(3)
    read, messages = _read(stage)
    assert read.renderer == {"samples": 16, "filter": "box"}
    assert len(messages) == 2
    assert "maxBounces" in messages[0]


_SCHEMA_PROGRAM = """
from pxr import Usd
from tyndall_usd.schema import table
from tyndall_usd.stage import register_schemas
register_schemas()
stage = Usd.Stage.CreateInMemory()
prim = stage.DefinePrim("/s", "RenderSettings")
assert prim.CanApplyAPI(table.SCHEMA)
assert not stage.DefinePrim("/x", "Xform").CanApplyAPI(table.SCHEMA)
prim.ApplyAPI(table.SCHEMA)
for setting in table.SETTINGS:
    value = prim.GetAttribute("tyndall:" + setting.name).Get()
    assert value == setting.default, (setting, value)
assert not prim.GetAttribute("tyndall:samples").HasAuthoredValue()
"""


def test_the_schema_is_known_to_usd():
    # In a process of its own: USD learns schemas only before its first stage.
    done = subprocess.run(
        [sys.executable, "-c", _SCHEMA_PROGRAM], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_fallbacks_of_the_schema_are_not_settings(stage):
    stage.GetPrimAtPath("/Render/S").AddAppliedSchema(table.SCHEMA)
    assert _read(stage)[0].renderer == {}


def test_the_schema_files_are_current():
    folder = Path(generate.__file__).parent
    for name, text in generate.files().items():
        assert (folder / name).read_text() == text, "run python -m tyndall_usd.schema.generate"


def test_the_schema_has_the_settings_of_the_core():
    import tyndall

    by_usd_render = {"camera", "resolution", "pixelAspect", "aovs"}
    specs = {spec["name"]: spec for spec in tyndall.setting_specs() if spec["name"] not in by_usd_render}
    settings = {setting.name: setting for setting in table.SETTINGS}
    assert settings.keys() == specs.keys()
    for name, spec in specs.items():
        assert settings[name].default == spec["default"], name
        assert list(settings[name].choices) == list(spec["choices"]), name


def test_several_products_of_a_real_stage():
    path = shared("data", "hdmitsuba_assets", "render_settings", "aovs_multiple_products.usda")
    stage = tyndall_usd.open_stage(path)
    prim = next(p for p in stage.Traverse() if p.GetTypeName() == "RenderSettings")
    messages = Messages()
    read = read_settings(prim, TIME, messages, known_aovs=AOVS)
    assert [(p.name, p.aovs) for p in read.products] == [
        ("output_color.exr", ()),
        ("output_aovs.exr", ("albedo", "normal", "depth")),
    ]
    assert "'raw'" in str(next(iter(messages)))

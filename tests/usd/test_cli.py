"""The command line: arguments, exit codes, messages, and renders through the real core."""

from __future__ import annotations

import json
import os
import signal

import pytest
import tyndall
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdRender
from support import exr
from tyndall_usd.cli import main
from tyndall_usd.cli.arguments import parse
from tyndall_usd.scene_index import HEADLIGHT


@pytest.fixture
def scene(tmp_path):
    """A lit ball with a camera that moves between frames 1 and 3."""
    path = tmp_path / "scene.usda"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.Sphere.Define(stage, "/World/ball")
    UsdLux.DomeLight.Define(stage, "/World/sky")
    camera = UsdGeom.Camera.Define(stage, "/World/main")
    move = camera.AddTranslateOp()
    for frame in (1, 3):
        move.Set(Gf.Vec3d(frame, 0, 8), frame)
    camera.CreateHorizontalApertureAttr(20)
    camera.CreateVerticalApertureAttr(10)
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(3)
    stage.Save()
    return path


def _edit(path, change):
    stage = Usd.Stage.Open(str(path))
    change(stage)
    stage.Save()


FAST = ("--spp", "1", "-r", "16x8", "--threads", "1")


def run(*arguments):
    return main([str(a) for a in arguments])


def render(scene, out, *arguments):
    return run("render", scene, "-o", out, *FAST, *arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--spp", "0"], "--spp"),
        (["--spp", "many"], "many"),
        (["-r", "16"], "1920x1080"),
        (["-r", "0x8"], "at least 1"),
        (["--time", "-1"], "--time"),
        (["--time", "inf"], "--time"),
        (["--max-bounces", "-2"], "negative"),
        (["--filter", "gauss"], "gauss"),
        (["--progress", "dots"], "dots"),
        (["--unknown"], "--unknown"),
        (["-f", "1-5"], "1001:1010x2,1020"),
        (["-f", "1:3"], "####"),
        (["--aov", "rgba", "beautiful"], "beautiful"),
        (["-c", "other"], "/World/main"),
        (["-c", "/World/ball"], "Sphere"),
        (["--settings", "/Render/none"], "/Render/none"),
        (["--settings", "/World/ball"], "not a RenderSettings"),
        (["--purposes", "prox"], "default, render, proxy, guide"),
        (["--variant", "x"], "PRIM:SET=NAME"),
        (["--mask", "World"], "--mask"),
        (["--cache-mode", "write"], "invalid choice"),
        (["--checkpoint", "-1"], "negative"),
        (["--sample-range", "5"], "0:128"),
        (["--sample-range", "64:64"], "no samples"),
        (["--noise-threshold", "-0.01"], "negative"),
        (["--distance-sampling", "nds-"], "nds+"),
        (["--tile-index", "1"], "not available in this version"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_usage_is_one_line_and_exit_code_2(scene, tmp_path, capfd, arguments, words):
    assert render(scene, tmp_path / "o.exr", *arguments) == 2
    error = capfd.readouterr().err.strip()
    assert words in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "o.exr").exists()


@pytest.mark.parametrize("command", ["compare", "bench"])
def test_later_commands_are_refused(command, capfd):
    assert run(command, "x", "--y") == 2
    assert "not available in this version" in capfd.readouterr().err


def test_help_and_nothing(capfd):
    assert run("--help") == 0
    assert run("render", "--help") == 0
    out = capfd.readouterr().out
    assert "--tile-index" not in out, "what does not exist yet is not advertised"
    assert run() == 2
    assert run("render") == 2
    assert run("--version") == 0
    assert tyndall.version in capfd.readouterr().out


def test_list_aovs(capfd):
    assert run("render", "--list-aovs") == 0
    assert "rgba" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("name", "out", "words"),
    [
        ("gone.usda", "o.exr", "gone.usda does not exist"),
        ("scene.usda", "none/o.exr", "--make-output-path"),
    ],
)
def test_missing_files_are_exit_code_1(scene, tmp_path, capfd, name, out, words):
    assert render(scene.parent / name, tmp_path / out) == 1
    assert words in capfd.readouterr().err


def test_gltf_and_other_endings_are_refused(scene, tmp_path, capfd):
    assert render(tmp_path / "x.glb", tmp_path / "o.exr") == 2
    assert "glTF" in capfd.readouterr().err
    assert render(scene, tmp_path / "o.jpg") == 2
    assert ".exr or .png" in capfd.readouterr().err


def test_a_stage_without_a_camera_says_how_to_give_one(scene, tmp_path, capfd):
    _edit(scene, lambda stage: stage.RemovePrim("/World/main"))
    assert render(scene, tmp_path / "o.exr") == 1
    assert "--session-layer" in capfd.readouterr().err


def test_no_output_named(scene, capfd):
    assert run("render", scene) == 2
    assert "-o OUT.exr" in capfd.readouterr().err


def test_spellings_of_usdrecord_and_husk():
    usdrecord = parse(
        ["render", "a.usda", "o.exr", "--frames", "1:2", "-cam", "/c", "--imageWidth", "960", "-rs", "/S"]
    )
    assert (usdrecord.output_argument, usdrecord.camera, usdrecord.width) == ("o.exr", "/c", 960)
    assert usdrecord.settings == "/S"
    husk = parse(
        [
            "render",
            "a.usd",
            "-o",
            "o.$F4.exr",
            "--frame",
            "7",
            "--frame-count",
            "3",
            "--res",
            "64",
            "32",
            "-p",
            "8",
        ]
    )
    assert (husk.frames, husk.frame_count, husk.res, husk.spp) == ("7", 3, [64, 32], 8)


def test_a_render_writes_an_image_and_statistics(scene, tmp_path, capfd):
    out, stats = tmp_path / "o.exr", tmp_path / "s.json"
    assert render(scene, out, "--stats", stats, "--aov", "rgba", "depth") == 0
    assert out.stat().st_size > 0
    report = json.loads(stats.read_text())
    assert report["spp"] == 1
    assert report["seconds"].keys() >= {"load", "translate", "build", "render", "write", "wall", "cpu"}
    assert report["peakMemoryBytes"] > 0
    assert report["frames"][0]["files"] == [str(out)]
    assert str(out) in capfd.readouterr().err


def test_png(scene, tmp_path):
    assert render(scene, tmp_path / "o.png") == 0
    assert (tmp_path / "o.png").stat().st_size > 0


def test_each_frame_has_its_file_and_its_camera(scene, tmp_path, monkeypatch):
    seen = []
    sync_camera = tyndall.RenderDelegate.sync

    def sync(self, path, prim, *bits):
        if path == "/World/main":
            seen.append(prim.world_from_camera[0, 3])
        sync_camera(self, path, prim, *bits)

    monkeypatch.setattr(tyndall.RenderDelegate, "sync", sync)
    assert render(scene, tmp_path / "o.####.exr", "-f", "1:3") == 0
    assert sorted(p.name for p in tmp_path.glob("o.*")) == ["o.0001.exr", "o.0002.exr", "o.0003.exr"]
    assert sorted(set(seen)) == [1, 2, 3]


def test_existing_frames_are_skipped_on_request(scene, tmp_path):
    kept = tmp_path / "o.0002.exr"
    kept.write_text("mine")
    assert render(scene, tmp_path / "o.####.exr", "-f", "1:2", "--skip-existing-frames") == 0
    assert kept.read_text() == "mine"
    assert (tmp_path / "o.0001.exr").exists()


def _settings_of(scene, tmp_path, *arguments):
    """Return the settings a render was made with, by what the session was given."""
    seen = {}
    session = tyndall.Session

    def spy(committed, settings, **options):
        seen.update(settings)
        return session(committed, settings, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tyndall, "Session", spy)
        assert run("render", scene, "-o", tmp_path / "o.exr", "--spp", "1", *arguments) == 0
    return seen


def test_the_width_gives_the_height_by_the_camera(scene, tmp_path):
    assert _settings_of(scene, tmp_path, "-w", "24")["resolution"] == [24, 12]
    assert _settings_of(scene, tmp_path, "--res", "6", "4")["resolution"] == [6, 4]


def test_the_command_line_wins_over_the_stage(scene, tmp_path):
    def change(stage):
        settings = UsdRender.Settings.Define(stage, "/Render/S")
        settings.CreateResolutionAttr(Gf.Vec2i(20, 10))
        settings.CreatePixelAspectRatioAttr(2.0)
        for name, value in (("maxBounces", 3), ("seed", 9)):
            settings.GetPrim().CreateAttribute(f"tyndall:{name}", _int_type()).Set(value)
        stage.SetMetadata("renderSettingsPrimPath", "/Render/S")

    _edit(scene, change)
    used = _settings_of(scene, tmp_path, "--seed", "4", "--time", "0")
    assert (used["resolution"], used["pixelAspect"], used["maxBounces"]) == ([20, 10], 2.0, 3)
    assert used["seed"] == 4
    assert 0 < used["timeLimit"] < 1e-6, "no more than the first pass"


def _int_type():
    from pxr import Sdf

    return Sdf.ValueTypeNames.Int


def test_products_name_the_files(scene, tmp_path, monkeypatch):
    def change(stage):
        settings = UsdRender.Settings.Define(stage, "/Render/S")
        settings.CreateResolutionAttr(Gf.Vec2i(8, 4))
        products = []
        for name, aov in (("one", "color"), ("two", "Z")):
            product = UsdRender.Product.Define(stage, f"/Render/{name}")
            product.CreateProductNameAttr(f"{name}.exr")
            UsdRender.Var.Define(stage, f"/Render/v_{name}").CreateSourceNameAttr(aov)
            product.CreateOrderedVarsRel().SetTargets([f"/Render/v_{name}"])
            products.append(product.GetPath())
        settings.CreateProductsRel().SetTargets(products)

    _edit(scene, change)
    monkeypatch.chdir(tmp_path)
    assert run("render", scene, "--settings", "/Render/S", "--spp", "1") == 0
    assert (tmp_path / "one.exr").exists()
    assert (tmp_path / "two.exr").exists()


def test_strict_tells_by_the_exit_code(scene, tmp_path, capfd):
    assert render(scene, tmp_path / "a.exr", "--strict") == 0
    _edit(scene, lambda stage: stage.DefinePrim("/World/curves", "BasisCurves"))
    assert render(scene, tmp_path / "b.exr") == 0
    assert render(scene, tmp_path / "c.exr", "--strict") == 3
    assert (tmp_path / "c.exr").exists()
    assert capfd.readouterr().err.count("</World/curves>") == 2, "once a run"


def test_the_log_is_json_on_request(scene, tmp_path, capfd):
    _edit(scene, lambda stage: stage.DefinePrim("/World/curves", "BasisCurves"))
    assert render(scene, tmp_path / "o.exr", "--log-json") == 0
    lines = [json.loads(line) for line in capfd.readouterr().err.splitlines()]
    assert any(line.get("path") == "/World/curves" and line["level"] == "warning" for line in lines)


def test_quiet_says_nothing(scene, tmp_path, capfd):
    assert render(scene, tmp_path / "o.exr", "-q") == 0
    captured = capfd.readouterr()
    assert captured.err == captured.out == ""


def test_farms_read_the_progress(scene, tmp_path, capfd):
    assert render(scene, tmp_path / "o.exr", "--progress", "alfred") == 0
    lines = capfd.readouterr().out.splitlines()
    assert all(line.startswith("ALF_PROGRESS ") and line.endswith("%") for line in lines)


def test_the_bar_and_lines_do_not_fail(scene, tmp_path):
    assert render(scene, tmp_path / "o.exr", "--progress", "bar") == 0
    assert render(scene, tmp_path / "o.exr", "--progress", "lines") == 0


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_render_writes_what_it_has(scene, tmp_path, capfd, which):
    out = tmp_path / "o.exr"
    session = tyndall.Session

    class Interrupting:
        def __init__(self, *arguments, **options):
            self._session = session(*arguments, **options)

        def __getattr__(self, name):
            return getattr(self._session, name)

        def render(self, _report, checkpoint, frame):
            def report(progress):
                if progress.samples_done:
                    os.kill(os.getpid(), which)
                return None

            return self._session.render(report, checkpoint, frame)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tyndall, "Session", Interrupting)
        code = run("render", scene, "-o", out, "-r", "64x64", "--spp", "1000000", "--threads", "1")
    assert code == 130
    assert out.stat().st_size > 0
    assert "interrupted" in capfd.readouterr().err


@pytest.mark.parametrize("kind", ["dome", "distant"])
def test_a_headlight_is_for_stages_without_lights(scene, tmp_path, monkeypatch, kind):
    seen = {}
    sync = tyndall.RenderDelegate.sync

    def spy(self, path, prim, *bits):
        seen[path] = prim
        sync(self, path, prim, *bits)

    monkeypatch.setattr(tyndall.RenderDelegate, "sync", spy)
    assert render(scene, tmp_path / "a.exr", "--headlight", kind) == 0
    assert HEADLIGHT not in seen
    _edit(scene, lambda stage: stage.RemovePrim("/World/sky"))
    assert render(scene, tmp_path / "a.exr", "--headlight", kind, "--strict") == 0
    assert seen[HEADLIGHT].kind == kind


def test_several_cameras_are_named(scene, tmp_path, capfd):
    _edit(scene, lambda stage: UsdGeom.Camera.Define(stage, "/World/other"))
    assert render(scene, tmp_path / "o.exr") == 0
    error = capfd.readouterr().err
    assert "/World/other" in error
    assert "--camera" in error
    assert render(scene, tmp_path / "o.exr", "-c", "other", "--strict") == 0


def test_metadata_tells_how_the_image_was_made(scene, tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    assert render(scene, tmp_path / "o.exr", "--seed", "5") == 0
    header = OpenEXR.File(str(tmp_path / "o.exr")).header()
    assert header["tyndall:samples"] == "1"
    assert header["tyndall:settings:seed"] == "5"
    assert header["tyndall:input"] == "scene.usda"
    assert header["tyndall:version"] == tyndall.version


def test_info_lists_what_is_there(scene, capfd):
    _edit(scene, lambda stage: stage.DefinePrim("/World/curves", "BasisCurves"))
    assert run("info", scene) == 0
    text = capfd.readouterr().out
    for words in ("1 Sphere", "/World/main", "frames: 1 to 3", "</World/curves>"):
        assert words in text
    assert run("info", scene, "--json") == 0
    info = json.loads(capfd.readouterr().out)
    assert info["cameras"] == ["/World/main"]
    assert info["prims"]["DomeLight"] == 1


def test_an_open_shutter_blurs_until_it_is_told_not_to(scene, tmp_path, capfd):
    images = {}

    def rendered(name, *options):
        path = tmp_path / f"{name}.exr"
        assert render(scene, path, "--frames", "2", *options) == 0
        images[name] = exr.read_rgb(path)
        return capfd.readouterr().err

    rendered("still")
    _edit(scene, lambda stage: UsdGeom.Camera.Get(stage, "/World/main").CreateShutterCloseAttr(0.5))
    assert "moves while" not in rendered("blurred"), "cameras are blurred"
    rendered("told", "--disable-motionblur")
    assert (images["told"] == images["still"]).all()
    assert (images["blurred"] != images["still"]).any()

    def move(stage, path):
        place = UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddTranslateOp()
        # At frame 2 it is where it was.
        for frame in (1, 3):
            place.Set(Gf.Vec3d(0, frame - 2, 0), frame)

    _edit(scene, lambda stage: move(stage, "/World/ball"))
    assert "moves while" not in rendered("ball"), "surfaces are blurred"
    rendered("held", "--disable-motionblur")
    assert (images["ball"] != images["blurred"]).any()
    assert (images["held"] == images["still"]).all()

    def add_lamp(stage):
        UsdLux.SphereLight.Define(stage, "/World/lamp")
        move(stage, "/World/lamp")

    _edit(scene, add_lamp)
    told = rendered("lamp")
    assert "/World/lamp" in told
    assert "moves while the shutter is open" in told

"""Guiding caches on disk: what is said of them, and that no file is lost."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from support import exr
from support.cli import read_stats, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path


def stage(folder: Path, light: float = 5.0) -> Path:
    builder = StageBuilder(24, 16)
    builder.camera((0, 0, 6), (0, 0, 0), vfov=40)
    builder.quad((-2, -2, -2), (4, 0, 0), (0, 4, 0), builder.lambert(0.6))
    builder.box((-3, -3, -3), (3, 3, 3), builder.medium(0.3, 0.9))
    builder.sphere_light((1.0, 1.5, 0.5), 0.3, light)
    return builder.save(folder / f"stage{light:g}.usda")


def render(folder: Path, source: Path, *arguments: object) -> tuple[Any, dict[str, Any], dict[str, str]]:
    image, stats = folder / "image.exr", folder / "stats.json"
    guided = ("--guiding", "on", "--distance-sampling", "odds", "--spp", 4)
    text = [str(argument) for argument in (*guided, *arguments)]
    run = tyndall("render", source, "-o", image, "--stats", stats, *text)
    header = {name: str(value) for name, value in exr.read_header(image).items()}
    return run, read_stats(stats)["statistics"]["cache"], header


def test_a_cache_is_made_hit_and_forgotten(tmp_path: Path) -> None:
    source, file = stage(tmp_path), tmp_path / "shot.tyc"
    run, cache, header = render(tmp_path, source, "--cache", file)
    assert (run.code, cache["status"]) == (0, "rebuilt"), run.text
    assert header["tyndall:cache:status"] == "rebuilt"
    run, cache, _ = render(tmp_path, source, "--cache", file)
    assert cache["status"] == "hit"
    assert "hit" in run.text
    before = file.read_bytes()
    run, cache, _ = render(tmp_path, source, "--cache", file, "--cache-mode", "read", "-r", "12x8")
    assert (cache["status"], cache["why"]) == ("partly stale", "changed: camera")
    run, cache, _ = render(tmp_path, stage(tmp_path, 7.0), "--cache", file, "--cache-mode", "read")
    assert (cache["status"], cache["why"]) == ("rebuilt", "changed: lights")
    assert file.read_bytes() == before, "read only"


@pytest.mark.parametrize("mode", ["auto", "read"])
def test_a_damaged_cache_is_named_and_kept(tmp_path: Path, mode: str) -> None:
    source, file = stage(tmp_path), tmp_path / "shot.tyc"
    render(tmp_path, source, "--cache", file)
    damaged = bytearray(file.read_bytes())
    damaged[len(damaged) // 2] ^= 16
    file.write_bytes(damaged)
    run, cache, _ = render(tmp_path, source, "--cache", file, "--cache-mode", mode)
    assert (run.code, cache["status"]) == (0, "ignored")
    assert "shot.tyc" in run.text
    assert "checksum" in run.text
    assert file.read_bytes() == damaged
    run, _, _ = render(tmp_path, source, "--cache", file, "--cache-mode", mode, "--strict")
    assert run.code == 3
    _, cache, _ = render(tmp_path, source, "--cache", file, "--cache-mode", "train")
    assert (cache["status"], file.read_bytes() != damaged) == ("rebuilt", True)


def test_a_file_of_another_kind_is_never_replaced(tmp_path: Path) -> None:
    source, file = stage(tmp_path), tmp_path / "holiday.jpg"
    file.write_bytes(b"not a cache")
    for mode in ("auto", "read", "train"):
        run, cache, _ = render(tmp_path, source, "--cache", file, "--cache-mode", mode)
        assert (run.code, cache["status"]) == (0, "ignored")
        assert "is not a guiding cache" in run.text
        assert file.read_bytes() == b"not a cache"


def test_info_tells_what_a_cache_holds(tmp_path: Path) -> None:
    source, file = stage(tmp_path), tmp_path / "shot.tyc"
    render(tmp_path, source, "--cache", file, "--cache-mode", "train")
    run = tyndall("cache", "info", file)
    assert run.code == 0, run.text
    for text in ("learned 3 times", "24x16", "geometry", "lobes", "(4 spp)"):
        assert text in run.text, text
    info = json.loads(tyndall("cache", "info", file, "--json").out)
    assert info["image"]["samplesPerPixel"] == pytest.approx(4.0)
    assert tyndall("cache", "info", source).code == 1
    assert tyndall("cache", "info", tmp_path / "nothing.tyc").code == 1
    assert tyndall("cache").code == 2

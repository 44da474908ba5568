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


def stage(folder: Path, light: float = 5.0, *, lamp: float = 1.0) -> Path:
    builder = StageBuilder(24, 16)
    builder.camera((0, 0, 6), (0, 0, 0), vfov=40)
    builder.quad((-2, -2, -2), (4, 0, 0), (0, 4, 0), builder.lambert(0.6))
    builder.box((-3, -3, -3), (3, 3, 3), builder.medium(0.3, 0.9))
    builder.sphere_light((lamp, 1.5, 0.5), 0.3, light)
    return builder.save(folder / f"stage{light:g}.{lamp:g}.usda")


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
    run, cache, _ = render(tmp_path, stage(tmp_path, lamp=1.2), "--cache", file, "--cache-mode", "read")
    assert (cache["status"], cache["why"]) == ("partly stale", "changed: geometry")
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


def caches(folder: Path, seeds: tuple[int, ...] = (1, 2, 3), light: float = 5.0) -> list[Path]:
    """Return caches that machines with these seeds learned."""
    source, files = stage(folder, light), []
    for seed in seeds:
        file = folder / f"{seed}.tyc"
        render(folder, source, "--cache", file, "--cache-mode", "train", "--seed", seed)
        files.append(file)
    return files


def test_merged_caches_hold_what_all_learned_in_any_order(tmp_path: Path) -> None:
    files = caches(tmp_path)
    infos = [json.loads(tyndall("cache", "info", file, "--json").out) for file in files]
    merged = [tmp_path / "merged.tyc", tmp_path / "again.tyc"]
    for output, order in zip(merged, (files, files[::-1]), strict=True):
        run = tyndall("cache", "merge", *order, "-o", output)
        assert run.code == 0, run.text
    assert merged[0].read_bytes() == merged[1].read_bytes()
    assert tyndall("cache", "verify", *merged, *files).out.count("sound") == 5
    info = json.loads(tyndall("cache", "info", merged[0], "--json").out)
    for name in ("lessons", "samples"):
        assert info[name] == sum(each[name] for each in infos)
    assert info["field"]["samples"] == sum(each["field"]["samples"] for each in infos)
    assert info["image"]["samplesPerPixel"] == pytest.approx(12.0)
    _, cache, _ = render(tmp_path, stage(tmp_path), "--cache", merged[0], "--cache-mode", "read")
    assert cache["status"] == "hit"


def test_caches_of_other_light_are_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    files = [*caches(tmp_path, (1,)), *caches(tmp_path / "other", (2,), light=9.0)]
    output = tmp_path / "merged.tyc"
    run = tyndall("cache", "merge", *files, "-o", output)
    assert run.code == 1, run.text
    assert "lights differ" in run.err
    assert all(str(file) in run.err for file in files)
    assert not output.exists()
    output.write_bytes(b"a picture")
    assert tyndall("cache", "merge", files[0], "-o", output).code == 1
    assert output.read_bytes() == b"a picture"


def test_verify_finds_every_damaged_file(tmp_path: Path) -> None:
    sound, damaged = caches(tmp_path, (1, 2))
    content = bytearray(damaged.read_bytes())
    content[-5] ^= 1
    damaged.write_bytes(content)
    run = tyndall("cache", "verify", damaged, sound, tmp_path / "nothing.tyc")
    assert run.code == 1, run.text
    assert f"{sound}: sound" in run.out
    assert "2.tyc" in run.err
    assert "checksum" in run.err
    assert "nothing.tyc" in run.err
    assert tyndall("cache", "verify", sound).code == 0


def test_prune_makes_caches_smaller(tmp_path: Path) -> None:
    (file,) = caches(tmp_path, (1,))
    size, output = file.stat().st_size, tmp_path / "small.tyc"
    assert tyndall("cache", "prune", file, "--drop", "image", "-o", output).code == 0
    info = json.loads(tyndall("cache", "info", output, "--json").out)
    assert info["image"] is None
    assert info["field"] is not None
    limit = output.stat().st_size - 1
    assert tyndall("cache", "prune", file, "--max-size", limit, "-o", output).code == 0
    assert output.stat().st_size <= limit
    assert tyndall("cache", "verify", output).code == 0
    run = tyndall("cache", "prune", file, "--max-size", 9)
    assert (run.code, file.stat().st_size) == (1, size), run.text
    assert "cannot be made as small" in run.err
    assert tyndall("cache", "prune", file, "--max-size", "big").code == 2


def test_a_scene_that_is_known_is_not_learned_again(tmp_path: Path) -> None:
    """An exact hit guides from the first sample, takes no lessons, and leaves the file as it is."""
    source, file = stage(tmp_path), tmp_path / "shot.tyc"
    render(tmp_path, source, "--cache", file, "--cache-mode", "train", "--spp", 128)
    before = file.read_bytes()
    _, cache, header = render(tmp_path, source, "--cache", file, "--spp", 16)
    assert cache["status"] == "hit"
    assert file.read_bytes() == before
    statistics = read_stats(tmp_path / "stats.json")["statistics"]
    assert statistics["guidedEvents"] > 0
    assert statistics["seconds"]["train"] == 0
    assert "tyndall:guide:trainSeconds" in header
    # A scene that was hardly looked at is learned on.
    render(tmp_path, source, "--cache", file, "--cache-mode", "train", "--spp", 16)
    render(tmp_path, source, "--cache", file, "--spp", 16)
    assert read_stats(tmp_path / "stats.json")["statistics"]["seconds"]["train"] > 0
    assert json.loads(tyndall("cache", "info", file, "--json").out)["samples"] == 32

# SPDX-License-Identifier: GPL-3.0-or-later
"""The guiding cache of a shot: where its file is, what is in it, what the last render made of it."""

from __future__ import annotations

import string
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import tyndall
from tyndall.cache import describe, status

if TYPE_CHECKING:
    from collections.abc import Iterable

#: What may stand in a path in braces.
PLACEHOLDERS = ("blend", "scene", "layer", "camera")

#: What the last final render of a scene said about its cache, or what the next one would.
_LAST: dict[str, str] = {}
#: What was read from a file last: panels are drawn often.
_READ: dict[Path, tuple[tuple[int, int], list[str]]] = {}
#: Scenes whose next final render learns anew, whatever their settings say.
_TRAINING: set[str] = set()


class PathError(ValueError):
    """A cache path that names no file, with what to do about it."""


def file_of(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Path | None:
    """Return the cache's file, placeholders filled in; ``None`` if the scene has none.

    Raises
    ------
    PathError
        Of an unknown placeholder, or a path beside a .blend file that has never been saved.
    """
    template = scene.tyndall.cache_path
    if not template or scene.tyndall.cache_mode == "off":
        return None
    if template.startswith("//") and not bpy.data.filepath:
        raise PathError(f"the cache path {template} is relative to a file that is not saved yet; save it")
    names = {
        "blend": Path(bpy.data.filepath).stem or "untitled",
        "scene": scene.name,
        "layer": layer.name,
        "camera": scene.camera.name if scene.camera else "none",
    }
    try:
        fields = [field for _, field, _, _ in string.Formatter().parse(template) if field is not None]
    except ValueError as error:
        raise PathError(f"the cache path {template}: {error}") from None
    unknown = [field for field in fields if field not in names]
    if unknown:
        known = ", ".join(f"{{{name}}}" for name in PLACEHOLDERS)
        raise PathError(f"the cache path has {{{unknown[0]}}}, which means nothing; there are {known}")
    safe = {name: _file_name(value) for name, value in names.items()}
    return Path(bpy.path.abspath(template.format_map(safe)))


def _file_name(name: str) -> str:
    """Return a data-block's name without what would lead to another folder."""
    return name.replace("/", "_").replace("\\", "_")


def final_settings(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> dict[str, Any]:
    """Return the core's settings about the cache of a final render; its folder is made."""
    file = file_of(scene, layer)
    if file is None:
        return {"cachePath": ""}
    if scene.tyndall.cache_mode != "read":
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise PathError(f"the cache's folder {file.parent} cannot be made: {error.strerror}") from None
    mode = {"cacheMode": "train"} if scene.name in _TRAINING else {}
    return {"cachePath": str(file), **mode}


def viewport_settings(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> dict[str, Any]:
    """Return the same of a viewport: it uses a cache if there is one, and never writes it."""
    try:
        file = file_of(scene, layer)
    except PathError:
        file = None
    if file is None or not file.is_file():
        return {"cachePath": ""}
    return {"cachePath": str(file), "cacheMode": "read"}


def reading_settings(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> dict[str, Any]:
    """Return the same of a final render that leaves the file as it is."""
    return {"cachePath": str(file_of(scene, layer) or ""), "cacheMode": "read"}


def train_next(scene: bpy.types.Scene) -> None:
    """Have the scene's next final render begin its cache anew."""
    _TRAINING.add(scene.name)


def remember(scene: bpy.types.Scene, statistics: dict[str, Any]) -> None:
    """Note what a final render did with its cache."""
    _TRAINING.discard(scene.name)
    if "cache" not in statistics:
        _LAST.pop(scene.name, None)
        return
    said = status(statistics)
    _LAST[scene.name] = f"last render: {said or 'not used, nothing was guided'}"


def remember_worth(scene: bpy.types.Scene, worth: dict[str, Any]) -> str:
    """Note, and return in words, what the next final render would make of its cache."""
    why = f" ({worth['why']})" if worth["why"] else ""
    said = {
        "hit": "the next render uses all of it",
        "partly stale": f"the next render uses it at a quarter of its weight{why}",
        "rebuilt": f"the next render learns from nothing{why}",
        "ignored": f"the next render leaves it alone{why}",
    }[worth["status"]]
    _LAST[scene.name] = said
    return said


def lines(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Iterable[str]:
    """Return what a panel says about the cache."""
    try:
        file = file_of(scene, layer)
    except PathError as error:
        return [str(error)]
    if file is None:
        return ["no cache"]
    last = [_LAST[scene.name]] if scene.name in _LAST else []
    return [str(file), *_content(file), *last]


def _content(file: Path) -> list[str]:
    try:
        state = file.stat()
    except OSError:
        return ["no such file yet; the next render makes it"]
    stamp = (state.st_mtime_ns, state.st_size)
    known = _READ.get(file)
    if known is None or known[0] != stamp:
        try:
            said = describe(tyndall.read_cache_info(file))
        except tyndall.FileError as error:
            said = [str(error)]
        _READ[file] = known = (stamp, said)
    return known[1]

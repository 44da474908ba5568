"""Tyndall, a production volume renderer: describe a shot to a `RenderDelegate`, render it with a `Session`.

Examples
--------
>>> import tyndall
>>> delegate = tyndall.RenderDelegate()
>>> delegate.sync("/ball", tyndall.prims.Shape(kind="sphere", params={"radius": 1.0}))
>>> delegate.sync("/sky", tyndall.prims.Light(kind="dome"))
>>> delegate.sync("/camera", tyndall.prims.Camera())
>>> film = tyndall.Session(delegate.commit(), {"samples": 16}).render()
>>> film.write("ball.exr", None, {})
"""

from __future__ import annotations

from tyndall import prims
from tyndall._core import (
    AovInfo,
    Diagnostic,
    Error,
    Field,
    FileError,
    Film,
    Progress,
    RenderError,
    Scene,
    SceneError,
    Session,
    SettingsError,
    list_aovs,
    merge_caches,
    prune_cache,
    read_cache_info,
    read_vdb_info,
    sample_grid,
    setting_specs,
    version,
    write_vdb,
)
from tyndall.delegate import DirtyBits, RenderDelegate

__all__ = [
    "AovInfo",
    "Diagnostic",
    "DirtyBits",
    "Error",
    "Field",
    "FileError",
    "Film",
    "Progress",
    "RenderDelegate",
    "RenderError",
    "Scene",
    "SceneError",
    "Session",
    "SettingsError",
    "list_aovs",
    "merge_caches",
    "prims",
    "prune_cache",
    "read_cache_info",
    "read_vdb_info",
    "sample_grid",
    "setting_specs",
    "version",
    "write_vdb",
]

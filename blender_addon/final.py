# SPDX-License-Identifier: GPL-3.0-or-later
"""Final renders and material previews."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import tyndall
from tyndall.cache import metadata
from tyndall.messages import Messages

from . import cache, compat, messages, passes
from .properties import render_settings
from .sync import camera as cameras
from .sync.motion import ACTION, STILL, Motions, read_motions
from .sync.scene import SceneSync

if TYPE_CHECKING:
    import bpy

#: Previews are small and many.
_PREVIEW_SAMPLES = 16
#: Seconds between two pictures shown while rendering.
_SHOW_EVERY = 1.0
#: Seconds between two lines about progress: each has Blender draw its window, and Esc is not heard meanwhile.
_TELL_EVERY = 0.25


class RenderFailure(Exception):
    """A render that cannot be made, with what to do about it."""


#: Scenes kept between frames and renders, by scene and view layer; only with Blender's persistent data.
_KEPT: dict[tuple[int, str], SceneSync] = {}


def forget_all() -> None:
    """Free all scenes that are kept."""
    _KEPT.clear()


def note_updates(depsgraph: bpy.types.Depsgraph) -> None:
    """Have kept scenes read what changed; Blender's list is complete for a depsgraph that is kept."""
    changed = changed_geometry(depsgraph)
    for sync in _KEPT.values():
        sync.forget(changed)


def changed_geometry(depsgraph: bpy.types.Depsgraph) -> set[int]:
    """Return the session uids of objects and data whose geometry changed."""
    return {
        compat.session_uid(update.id.original) for update in depsgraph.updates if update.is_updated_geometry
    }


def render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
    """Render one view layer into the engine's result."""
    engine.update_stats("", "Reading the scene")
    motions = STILL if engine.is_preview else read_motions(depsgraph, engine.frame_set)
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    frame = cameras.read_frame(scene.render)
    sync = _scene_sync(engine, depsgraph)
    sync.sync(depsgraph, is_transparent=scene.render.film_transparent, motions=motions)
    _sync_camera(engine.camera_override or scene.camera, depsgraph, sync, frame, motions)
    wanted = passes.wanted(layer)
    for name in passes.missing(layer):
        sync.delegate.report("warning", "", f"there is no {name} pass", "it stays empty")
    settings = _settings(scene, layer, frame, wanted)
    if engine.is_preview:
        settings |= {"samples": min(settings["samples"], _PREVIEW_SAMPLES), "cachePath": ""}
    else:
        settings |= cache.final_settings(scene, layer)
    engine.update_stats("", "Building")
    session = tyndall.Session(sync.delegate.commit(), settings)
    if not engine.is_preview:
        _publish(engine, depsgraph, session)
    _Render(engine, session, wanted, layer.name, is_transparent=scene.render.film_transparent).run(
        float(scene.frame_current)
    )
    if not engine.is_preview:
        cache.remember(scene, session.statistics)


def what_the_cache_is_worth(depsgraph: bpy.types.Depsgraph) -> dict[str, Any]:
    """Return what the core says of the view layer's cache, as a render that reads it would; none is made.

    A depsgraph that is not a render's has the modifiers and the visibility of viewports. It stays at its
    time: to go to another would undo what was moved and not keyed.
    """
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    frame = cameras.read_frame(scene.render)
    sync = SceneSync()
    sync.sync(depsgraph, is_transparent=scene.render.film_transparent)
    _sync_camera(scene.camera, depsgraph, sync, frame, STILL)
    settings = _settings(scene, layer, frame, passes.wanted(layer)) | cache.reading_settings(scene, layer)
    return tyndall.Session(sync.delegate.commit(), settings).statistics["cache"]


def _settings(
    scene: bpy.types.Scene, layer: bpy.types.ViewLayer, frame: cameras.Frame, wanted: list[passes.Pass]
) -> dict[str, Any]:
    """Return the core's settings but those of the cache."""
    settings = render_settings(scene) | {
        "camera": cameras.PATH,
        "resolution": list(frame.resolution),
        "pixelAspect": frame.pixel_aspect,
        "aovs": list(dict.fromkeys(p.aov for p in wanted)),
    }
    if layer.samples > 0:
        settings["samples"] = layer.samples
    return settings


def _scene_sync(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> SceneSync:
    if engine.is_preview or not depsgraph.scene_eval.render.use_persistent_data:
        return SceneSync()
    key = (compat.session_uid(depsgraph.scene), depsgraph.view_layer_eval.name)
    return _KEPT.setdefault(key, SceneSync())


def _sync_camera(
    camera: bpy.types.Object | None,
    depsgraph: bpy.types.Depsgraph,
    sync: SceneSync,
    frame: cameras.Frame,
    motions: Motions,
) -> None:
    if camera is None:
        raise RenderFailure("the scene has no camera; add one and make it the scene's")
    camera = camera.evaluated_get(depsgraph)
    said = Messages()
    read = cameras.read_camera(camera, frame, f"/{camera.name_full}", said)
    if motions.zooms:
        said.warning(f"/{camera.name_full}", "its lens changes while the shutter is open", ACTION)
    keys = () if motions.camera is None else motions.camera.keys()
    sync.sync_camera(replace(read, motion=keys), said)


def _publish(
    engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph, session: tyndall.Session
) -> None:
    report = messages.Report(session.diagnostics)
    messages.publish(depsgraph.scene.name, report)
    report.log()
    errors, warnings = report.count("error"), report.count("warning")
    if not errors and not warnings:
        return
    if depsgraph.scene_eval.tyndall.strict:
        raise RenderFailure(f"strict, and not all can be rendered as asked:\n{report.text()}")
    first = next(what for severity, what, _, _ in report.rows() if severity in ("error", "warning"))
    text = (
        f"{errors} errors, {warnings} warnings about the scene; first: {first}. All are in the Report panel"
    )
    engine.report({"WARNING"}, f"Tyndall: {text}")


class _Render:
    """One running render and the result it is shown in."""

    def __init__(
        self,
        engine: bpy.types.RenderEngine,
        session: tyndall.Session,
        wanted: list[passes.Pass],
        layer: str,
        *,
        is_transparent: bool,
    ) -> None:
        self._engine = engine
        self._session = session
        self._wanted = wanted
        self._layer = layer
        self._is_transparent = is_transparent
        self._shown_at = 0.0
        self._told_at = -_TELL_EVERY

    def run(self, frame: float) -> None:
        """Render until the end, a limit or Esc, and hand over the picture."""
        self._session.preview()
        film = self._session.render(self._progress, None, frame)
        if film.samples > 0:
            self._show(film)
        self._add_metadata(film)

    def _progress(self, progress: tyndall.Progress) -> bool:
        engine = self._engine
        if engine.test_break():
            return False
        if progress.elapsed_secs - self._told_at >= _TELL_EVERY:
            self._told_at = progress.elapsed_secs
            self._tell(progress)
        if not engine.is_preview and progress.elapsed_secs - self._shown_at >= _SHOW_EVERY:
            preview = self._session.preview()
            if preview is not None:
                self._shown_at = progress.elapsed_secs
                self._show_picture(preview[1])
        return True

    def _tell(self, progress: tyndall.Progress) -> None:
        self._engine.update_progress(progress.fraction)
        remaining = progress.remaining_secs
        left = "" if remaining is None else f"Remaining {_clock(remaining)} | "
        done = progress.samples_done / max(progress.samples_total, 1)
        self._engine.update_stats("", f"{left}Samples {100 * done:.0f} %")

    def _show_picture(self, image: np.ndarray) -> None:
        """Show what there is so far; the other passes can wait for the end."""
        height, width, _ = image.shape
        result = self._engine.begin_result(0, 0, width, height, layer=self._layer)
        picture = passes.upright(image, is_transparent=self._is_transparent)
        result.layers[0].passes["Combined"].rect.foreach_set(picture.ravel())
        self._engine.end_result(result)

    def _show(self, film: tyndall.Film) -> None:
        """Copy all passes: one call for all of them is what is fast in every version."""
        width, height = film.resolution
        result = self._engine.begin_result(0, 0, width, height, layer=self._layer)
        target = result.layers[0].passes
        by_name = {p.name: p for p in self._wanted}
        parts = []
        for shown in target:
            known = by_name.get(shown.name)
            if known is None or len(known.channels) != shown.channels:
                parts.append(np.zeros(width * height * shown.channels, np.float32))
            else:
                image = passes.pixels(film, known, is_transparent=self._is_transparent)
                parts.append(image.ravel())
        target.foreach_set("rect", np.concatenate(parts))
        self._engine.end_result(result)

    def _add_metadata(self, film: tyndall.Film) -> None:
        """Say in the file how it was made; Blender keeps fields only of the whole result."""
        result = self._engine.get_result()
        if result is None:
            return
        statistics = self._session.statistics
        fields = {
            "tyndall:version": tyndall.version,
            "tyndall:samples": str(film.samples),
            "tyndall:seconds": f"{statistics['seconds']['render']:.3f}",
            **metadata(statistics),
            **film.cryptomatte_metadata(f"{self._layer}."),
        }
        for name, value in fields.items():
            result.stamp_data_add_field(name, value)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours:d}:{minutes:02d}:{rest:02d}" if hours else f"{minutes:02d}:{rest:02d}"

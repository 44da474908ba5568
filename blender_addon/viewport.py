# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered viewports: a render in a thread of its own, begun anew after every edit, drawn as it gets better.

What is expensive to build survives edits in the core; only what changed is built again.
"""

from __future__ import annotations

import contextlib
import threading
import weakref
from typing import TYPE_CHECKING, Any

import gpu
import numpy as np
import tyndall
from gpu_extras.presets import draw_texture_2d
from tyndall.messages import Messages

from . import cache, messages
from .final import changed_geometry
from .properties import render_settings
from .sync import camera as cameras
from .sync.scene import SceneSync

if TYPE_CHECKING:
    from collections.abc import Callable

    import bpy

#: Largest number of a half float: beyond it, textures turn black.
_HALF_MAX = 65504.0


#: Screen pixels along each side of a pixel in the first picture after an edit.
_COARSE = 4


class Job:
    """One render in a thread; the picture and what went wrong can be asked for at any time."""

    def __init__(
        self, scene: tyndall.Scene, settings: dict[str, Any], notify: Callable[[], None] = lambda: None
    ) -> None:
        """Begin; `notify` is called from the thread when there is something new, and at the end."""
        self._scene = scene
        self._settings = settings
        self._notify = notify
        self.is_running = True
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._image: np.ndarray | None = None
        self.error: str | None = None
        #: Samples per pixel of the last picture; 0 of the coarse one.
        self.samples = 0
        self.has_shown = False
        self.diagnostics: list[tyndall.Diagnostic] = []
        self._thread = threading.Thread(target=self._run, name="tyndall-viewport", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the render and wait for it."""
        self._stop.set()
        # Blender may give the engine up while this thread is the last that holds it.
        if self._thread is not threading.current_thread():
            self._thread.join()

    def take_image(self) -> np.ndarray | None:
        """Return the picture if there is a new one: shape (height, width, 4), row 0 at the bottom."""
        with self._lock:
            image, self._image = self._image, None
        return image

    def _run(self) -> None:
        try:
            self._show_coarsely()
            if not self._stop.is_set():
                self._render()
        except BaseException as error:
            self.error = str(error)
        self.is_running = False
        self._notify()

    def _show_coarsely(self) -> None:
        """Show one sample of few pixels: something to see at once, whatever the size of the view."""
        resolution = [max(n // _COARSE, 1) for n in self._settings["resolution"]]
        settings = self._settings | {"resolution": resolution, "samples": 1, "cachePath": ""}
        film = tyndall.Session(self._scene, settings).render(lambda _: not self._stop.is_set())
        if film.samples > 0:
            self._keep(film.aov("rgba"), samples=0)

    def _render(self) -> None:
        session = tyndall.Session(self._scene, self._settings)
        self.diagnostics = session.diagnostics
        session.preview()

        def progress(_: tyndall.Progress) -> bool:
            if self._stop.is_set():
                return False
            preview = session.preview()
            if preview is not None:
                samples, image = preview
                self._keep(image, samples=samples)
            return True

        film = session.render(progress)
        # A picture with holes is no better than a coarse one, and nobody waits for one that is out of date.
        if film.samples > 0 and not self._stop.is_set():
            self._keep(film.aov("rgba"), samples=film.samples)

    def _keep(self, image: np.ndarray, *, samples: int) -> None:
        image = np.ascontiguousarray(image[::-1])
        with self._lock:
            self._image, self.samples, self.has_shown = image, samples, True
        self._notify()


class Viewport:
    """The state of one viewport."""

    def __init__(self) -> None:
        # Not kept by what it keeps: it goes with its engine, and the copy of the scene with it.
        read_anew = weakref.WeakMethod(self._read_anew)
        self._sync = SceneSync(lambda: living() if (living := read_anew()) else None)
        self._redraw: Callable[[], None] = lambda: None
        self._job: Job | None = None
        self._texture: gpu.types.GPUTexture | None = None
        self._is_synced = False
        self._is_stale = True
        self._shot: tuple[object, ...] = ()
        self._scene_name = ""

    def stop(self) -> None:
        """End the render."""
        if self._job is not None:
            self._job.stop()
            self._job = None

    def _read_anew(self) -> None:
        """Have the scene read again when the viewport is drawn next; called from any thread."""
        self._is_synced = False
        self._redraw()

    def update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Bring the scene up to date."""
        if self._is_synced:
            self._sync.forget(changed_geometry(depsgraph))
        changed = self._sync.sync(depsgraph, is_transparent=_is_transparent(depsgraph))
        self._is_stale |= changed > 0 or not self._is_synced
        self._is_synced = True
        self._scene_name = context.scene.name

    def draw(
        self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Draw the picture; begin a new one if scene, view, size or settings changed."""
        self._redraw = _redraw(engine)
        if not self._is_synced:
            self.update(context, depsgraph)
        region = context.region
        self._follow(engine, context, depsgraph, (region.width, region.height))
        job = self._job
        if job is None:
            return
        image = job.take_image()
        if image is not None:
            self._texture = _upload(image, is_transparent=_is_transparent(depsgraph))
        if self._texture is not None:
            _draw(engine, context.scene, self._texture, (region.width, region.height))
        self._tell(engine, job)

    def _follow(
        self,
        engine: bpy.types.RenderEngine,
        context: bpy.types.Context,
        depsgraph: bpy.types.Depsgraph,
        size: tuple[int, int],
    ) -> None:
        settings = viewport_settings(
            depsgraph.scene_eval,
            depsgraph.view_layer_eval,
            size,
            int(engine.get_preview_pixel_size(context.scene)),
        )
        camera = cameras.read_view(context.region_data, context.space_data.clip_end)
        is_moved = self._sync.sync_camera(camera, Messages())
        shot = tuple(sorted((name, str(value)) for name, value in settings.items()))
        if not (self._is_stale or is_moved or shot != self._shot):
            return
        self.stop()
        self._is_stale, self._shot = False, shot
        self._job = Job(self._sync.delegate.commit(), settings, self._redraw)

    def _tell(self, engine: bpy.types.RenderEngine, job: Job) -> None:
        if job.error:
            engine.update_stats("Tyndall", job.error)
        else:
            engine.update_stats("Tyndall", f"{job.samples} samples")
        if not job.is_running and self._scene_name:
            messages.publish(self._scene_name, messages.Report(job.diagnostics))


def _redraw(engine: bpy.types.RenderEngine) -> Callable[[], None]:
    """Return what has Blender draw anew; it does not keep the engine, whose end ends the render."""
    kept = weakref.ref(engine)

    def redraw() -> None:
        living = kept()
        # Blender frees an engine before Python's side of it goes.
        with contextlib.suppress(ReferenceError):
            if living is not None:
                living.tag_redraw()

    return redraw


def viewport_settings(
    scene: bpy.types.Scene, layer: bpy.types.ViewLayer, size: tuple[int, int], pixel_size: int
) -> dict[str, Any]:
    """Return the core's settings for a viewport of so many pixels."""
    resolution = [max(n // max(pixel_size, 1), 1) for n in size]
    return render_settings(scene) | {
        "camera": cameras.PATH,
        "resolution": resolution,
        "pixelAspect": 1.0,
        "aovs": ["rgba"],
        "samples": scene.tyndall.viewport_samples,
        "timeLimit": 0.0,
        # A cache belongs to the shot, not to looking around in it.
        **cache.viewport_settings(scene, layer),
    }


def _is_transparent(depsgraph: bpy.types.Depsgraph) -> bool:
    return bool(depsgraph.scene_eval.render.film_transparent)


def _upload(image: np.ndarray, *, is_transparent: bool) -> gpu.types.GPUTexture:
    height, width, _ = image.shape
    pixels = np.minimum(image, _HALF_MAX)
    if not is_transparent:
        pixels[..., 3] = 1.0
    buffer = gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel())
    return gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)


def _draw(
    engine: bpy.types.RenderEngine,
    scene: bpy.types.Scene,
    texture: gpu.types.GPUTexture,
    size: tuple[int, int],
) -> None:
    """Draw the texture over the region through the scene's view transform."""
    gpu.state.blend_set("ALPHA_PREMULT")
    engine.bind_display_space_shader(scene)
    draw_texture_2d(texture, (0, 0), *size)
    engine.unbind_display_space_shader()
    gpu.state.blend_set("NONE")

"""Run by Blender with a window: FOLDER plays a story of edits, with screenshots, and writes FOLDER/log.json.

Blender goes on between two steps: the story yields what it waits for.
"""

from __future__ import annotations

import gc
import json
import math
import os
import subprocess
import sys
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import shots  # noqa: E402
import showcase  # noqa: E402

FOLDER = Path(sys.argv[-1])
LOG: dict[str, Any] = {"steps": [], "pictures": {}}
#: Seconds that a step may take; software drawing on a busy machine is slow.
PATIENCE = 240.0
#: Samples per pixel that show what there is.
ENOUGH = 8


def area(kind: str) -> Any:
    """Return an area of the window."""
    return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)


def override(kind: str) -> Any:
    """Return the context of an area's main part."""
    window = bpy.context.window_manager.windows[0]
    found = area(kind)
    region = next(r for r in found.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=found, region=region, screen=window.screen)


def viewport() -> Any:
    """Return the add-on's viewport that renders; Blender gives no way to its engines."""
    living = [o for o in gc.get_objects() if type(o).__name__ == "Viewport" and o._job is not None]
    return living[-1] if living else None


def job() -> Any:
    """Return what the viewport renders."""
    found = viewport()
    return None if found is None else found._job


def screenshot(name: str) -> None:
    """Save the screen, and where on it the viewport is."""
    subprocess.run(["import", "-window", "root", str(FOLDER / f"{name}.png")], check=True)
    place = next((a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"), None)
    window = bpy.context.window_manager.windows[0]
    region = None if place is None else next(r for r in place.regions if r.type == "WINDOW")
    LOG["pictures"][name] = (
        None
        if region is None
        else [region.x, window.height - region.y - region.height, region.width, region.height]
    )


Wait = "tuple[str, Callable[[], bool]]"


def picture_after(name: str, edit: Callable[[], object]) -> Iterator[Any]:
    """Edit, wait for a new render with enough samples, and take a screenshot."""
    before = job()
    start = time.monotonic()
    edit()
    yield f"{name}: new render", lambda: job() is not None and job() is not before
    yield f"{name}: first picture", lambda: job().has_shown or job().error is not None
    first = time.monotonic() - start
    yield f"{name}: samples", lambda: job().samples >= ENOUGH or job().error is not None
    yield f"{name}: drawn", pause(1.0)
    LOG["steps"].append({"name": name, "error": job().error, "samples": job().samples, "first": first})
    screenshot(name)


def pause(seconds: float) -> Callable[[], bool]:
    """Return a condition that comes true by itself."""
    end = time.monotonic() + seconds
    return lambda: time.monotonic() >= end


def build() -> None:
    """A ball in a box of fog on a floor, a lamp, a camera."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    scene.render.engine = "TYNDALL"
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    scene.render.preview_pixel_size = "2"
    scene.render.filepath = str(FOLDER / "render.png")
    scene.render.image_settings.file_format = "PNG"
    shots.set_samples(scene, ENOUGH, 0)
    scene.tyndall.viewport_samples = 4 * ENOUGH
    shots.ball(Base_Color=(0.8, 0.1, 0.05, 1.0))
    shots.material(
        shots.cube(2.2, location=(1.6, 0, 1.1)), "ShaderNodeVolumePrincipled", "Volume", Density=1.0
    )
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.3, 0.4, 0.6, 1)
    ball = bpy.data.objects["Sphere"]
    for frame, z in ((1, 1.0), (10, 2.5)):
        ball.location.z = z
        ball.keyframe_insert("location", index=2, frame=frame)
    scene.frame_set(1)


def open_panels() -> None:
    """What is closed is not drawn, and errors in it are not seen."""
    ui = next(module for name, module in sys.modules.items() if name.endswith("tyndall.ui"))
    ui.unregister()
    for panel in ui._CLASSES:
        panel.bl_options = set()
    ui.register()


def show_rendered() -> None:
    """Look through the camera, rendered, nothing drawn over it."""
    space = area("VIEW_3D").spaces[0]
    space.overlay.show_overlays = False
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "RENDERED"


def edit_node() -> None:
    """Make the ball green."""
    nodes = bpy.data.objects["Sphere"].active_material.node_tree.nodes
    nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.05, 0.8, 0.1, 1.0)


def move_ball() -> None:
    """Move it to the left, with a step to undo."""
    bpy.data.objects["Sphere"].location.x = -1.2
    bpy.ops.ed.undo_push(message="move")


def turn_view() -> None:
    """Leave the camera and look from above."""
    with override("VIEW_3D"):
        bpy.ops.view3d.view_axis(type="TOP")
        bpy.ops.view3d.view_all()


def orbit() -> None:
    """Turn the view as the keyboard does."""
    with override("VIEW_3D"):
        bpy.ops.view3d.view_orbit(angle=math.radians(15), type="ORBITUP")
        bpy.ops.view3d.view_orbit(angle=math.radians(-15), type="ORBITUP")
        bpy.ops.view3d.view_orbit(angle=math.radians(30), type="ORBITLEFT")


def maximize() -> None:
    """Give the viewport all of the window, or what it had."""
    with override("VIEW_3D"):
        bpy.ops.screen.screen_full_area()


def undo() -> None:
    """Take the last step back: Blender makes all data anew."""
    with override("VIEW_3D"):
        bpy.ops.ed.undo()


def viewport_story() -> Iterator[Any]:
    """What artists do in a viewport."""
    open_panels()
    build()
    bpy.ops.ed.undo_push(message="scene")
    yield from picture_after("rendered", show_rendered)
    yield from picture_after("moved", move_ball)
    yield from picture_after("undone", undo)
    yield from picture_after("node", edit_node)
    yield from picture_after("scrubbed", lambda: bpy.context.scene.frame_set(10))
    yield from picture_after("back", lambda: bpy.context.scene.frame_set(1))
    yield from picture_after("top", turn_view)
    yield from picture_after("orbit", orbit)
    yield from picture_after("large", maximize)
    yield from picture_after("small", maximize)
    yield from picture_after("setting", lambda: setattr(bpy.context.scene.tyndall, "max_bounces", 1))
    bpy.context.scene.tyndall.max_bounces = 16
    yield from picture_after(
        "camera", lambda: setattr(area("VIEW_3D").spaces[0].region_3d, "view_perspective", "CAMERA")
    )
    yield "the viewport's last sample", lambda: not job().is_running
    LOG["viewport samples"] = job().samples
    area("VIEW_3D").spaces[0].shading.type = "SOLID"
    yield "the viewport's end", pause(1.0)


def listen_for_stops() -> dict[str, float]:
    """Return what will hold when a render hears of Esc, and when it has handed its picture over."""
    final = next(m for name, m in sys.modules.items() if name.endswith("tyndall.final"))
    times: dict[str, float] = {}
    told, run = final._Render._progress, final._Render.run

    def listening(self: Any, progress: Any) -> bool:
        goes_on = told(self, progress)
        if not goes_on:
            times.setdefault("heard", time.monotonic())
        return goes_on

    def running(self: Any, frame: float) -> None:
        run(self, frame)
        times.setdefault("obeyed", time.monotonic())

    final._Render._progress, final._Render.run = listening, running
    return times


def f12_story() -> Iterator[Any]:
    """F12 to the end, and F12 with Esc."""
    seen: list[str] = []
    bpy.app.handlers.render_complete.append(lambda *_: seen.append("complete"))
    bpy.app.handlers.render_cancel.append(lambda *_: seen.append("cancel"))
    # The frames around this one are read on the thread that renders, and only for this picture.
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    with override("VIEW_3D"):
        bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield "F12", lambda: "complete" in seen
    LOG["frame after F12"] = scene.frame_current_final
    scene.render.use_motion_blur = False
    yield "F12 drawn", pause(1.5)
    screenshot("f12")
    bpy.context.scene.tyndall.samples = 1_000_000
    heard = listen_for_stops()
    with override("VIEW_3D"):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield "a long render", pause(4.0)
    screenshot("esc")
    start = time.monotonic()
    subprocess.run(["xdotool", "key", "Escape"], check=True)
    yield "Esc", lambda: "cancel" in seen
    LOG["esc"] = time.monotonic() - start
    LOG["esc heard"], LOG["esc obeyed"] = heard["heard"] - start, heard["obeyed"] - heard["heard"]
    LOG["renders"] = seen
    bpy.context.scene.tyndall.samples = 256
    yield "the render's end", lambda: not bpy.app.is_job_running("RENDER")
    windows = bpy.context.window_manager.windows
    if len(windows) > 1:
        with bpy.context.temp_override(window=windows[-1]):
            bpy.ops.wm.window_close()
    yield "one window", pause(1.0)


def painter() -> Any:
    """Return what has skies painted."""
    return next(m for name, m in sys.modules.items() if name.endswith("tyndall.sync.sky")).PAINTER


def showcase_story() -> Iterator[Any]:
    """The pictures of the documentation: a shot, the add-on's panels, a material."""
    scene = showcase.build(FOLDER)
    scene.render.preview_pixel_size = "1"
    scene.tyndall.samples = 256
    scene.tyndall.viewport_samples = 6 * ENOUGH
    area("PROPERTIES").spaces[0].context = "RENDER"
    area("OUTLINER").ui_type = "PROPERTIES"
    yield from picture_after("showcase_first", show_rendered)
    yield "the sky", lambda: painter()._running is None and len(painter()._skies) > 0
    yield "the viewport with the sky", pause(2.0)
    for tab in ("MATERIAL", "WORLD"):
        for editor in bpy.context.window_manager.windows[0].screen.areas:
            if editor.type == "PROPERTIES" and editor.spaces[0].context != "RENDER":
                editor.spaces[0].context = tab
                editor.tag_redraw()
        yield "the shot's last sample", lambda: not job().is_running
        yield f"panels {tab}", pause(3.0)
        screenshot(f"showcase_{tab.lower()}")
    LOG["skies"] = [type(sky).__name__ for sky in painter()._skies.values()]
    area("VIEW_3D").spaces[0].shading.type = "SOLID"
    yield "the viewport's end", pause(1.0)


def panel_story() -> Iterator[Any]:
    """Every panel of the properties editor, with the material preview."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    space = area("PROPERTIES").spaces[0]
    with override("VIEW_3D"):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.4)
    divided = area("VIEW_3D")
    divided.ui_type = "PROPERTIES"
    editors = [a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "PROPERTIES"]
    # Until it is drawn, an editor does not know which tabs it has.
    yield "new editors", pause(2.0)
    for tab in ("RENDER", "VIEW_LAYER", "OUTPUT", "WORLD", "MATERIAL", "DATA"):
        for editor in editors:
            editor.spaces[0].context = tab
            editor.tag_redraw()
        yield f"panels {tab}", pause(4.0 if tab == "MATERIAL" else 1.5)
        screenshot(f"panel_{tab.lower()}")
    bpy.context.view_layer.objects.active = bpy.data.objects["AREA"]
    for editor in editors:
        editor.spaces[0].context = "DATA"
        editor.tag_redraw()
    yield "panels of lights", pause(1.5)
    screenshot("panel_light")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=divided, screen=window.screen):
        bpy.ops.screen.area_close()
    # Blender refuses edits by others while it renders the preview of a material.
    yield "the end of previews", pause(3.0)
    LOG["tab"] = space.context


def story() -> Iterator[Any]:
    """All of it."""
    yield "start", pause(2.0)
    LOG["version"], LOG["python"] = bpy.app.version_string, sys.version
    yield from viewport_story()
    yield from f12_story()
    yield from panel_story()
    yield from showcase_story()


def end(problem: str = "") -> None:
    """Write the log and leave."""
    LOG["problem"] = problem
    (FOLDER / "log.json").write_text(json.dumps(LOG, indent=1))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


class Player:
    """Goes on with the story whenever what it waits for is there."""

    def __init__(self) -> None:
        self._story = story()
        self._waiting: tuple[str, Callable[[], bool]] = ("nothing", lambda: True)
        self._since = time.monotonic()

    def __call__(self) -> float:
        try:
            self._step()
        except StopIteration:
            end()
        except Exception:
            screenshot("failure")
            end(traceback.format_exc())
        return 0.05

    def _step(self) -> None:
        name, condition = self._waiting
        if condition():
            self._waiting, self._since = next(self._story), time.monotonic()
        elif time.monotonic() - self._since > PATIENCE:
            raise TimeoutError(f"{name}: nothing happened for {PATIENCE:g} s")


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(Player(), first_interval=1.0, persistent=True)

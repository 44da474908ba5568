# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine as Blender sees it; what it does is in `final.py` and `viewport.py`."""

from __future__ import annotations

import bpy
import tyndall

from . import cache, final, passes, viewport
from .messages import LOG
from .sync.camera import read_frame

#: Viewports by the id of their engine: when Python's side of it goes, Blender may have taken its attributes.
_VIEWS: dict[int, viewport.Viewport] = {}


class TyndallRenderEngine(bpy.types.RenderEngine):
    """Tyndall.

    There is no ``__init__``: since Blender 4.4 it runs twice.
    """

    bl_idname = "TYNDALL"
    bl_label = "Tyndall"
    bl_use_preview = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def update(self, _data: bpy.types.BlendData, depsgraph: bpy.types.Depsgraph) -> None:
        """Take note of what changed since the last render of a scene that is kept."""
        final.note_updates(depsgraph)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render one view layer; whatever goes wrong is reported: that alone makes farms notice."""
        # Blender crashes when it writes an EXR of a render that has never had a result.
        width, height = read_frame(depsgraph.scene_eval.render).resolution
        self.end_result(self.begin_result(0, 0, width, height, layer=depsgraph.view_layer_eval.name))
        try:
            final.render(self, depsgraph)
        except (final.RenderFailure, cache.PathError) as failure:
            self.report({"ERROR"}, f"Tyndall: {failure}")
        except tyndall.Error as error:
            self.report({"ERROR"}, f"Tyndall: {error}")
        except BaseException as error:
            LOG.exception("Tyndall: the render failed")
            self.report({"ERROR"}, f"Tyndall: {type(error).__name__}: {error}; please report this as a bug")

    def update_render_passes(self, _scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
        """Tell Blender which passes there will be."""
        for p in passes.wanted(layer):
            self.register_pass(_scene, layer, p.name, len(p.channels), p.channels, p.kind)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Follow an edit."""
        self._guarded(lambda view: view.update(context, depsgraph))

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw what there is; follow the view."""
        self._guarded(lambda view: view.draw(self, context, depsgraph))

    def _guarded(self, action: object) -> None:
        if id(self) not in _VIEWS:
            _VIEWS[id(self)] = viewport.Viewport()
        try:
            action(_VIEWS[id(self)])  # type: ignore[operator]
        except tyndall.Error as error:
            self.update_stats("Tyndall", str(error))
        except BaseException as error:
            LOG.exception("Tyndall: the viewport failed")
            self.update_stats("Tyndall", f"{type(error).__name__}: {error}")

    def __del__(self) -> None:
        """End the viewport's render."""
        view = _VIEWS.pop(id(self), None)
        if view is not None:
            view.stop()


def register() -> None:
    """Add the engine."""
    bpy.utils.register_class(TyndallRenderEngine)


def unregister() -> None:
    """Remove it."""
    bpy.utils.unregister_class(TyndallRenderEngine)
    final.forget_all()

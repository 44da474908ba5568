# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: settings, passes, caches, report; and Blender's own panels that fit this engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from . import cache, messages, passes, properties
from .engine import TyndallRenderEngine

if TYPE_CHECKING:
    from collections.abc import Iterator

ENGINE = TyndallRenderEngine.bl_idname
_CACHE = ("cachePath", "cacheMode")
_SAMPLING = ("samples", "noiseThreshold", "timeLimit", "maxBounces", "seed", "filter")
#: Panels of Blender's that do not list BLENDER_RENDER, but whose settings we read.
_FROM_EEVEE = (
    *("EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_MATERIAL_PT_volume"),
    *("EEVEE_WORLD_PT_surface", "EEVEE_WORLD_PT_volume", "EEVEE_WORLD_PT_context_world"),
    *("MATERIAL_PT_preview", "DATA_PT_EEVEE_light", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture"),
    "RENDER_PT_eevee_film",
)
#: Panels of Blender's about what this engine does not do, or that another one holds too.
_NOT_OURS = frozenset({"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "DATA_PT_light"})
_ICONS = {"error": "CANCEL", "warning": "ERROR", "info": "INFO"}


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == ENGINE


class _SettingsPanel(_Panel):
    names: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        for attribute in (*(properties.ATTRIBUTES[name] for name in self.names), *self.extra):
            column.prop(context.scene.tyndall, attribute)


class TYNDALL_PT_sampling(_SettingsPanel, bpy.types.Panel):
    """Limits and sampling."""

    bl_label = "Sampling"
    names = _SAMPLING
    extra = ("viewport_samples", "strict")


class TYNDALL_PT_guiding(_SettingsPanel, bpy.types.Panel):
    """Everything the core calls by other names: guiding."""

    bl_label = "Guiding"
    names = tuple(name for name in properties.SPECS if name not in (*_SAMPLING, *_CACHE))


class TYNDALL_PT_cache(_SettingsPanel, bpy.types.Panel):
    """The guiding cache of the shot."""

    bl_label = "Guiding cache"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - Blender's own attribute
    names = _CACHE

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        super().draw(context)
        column = self.layout.column(align=True)
        for line in cache.lines(context.scene, context.view_layer):
            column.label(text=line)
        row = self.layout.row()
        row.operator("tyndall.train_cache")
        row.operator("tyndall.inspect_cache")
        row.operator("tyndall.clear_cache")


class TYNDALL_PT_film(_Panel, bpy.types.Panel):
    """Transparent film."""

    bl_label = "Film"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        self.layout.prop(context.scene.render, "film_transparent", text="Transparent")


class TYNDALL_PT_motion_blur(_Panel, bpy.types.Panel):
    """Blender's shutter; its own panels have settings of other engines."""

    bl_label = "Motion blur"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - Blender's own attribute

    def draw_header(self, context: bpy.types.Context) -> None:
        """Draw the switch."""
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        render = context.scene.render
        column = self.layout.column()
        column.use_property_split = True
        column.active = render.use_motion_blur
        column.prop(render, "motion_blur_position")
        column.prop(render, "motion_blur_shutter")


class TYNDALL_PT_report(_Panel, bpy.types.Panel):
    """What was not rendered as asked."""

    bl_label = "Report"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        report = messages.last(context.scene.name)
        rows = report.rows()
        if not rows:
            self.layout.label(text="Everything was rendered as asked", icon="CHECKMARK")
        for severity, what, where, action in rows:
            box = self.layout.box().column(align=True)
            box.label(text=what, icon=_ICONS[severity])
            for line in filter(None, (where, action)):
                box.label(text=line)
        self.layout.operator("tyndall.copy_report")


class TYNDALL_PT_passes(_Panel, bpy.types.Panel):
    """Passes of the view layer."""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        layer = context.view_layer
        column = self.layout.column()
        for p in passes.ALL:
            if p.aov != "rgba":
                column.prop(layer if p.is_blenders else layer.tyndall, p.attribute)


class TYNDALL_PT_spread(_Panel, bpy.types.Panel):
    """The honeycomb of area lights, which EEVEE does not know."""

    bl_label = "Beam shape"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only of area lights."""
        return super().poll(context) and context.light is not None and context.light.type == "AREA"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        column = self.layout.column()
        column.use_property_split = True
        column.prop(context.light, "spread")


_CLASSES = (
    TYNDALL_PT_spread,
    TYNDALL_PT_sampling,
    TYNDALL_PT_guiding,
    TYNDALL_PT_cache,
    TYNDALL_PT_film,
    TYNDALL_PT_motion_blur,
    TYNDALL_PT_report,
    TYNDALL_PT_passes,
)


def _blenders_panels() -> Iterator[type[bpy.types.Panel]]:
    for cls in bpy.types.Panel.__subclasses__():
        engines = getattr(cls, "COMPAT_ENGINES", None)
        # A panel's twin in the node editor shares its set of engines.
        name = cls.__name__.removeprefix("NODE_")
        if engines is None or name in _NOT_OURS:
            continue
        if "BLENDER_RENDER" in engines or name in _FROM_EEVEE:
            yield cls


def register() -> None:
    """Add our panels, and our name to Blender's."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    for cls in _blenders_panels():
        cls.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    """Undo `register`."""
    for cls in _blenders_panels():
        cls.COMPAT_ENGINES.discard(ENGINE)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)

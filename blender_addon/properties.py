# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of scene and view layer, made from the core's own tables of names, ranges and texts."""

from __future__ import annotations

from typing import Any

import bpy
import tyndall
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import passes
from .cache import PLACEHOLDERS

#: Settings that Blender has elsewhere: camera, resolution, performance; and the passes.
_BLENDERS_OWN = frozenset({"camera", "resolution", "pixelAspect", "threads", "aovs"})
SPECS = {spec["name"]: spec for spec in tyndall.setting_specs() if spec["name"] not in _BLENDERS_OWN}
#: Property of the scene's group by setting.
ATTRIBUTES = {name: "".join(f"_{c.lower()}" if c.isupper() else c for c in name) for name in SPECS}
#: What seems right in a viewport, where nobody waits for the default.
_VIEWPORT_SAMPLES = 256


def _tag(self: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Have viewports notice: properties of add-ons do not by themselves."""
    self.id_data.update_tag()


def _label(name: str) -> str:
    return ATTRIBUTES[name].replace("_", " ").capitalize()


def _property(spec: dict[str, Any]) -> Any:  # noqa: ANN401 - Blender's deferred properties have no type
    common = {"name": _label(spec["name"]), "description": spec["doc"].rstrip("."), "update": _tag}
    match spec["kind"]:
        case "int":
            low, high = (int(min(spec[end], 2**31 - 1)) for end in ("min", "max"))
            return IntProperty(default=spec["default"], min=low, max=high, **common)
        case "float":
            return FloatProperty(default=spec["default"], min=spec["min"], max=spec["max"], **common)
        case "token":
            items = [(choice, choice.replace("-", " ").capitalize(), "") for choice in spec["choices"]]
            return EnumProperty(items=items, default=spec["default"], **common)
        case "string":
            is_path = spec["name"].lower().endswith("path")
            if spec["name"] == "cachePath":
                known = ", ".join(f"{{{name}}}" for name in PLACEHOLDERS)
                common["description"] += f". {known} stand for names"
            return StringProperty(
                default=spec["default"], subtype="FILE_PATH" if is_path else "NONE", **common
            )
    raise TypeError(f"setting {spec['name']} is of the unknown kind {spec['kind']}")


class TyndallSceneSettings(bpy.types.PropertyGroup):
    """Render settings of a scene."""

    __annotations__ = {
        **{ATTRIBUTES[name]: _property(spec) for name, spec in SPECS.items()},
        "viewport_samples": IntProperty(
            name="Viewport samples",
            description="Samples per pixel in viewports",
            default=_VIEWPORT_SAMPLES,
            min=1,
            update=_tag,
        ),
        "strict": BoolProperty(
            name="Strict",
            description="A final render fails if anything in the scene cannot be rendered as asked",
            default=False,
        ),
    }


class TyndallViewLayerSettings(bpy.types.PropertyGroup):
    """Passes of a view layer that Blender itself has no switch for."""

    __annotations__ = {
        p.attribute: BoolProperty(name=p.name, description=p.doc.rstrip("."), default=False, update=_tag)
        for p in passes.EXTRA
    }


def render_settings(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the core's settings as the scene has them, without those that Blender has elsewhere.

    The cache's path is as it was typed; `cache.py` makes a file's name of it.
    """
    group = scene.tyndall
    settings = {name: getattr(group, attribute) for name, attribute in ATTRIBUTES.items()}
    settings["threads"] = scene.render.threads if scene.render.threads_mode == "FIXED" else 0
    return settings


_CLASSES = (TyndallSceneSettings, TyndallViewLayerSettings)


def register() -> None:
    """Add the groups to scenes and view layers."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.tyndall = PointerProperty(type=TyndallSceneSettings)
    bpy.types.ViewLayer.tyndall = PointerProperty(type=TyndallViewLayerSettings)


def unregister() -> None:
    """Remove them; what files have saved stays in the files."""
    del bpy.types.ViewLayer.tyndall
    del bpy.types.Scene.tyndall
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)

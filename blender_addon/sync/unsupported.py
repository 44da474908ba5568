# SPDX-License-Identifier: GPL-3.0-or-later
"""What scenes, layers and objects ask for in vain: named, or the picture would be wrong in silence."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import bpy
    from tyndall.messages import Messages

_RAYS = ("visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission", "visible_shadow")
_RAYS = (*_RAYS, "visible_volume_scatter")
#: Switches of view layers, on unless somebody wants less than the scene.
_PARTS = {"use_solid": "surfaces", "use_volumes": "volumes"}


def report_scene(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, messages: Messages) -> None:
    """Report what the settings of a scene and of a view layer ask for in vain."""
    curve = scene.render.motion_blur_shutter_curve.curves[0]
    if scene.render.use_motion_blur and any(point.location[1] != 1.0 for point in curve.points):
        messages.warning("", "shutter curves are not supported", "the shutter opens and closes at once")
    if scene.render.use_multiview:
        messages.warning("", "stereoscopy is not supported", "all views are those of the one camera")
    place = f"/{layer.name}"
    for switch, what in _PARTS.items():
        if not getattr(layer, switch, True):
            messages.warning(place, f"view layers without {what} are not supported", "they are drawn")
    for kind, names in (
        ("AOV", [aov.name for aov in layer.aovs]),
        ("light group", [group.name for group in layer.lightgroups]),
    ):
        for name in names:
            messages.warning(place, f"there is no pass for the {kind} {name!r}", "it stays empty")


def report_object(thing: bpy.types.Object, path: str, layer: bpy.types.ViewLayer, messages: Messages) -> None:
    """Report what an object and the collections it is in ask for in vain; of the layer, the original."""
    original = thing.original
    is_holdout = thing.is_holdout or original.holdout_get(view_layer=layer)
    for is_on, what in (
        (is_holdout, "holdouts"),
        (thing.is_shadow_catcher, "shadow catchers"),
    ):
        if is_on:
            messages.warning(path, f"{what} are not supported", "it is drawn as an ordinary object")
    hidden = [ray.removeprefix("visible_") for ray in _RAYS if not getattr(thing, ray, True)]
    if original.indirect_only_get(view_layer=layer):
        hidden.append("camera (by its collection)")
    if hidden:
        messages.warning(
            path, f"it is hidden from {', '.join(hidden)} rays, which is not supported", "all rays see it"
        )
    for system in thing.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            messages.warning(path, "hair is not supported", "it is not drawn")
    report_light_linking(thing, path, messages)


def report_light_linking(thing: bpy.types.Object, path: str, messages: Messages) -> None:
    """Report that a lamp, or what shines, lights or darkens only some of the objects."""
    linking = thing.light_linking
    if linking.receiver_collection is not None or linking.blocker_collection is not None:
        messages.warning(path, "light linking is not supported", "it lights all objects")

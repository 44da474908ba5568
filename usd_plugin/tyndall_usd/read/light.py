"""UsdLux lights."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import UsdGeom
from tyndall.prims import Light, LightKind, Matrix, Shaping

if TYPE_CHECKING:
    from pxr import Usd

    from tyndall_usd.read.context import ReadContext

#: Type name -> kind of the delegate and, for each of its parameters, the attribute that holds it.
LIGHTS: dict[str, tuple[LightKind, dict[str, str]]] = {
    "SphereLight": ("sphere", {"radius": "inputs:radius", "as_point": "treatAsPoint"}),
    "RectLight": ("rect", {"width": "inputs:width", "height": "inputs:height"}),
    "DiskLight": ("disk", {"radius": "inputs:radius"}),
    "CylinderLight": (
        "cylinder",
        {"length": "inputs:length", "radius": "inputs:radius", "as_line": "treatAsLine"},
    ),
    "DistantLight": ("distant", {"angle": "inputs:angle"}),
    "DomeLight": ("dome", {}),
    "DomeLight_1": ("dome", {}),
}
#: Light types that give a message, with what to use instead.
UNSUPPORTED_LIGHTS: dict[str, str] = {
    "PortalLight": "the dome is sampled without portals",
    "GeometryLight": "use a light type with a shape, or an emissive material",
    "PluginLight": "use one of UsdLux's own light types",
}
#: y-pole to z-pole: (x, y, z) -> (x, -z, y).
_Z_POLE: Matrix = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)


def read_light(prim: Usd.Prim, ctx: ReadContext) -> Light:
    """Read the light `prim`; what is not supported gives messages."""
    kind, attributes = LIGHTS[prim.GetTypeName()]
    params: dict[str, float | bool | str] = {}
    for param, name in attributes.items():
        value = _get(prim, name, ctx, default=0.0)
        params[param] = value if isinstance(value, bool) else float(value)
    world_from_light = ctx.world_from_object
    if kind in ("dome", "rect"):
        params.update(_read_texture(prim, ctx))
    if prim.GetTypeName() == "DomeLight_1" and _pole_axis(prim) == "Z":
        world_from_light = world_from_light @ _Z_POLE
    _report_unsupported(prim, ctx)
    return Light(
        kind=kind,
        params=params,
        world_from_light=world_from_light,
        intensity=float(_get(prim, "inputs:intensity", ctx, default=1.0)),
        exposure=float(_get(prim, "inputs:exposure", ctx, default=0.0)),
        color=_read_color(prim, ctx),
        normalize=bool(_get(prim, "inputs:normalize", ctx, default=False)),
        diffuse=float(_get(prim, "inputs:diffuse", ctx, default=1.0)),
        specular=float(_get(prim, "inputs:specular", ctx, default=1.0)),
        shaping=_read_shaping(prim, ctx),
    )


def _get(prim: Usd.Prim, name: str, ctx: ReadContext, *, default: object) -> Any:  # noqa: ANN401 - USD's own types
    attribute = prim.GetAttribute(name)
    if not attribute:
        return default
    if attribute.HasAuthoredConnections():
        ctx.messages.warning(prim.GetPath(), f"{name} is connected to a shader", "its own value is used")
    value = attribute.Get(ctx.time)
    return default if value is None else value


def _read_color(prim: Usd.Prim, ctx: ReadContext) -> tuple[float, float, float]:
    red, green, blue = _get(prim, "inputs:color", ctx, default=(1.0, 1.0, 1.0))
    if _get(prim, "inputs:enableColorTemperature", ctx, default=False):
        kelvin = _get(prim, "inputs:colorTemperature", ctx, default=6500.0)
        from pxr import UsdLux

        tint = UsdLux.BlackbodyTemperatureAsRgb(kelvin)
        red, green, blue = red * tint[0], green * tint[1], blue * tint[2]
    return float(red), float(green), float(blue)


def _read_texture(prim: Usd.Prim, ctx: ReadContext) -> dict[str, str]:
    attribute = prim.GetAttribute("inputs:texture:file")
    path = ctx.assets.resolve(attribute, ctx.time, ctx.messages) if attribute else None
    if path is None:
        return {}
    layout = _get(prim, "inputs:texture:format", ctx, default="automatic")
    if layout not in ("automatic", "latlong"):
        ctx.messages.warning(
            prim.GetPath(),
            f"texture:format {layout} is not supported",
            "convert the image to latlong; drawn without it",
        )
        return {}
    return {"texture": path}


def _pole_axis(prim: Usd.Prim) -> str:
    axis = str(prim.GetAttribute("poleAxis").Get())
    return str(UsdGeom.GetStageUpAxis(prim.GetStage())) if axis == "scene" else axis


def _read_shaping(prim: Usd.Prim, ctx: ReadContext) -> Shaping:
    if not prim.GetAuthoredPropertiesInNamespace("inputs:shaping"):
        return Shaping()
    profile = prim.GetAttribute("inputs:shaping:ies:file")
    if profile and (value := profile.Get(ctx.time)) is not None and value.path:
        ctx.messages.warning(
            prim.GetPath(), f"the IES profile {value.path} is not supported", "the light shines without it"
        )
    red, green, blue = _get(prim, "inputs:shaping:focusTint", ctx, default=(0.0, 0.0, 0.0))
    return Shaping(
        focus=float(_get(prim, "inputs:shaping:focus", ctx, default=0.0)),
        focus_tint=(float(red), float(green), float(blue)),
        cone_angle=float(_get(prim, "inputs:shaping:cone:angle", ctx, default=90.0)),
        cone_softness=float(_get(prim, "inputs:shaping:cone:softness", ctx, default=0.0)),
    )


def report_light_apis(prim: Usd.Prim, ctx: ReadContext) -> None:
    """Add a message if a gprim was made a light by an applied schema."""
    for name in ("MeshLightAPI", "VolumeLightAPI", "LightAPI"):
        if name in prim.GetAppliedSchemas():
            ctx.messages.warning(
                prim.GetPath(),
                f"{name} is not supported",
                "drawn as ordinary geometry; give it an emissive material or add a light",
            )
            return


def _report_unsupported(prim: Usd.Prim, ctx: ReadContext) -> None:
    path, messages = prim.GetPath(), ctx.messages
    for name in ("lightLink", "shadowLink"):
        root = prim.GetAttribute(f"collection:{name}:includeRoot")
        targets = [prim.GetRelationship(f"collection:{name}:{rel}") for rel in ("includes", "excludes")]
        if (root and root.Get() is False) or any(rel and rel.HasAuthoredTargets() for rel in targets):
            messages.warning(path, f"{name} is not supported", "the light acts on everything")
    for rel, what in (("light:filters", "light filters"), ("portals", "portals")):
        relationship = prim.GetRelationship(rel)
        if relationship and relationship.HasAuthoredTargets():
            messages.warning(path, f"{what} are not supported", "the light shines without them")
    shadow = prim.GetAttribute("inputs:shadow:enable")
    if shadow and shadow.Get(ctx.time) is False:
        messages.warning(path, "shadow:enable = false is not supported", "the light casts shadows")

"""UsdRenderSettings with its products and variables, and the ``tyndall:`` attributes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tyndall_usd.schema.table import PREFIX, SETTINGS

if TYPE_CHECKING:
    from collections.abc import Collection

    from pxr import Usd
    from tyndall.messages import Messages

#: Names other renderers give to our AOVs, in lower case.
AOV_NAMES: dict[str, str] = {
    **dict.fromkeys(("color", "ci", "c", "rgba", "rgb", "beauty", "combined", "c.*", "lpe:c.*"), "rgba"),
    **dict.fromkeys(("depth", "z", "pz", "cameradepth", "hdcameradepth", "__depth"), "depth"),
    **dict.fromkeys(("normal", "n", "nn", "neye", "world_normal", "hitn"), "normal"),
    **dict.fromkeys(("position", "p", "world_position", "hitp"), "position"),
    **dict.fromkeys(("albedo", "diffusealbedo", "diffuse_albedo", "basecolor"), "albedo"),
    **dict.fromkeys(("emission", "emissive"), "emission"),
    **dict.fromkeys(("cryptoobject", "crypto_object", "cryptomatte"), "crypto_object"),
    **dict.fromkeys(("cryptomaterial", "crypto_material"), "crypto_material"),
    **dict.fromkeys(("samplecount", "sample_count", "debug_sample_count"), "samples"),
}
POLICIES = (
    "expandAperture",
    "cropAperture",
    "adjustApertureWidth",
    "adjustApertureHeight",
    "adjustPixelAspectRatio",
)


@dataclass(frozen=True, slots=True)
class View:
    """What decides the picture of one render: products with equal views share it."""

    camera: str | None = None
    resolution: tuple[int, int] | None = None
    pixel_aspect: float = 1.0
    policy: str = "expandAperture"
    depth_of_field: bool = True
    motion_blur: bool = True


@dataclass(frozen=True, slots=True)
class Product:
    """A file to write: its name (empty: not said) and AOVs (none: rgba)."""

    name: str
    aovs: tuple[str, ...]
    view: View


@dataclass(frozen=True, slots=True)
class StageSettings:
    """What a stage says about its rendering."""

    path: str = ""
    products: tuple[Product, ...] = (Product("", (), View()),)
    purposes: tuple[str, ...] = ("default", "render")
    material_purpose: str = "full"
    renderer: dict[str, Any] = field(default_factory=dict)


def find_settings(stage: Usd.Stage, messages: Messages) -> Usd.Prim | None:
    """Return the settings prim that the stage's metadata names."""
    path = (
        stage.GetMetadata("renderSettingsPrimPath")
        if stage.HasAuthoredMetadata("renderSettingsPrimPath")
        else ""
    )
    if not path:
        return None
    prim = stage.GetPrimAtPath(path) if str(path).startswith("/") else None
    if prim and prim.GetTypeName() == "RenderSettings":
        return prim
    messages.warning(path, "renderSettingsPrimPath does not name a RenderSettings prim", "it is ignored")
    return None


def read_settings(
    prim: Usd.Prim, time: Usd.TimeCode, messages: Messages, *, known_aovs: Collection[str]
) -> StageSettings:
    """Read the RenderSettings `prim`.

    Parameters
    ----------
    known_aovs : collection of str
        Names of the AOVs that the renderer has.
    """
    targets = prim.GetRelationship("products").GetForwardedTargets()
    products = []
    for target in targets:
        product = prim.GetStage().GetPrimAtPath(target)
        if product and product.GetTypeName() == "RenderProduct":
            products.append(_read_product(prim, product, time, messages, known_aovs=known_aovs))
        else:
            messages.warning(
                prim.GetPath(), f"products names <{target}>, which is no RenderProduct", "it is ignored"
            )
    _report_unsupported(prim, time, messages)
    return StageSettings(
        path=str(prim.GetPath()),
        products=tuple(products) or (Product("", (), _read_view([prim], messages)),),
        purposes=tuple(str(p) for p in prim.GetAttribute("includedPurposes").Get()),
        material_purpose=next((str(p) for p in prim.GetAttribute("materialBindingPurposes").Get()), ""),
        renderer=read_renderer_settings(prim, messages),
    )


def read_renderer_settings(prim: Usd.Prim, messages: Messages) -> dict[str, Any]:
    """Return the authored ``tyndall:`` attributes of `prim` by setting name; unknown ones give messages."""
    known = {setting.name: setting for setting in SETTINGS}
    values: dict[str, Any] = {}
    for attribute in prim.GetAuthoredAttributes():
        if not attribute.GetName().startswith(PREFIX):
            continue
        name = attribute.GetName().removeprefix(PREFIX)
        setting = known.get(name)
        value = attribute.Get()
        if setting is None:
            messages.warning(
                prim.GetPath(),
                f"{attribute.GetName()} is not a setting",
                f"known: {', '.join(sorted(known))}",
            )
        elif value is not None:
            try:
                values[name] = type(setting.default)(value)
            except (TypeError, ValueError):
                messages.warning(
                    prim.GetPath(),
                    f"{attribute.GetName()} is {value!r}, not {setting.usd_type}",
                    "it is ignored",
                )
    return values


def _strongest(prims: list[Usd.Prim], name: str) -> Any:  # noqa: ANN401 - a value of any of USD's types
    """Return the value of the first prim that authors it, else the fallback."""
    attributes = [prim.GetAttribute(name) for prim in prims]
    authored = next((a for a in attributes if a and a.HasAuthoredValue()), attributes[-1])
    return authored.Get()


def _read_view(prims: list[Usd.Prim], messages: Messages) -> View:
    """Read the common part of settings and product; `prims` are the product, if any, and the settings."""
    cameras = [prim.GetRelationship("camera").GetForwardedTargets() for prim in prims]
    camera = next((str(targets[0]) for targets in cameras if targets), None)
    resolution = _strongest(prims, "resolution")
    width, height = (int(n) for n in resolution)
    if width < 1 or height < 1:
        messages.error(
            prims[0].GetPath(), f"resolution is {width} x {height}", "the default size is rendered"
        )
    window = tuple(_strongest(prims, "dataWindowNDC"))
    if window != (0.0, 0.0, 1.0, 1.0):
        messages.warning(
            prims[0].GetPath(), f"dataWindowNDC {window} is not supported", "the full image is rendered"
        )
    policy = str(_strongest(prims, "aspectRatioConformPolicy"))
    if policy not in POLICIES:
        messages.warning(
            prims[0].GetPath(), f"aspectRatioConformPolicy {policy!r} is not known", "expandAperture is used"
        )
        policy = POLICIES[0]
    pixel_aspect = float(_strongest(prims, "pixelAspectRatio"))
    if not pixel_aspect > 0:
        messages.warning(prims[0].GetPath(), f"pixelAspectRatio is {pixel_aspect:g}", "1 is used")
        pixel_aspect = 1.0
    return View(
        camera=camera,
        resolution=(width, height) if width > 0 and height > 0 else None,
        pixel_aspect=pixel_aspect,
        policy=policy,
        depth_of_field=not _strongest(prims, "disableDepthOfField"),
        # The latter is what older stages say.
        motion_blur=not (_strongest(prims, "disableMotionBlur") or _strongest(prims, "instantaneousShutter")),
    )


def _read_product(
    settings: Usd.Prim,
    product: Usd.Prim,
    time: Usd.TimeCode,
    messages: Messages,
    *,
    known_aovs: Collection[str],
) -> Product:
    kind = product.GetAttribute("productType").Get()
    if kind != "raster":
        messages.warning(product.GetPath(), f"productType {kind} is not supported", "a flat image is written")
    aovs: dict[str, None] = {}
    for target in product.GetRelationship("orderedVars").GetForwardedTargets():
        name = _aov(settings.GetStage().GetPrimAtPath(target), messages, known_aovs=known_aovs)
        if name:
            aovs[name] = None
    name = product.GetAttribute("productName").Get(time) or ""
    return Product(str(name), tuple(aovs), _read_view([product, settings], messages))


def _aov(var: Usd.Prim, messages: Messages, *, known_aovs: Collection[str]) -> str | None:
    if not var or var.GetTypeName() != "RenderVar":
        messages.warning(
            var.GetPath() if var else "", "orderedVars names what is no RenderVar", "it is left out"
        )
        return None
    source = str(var.GetAttribute("sourceName").Get() or var.GetName())
    name = source if source in known_aovs else AOV_NAMES.get(source.lower())
    if name in known_aovs:
        return name
    kind = var.GetAttribute("sourceType").Get()
    messages.warning(
        var.GetPath(),
        f"there is no AOV for sourceName {source!r} (sourceType {kind})",
        "see --list-aovs; it is left out",
    )
    return None


def _report_unsupported(prim: Usd.Prim, time: Usd.TimeCode, messages: Messages) -> None:
    space = prim.GetAttribute("renderingColorSpace").Get(time)
    if space and str(space) not in ("lin_rec709_scene", "lin_rec709", "linear", "raw"):
        messages.warning(
            prim.GetPath(), f"renderingColorSpace {space} is not supported", "linear Rec.709 is rendered"
        )

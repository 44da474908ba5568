"""The materials of a stage at the delegate: each translated on first use, and again only if it varies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pxr import Usd

from tyndall_usd.read.material import display_color_material, primvar_names, read_material

if TYPE_CHECKING:
    from pxr import Sdf, UsdShade
    from tyndall.messages import Messages
    from tyndall.prims import Material

    from tyndall_usd.assets import Assets
    from tyndall_usd.memory import Memory

_EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)

#: Paths of the looks that no prim of the stage describes.
DISPLAY_COLOR = "/__tyndall/displayColor"
DISPLAY_COLOR_OPACITY = "/__tyndall/displayColorOpacity"


class MaterialLibrary:
    """Translated materials by delegate path."""

    __slots__ = ("_assets", "_memory", "_messages", "_paths", "_time", "materials")

    def __init__(self, time: Usd.TimeCode, *, assets: Assets, messages: Messages, memory: Memory) -> None:
        self._time = time
        self._memory = memory
        self._assets = assets
        self._messages = messages
        self._paths: dict[str, str | None] = {}
        self.materials: dict[str, Material] = {}

    def for_gprim(self, material: UsdShade.Material, *, has_opacity: bool = False) -> str:
        """Return the path of the look of a surface: displayColor if `material` is none or not usable."""
        path = self._path(material)
        if path is None:
            path = DISPLAY_COLOR_OPACITY if has_opacity else DISPLAY_COLOR
            if path not in self.materials:
                self.materials[path] = display_color_material(opacity=has_opacity)
        return path

    def for_volume(self, material: UsdShade.Material, *, volume_path: object) -> str | None:
        """Return the path of the medium of a Volume; ``None`` is the delegate's default medium."""
        if not material:
            return None  # The core says that it has no material.
        path = self._path(material)
        if path is None or self.materials[path].volume is None:
            self._messages.warning(
                volume_path,
                f"the bound material <{material.GetPath()}> has no usable volume",
                "extinction is the density with a grey albedo; give the material an outputs:volume",
            )
            return None
        return path

    def primvars(self, path: str) -> set[str]:
        """Return the names of the primvars that the material at `path` reads."""
        return primvar_names(self.materials[path])

    def _path(self, material: UsdShade.Material) -> str | None:
        if not material:
            return None
        prim = material.GetPrim()
        source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        key = str(source.GetPath())
        if key not in self._paths:
            path = str(prim.GetPath())
            translated = self._memory.recall(
                path,
                self._time.IsDefault(),
                lambda: _network(source),
                self._messages,
                lambda messages: read_material(material, self._time, assets=self._assets, messages=messages),
            )
            self._paths[key] = None if translated is None else path
            if translated is not None:
                self.materials[path] = translated
        return self._paths[key]


def _network(material: Usd.Prim) -> list[Usd.Prim]:
    """Return the prims that a material is translated from: those below it and what they are connected to."""
    found: dict[Sdf.Path, Usd.Prim] = {}
    pending = [material]
    while pending:
        for prim in Usd.PrimRange(pending.pop(), _EVERYTHING):
            if prim.GetPath() in found:
                continue
            found[prim.GetPath()] = prim
            for attribute in prim.GetAuthoredAttributes():
                sources = (
                    prim.GetStage().GetPrimAtPath(at.GetPrimPath()) for at in attribute.GetConnections()
                )
                pending += [source for source in sources if source]
    return list(found.values())

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's passes and the core's AOVs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import tyndall

if TYPE_CHECKING:
    import bpy
    import numpy as np

#: AOV -> (Blender's name, Blender's switch) where Blender has a pass of that meaning.
_BLENDERS = {
    "rgba": ("Combined", "use_pass_combined"),
    "depth": ("Depth", "use_pass_z"),
    "normal": ("Normal", "use_pass_normal"),
    "position": ("Position", "use_pass_position"),
}
_NAMES = {
    "vsp": "Volume Scatter Probability",
    "vsp_target": "Volume Scatter Probability Target",
    "volume_depth": "Volume Depth",
    "emission": "Unscattered Light",
    "direct": "Direct Light",
    "indirect": "Indirect Light",
}
#: AOV -> what Blender calls the cryptomatte, with its switch; a pass has two pairs of hash and coverage.
_CRYPTOMATTES = {
    "crypto_object": ("CryptoObject", "use_pass_cryptomatte_object"),
    "crypto_material": ("CryptoMaterial", "use_pass_cryptomatte_material"),
}
#: Blender's switches of passes that the core does not have; naming them beats leaving them black in silence.
_MISSING = {
    f"use_pass_{name}": name.replace("_", " ")
    for name in (
        *("mist", "vector", "uv", "object_index", "material_index", "emit", "environment"),
        *("shadow", "ambient_occlusion", "diffuse_direct", "diffuse_indirect", "diffuse_color"),
        *("glossy_direct", "glossy_indirect", "glossy_color", "transmission_direct"),
        *("transmission_indirect", "transmission_color", "subsurface_direct", "subsurface_indirect"),
        *("subsurface_color", "cryptomatte_asset"),
    )
}


@dataclass(frozen=True, slots=True)
class Pass:
    """A pass of Blender's result: `channels` one letter each, `kind` VALUE, VECTOR or COLOR."""

    aov: str
    name: str
    attribute: str
    channels: str
    kind: str
    doc: str
    is_blenders: bool
    #: Of the AOV's channels the one that the pass begins with.
    first_channel: int = 0

    def is_on(self, layer: bpy.types.ViewLayer) -> bool:
        """Return whether the view layer asks for it; the picture itself is always made."""
        if self.aov == "rgba":
            return True
        return bool(getattr(layer if self.is_blenders else layer.tyndall, self.attribute))


def _pass(info: tyndall.AovInfo) -> Pass:
    name, attribute = _BLENDERS.get(
        info.name,
        (_NAMES.get(info.name, info.name.replace("_", " ").title()), f"use_pass_{info.name}"),
    )
    count = len(info.channels)
    letters = "".join(c.upper() for c in info.channels)
    if count == 1:
        letters = "Z" if info.name == "depth" else "X"
    is_vector = info.name in ("normal", "position")
    kind = "VALUE" if count == 1 else "VECTOR" if is_vector or count == 2 else "COLOR"
    return Pass(
        aov=info.name,
        name=name,
        attribute=attribute,
        channels="XYZ" if is_vector else letters,
        kind=kind,
        doc=info.doc,
        is_blenders=info.name in _BLENDERS,
    )


def _cryptomatte(info: tyndall.AovInfo) -> list[Pass]:
    name, attribute = _CRYPTOMATTES[info.name]
    return [
        Pass(
            aov=info.name,
            name=f"{name}{first // 4:02d}",
            attribute=attribute,
            channels="rgba",
            kind="COLOR",
            doc=info.doc,
            is_blenders=True,
            first_channel=first,
        )
        for first in range(0, len(info.channels), 4)
    ]


def _passes(info: tyndall.AovInfo) -> list[Pass]:
    return _cryptomatte(info) if info.name in _CRYPTOMATTES else [_pass(info)]


ALL = tuple(p for info in tyndall.list_aovs() for p in _passes(info))
EXTRA = tuple(p for p in ALL if not p.is_blenders)


def wanted(layer: bpy.types.ViewLayer) -> list[Pass]:
    """Return the passes that `layer` asks for, the picture first."""
    return sorted((p for p in ALL if p.is_on(layer)), key=lambda p: p.aov != "rgba")


def missing(layer: bpy.types.ViewLayer) -> list[str]:
    """Return the passes that `layer` asks for and nobody makes."""
    return [name for attribute, name in _MISSING.items() if getattr(layer, attribute, False)]


def pixels(film: tyndall.Film, wanted_pass: Pass, *, is_transparent: bool) -> np.ndarray:
    """Return an AOV as Blender wants it: float32, shape (height, width, channels), row 0 at the bottom."""
    first = wanted_pass.first_channel
    image = film.aov(wanted_pass.aov)[..., first : first + len(wanted_pass.channels)]
    return upright(image, is_transparent=is_transparent or wanted_pass.aov != "rgba")


def upright(image: np.ndarray, *, is_transparent: bool) -> np.ndarray:
    """Return an image with row 0 at the bottom; alpha becomes 1 unless it `is_transparent`.

    Unless the film is transparent, the background is part of the picture, which then is opaque.
    """
    image = image[::-1].copy()
    if not is_transparent:
        image[..., 3] = 1.0
    return image

# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of node types."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import media, pattern, surface, texture

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .tree import Converter

_KINDS = (
    surface.Principled,
    surface.Diffuse,
    surface.Glossy,
    surface.Metallic,
    surface.Glass,
    surface.Refraction,
    surface.Transparent,
    surface.Emission,
    surface.MixShader,
    surface.AddShader,
    media.PrincipledVolume,
    media.Absorption,
    media.Scatter,
    media.Coefficients,
    pattern.Value,
    pattern.Rgb,
    pattern.Attribute,
    pattern.ColorAttribute,
    pattern.VolumeInfo,
    pattern.Math,
    pattern.VectorMath,
    pattern.Mix,
    pattern.MixRgb,
    pattern.Clamp,
    pattern.MapRange,
    pattern.ColorRamp,
    pattern.Blackbody,
    pattern.Gamma,
    pattern.Invert,
    texture.ImageTexture,
    texture.UvMap,
    texture.TextureCoordinate,
    texture.Mapping,
    texture.NormalMap,
)

CONVERTERS: Mapping[str, Converter] = {kind.idname: kind() for kind in _KINDS}

# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of node types."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import arithmetic, media, pattern, procedural, surface, texture

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
    pattern.Blackbody,
    arithmetic.Math,
    arithmetic.VectorMath,
    arithmetic.Mix,
    arithmetic.MixRgb,
    arithmetic.Clamp,
    arithmetic.MapRange,
    arithmetic.ColorRamp,
    arithmetic.Gamma,
    arithmetic.Invert,
    arithmetic.Combine,
    arithmetic.CombineColor,
    arithmetic.Separate,
    arithmetic.SeparateColor,
    arithmetic.RgbToBw,
    procedural.Noise,
    procedural.Voronoi,
    procedural.Gradient,
    procedural.Wave,
    texture.ImageTexture,
    texture.UvMap,
    texture.TextureCoordinate,
    texture.Geometry,
    texture.Mapping,
    texture.NormalMap,
)

CONVERTERS: Mapping[str, Converter] = {kind.idname: kind() for kind in _KINDS}

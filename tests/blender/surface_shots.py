"""Shots about materials of surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from shots import ball

if TYPE_CHECKING:
    from collections.abc import Callable

SHOTS: dict[str, Callable[[], Any]] = {
    "plastic": lambda: ball(Base_Color=(0.6, 0.3, 0.1, 1), Roughness=0.3),
    "matte": lambda: ball("ShaderNodeBsdfDiffuse", Color=(0.6, 0.3, 0.1, 1)),
    "metal": lambda: ball(Base_Color=(0.9, 0.6, 0.3, 1), Roughness=0.2, Metallic=1.0),
    "glossy": lambda: ball("ShaderNodeBsdfAnisotropic", Color=(0.9, 0.6, 0.3, 1), Roughness=0.3),
    "glass": lambda: ball("ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.45),
    "half there": lambda: ball(Base_Color=(0.6, 0.3, 0.1, 1), Roughness=1.0, Alpha=0.4),
    "glowing": lambda: ball(Base_Color=(0, 0, 0, 1), Emission_Color=(1, 0.5, 0.2, 1), Emission_Strength=2.0),
}

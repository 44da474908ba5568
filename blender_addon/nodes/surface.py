# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface shaders."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tyndall.graph import to_vector
from tyndall.medium import Medium

from .media import mix_media, sum_of_media
from .tree import Converter

if TYPE_CHECKING:
    from tyndall.prims import NodeInput, NodeRef

    from .tree import Converted, SourceNode

#: Inputs that change nothing at these values, and that nothing here reads.
_PRINCIPLED_OFF = {
    "Diffuse Roughness": 0.0,
    "Subsurface Weight": 0.0,
    "Anisotropic": 0.0,
    "Sheen Weight": 0.0,
    "Thin Film Thickness": 0.0,
}
#: Specular level that leaves the index of refraction as it is.
_NEUTRAL_SPECULAR = 0.5


class Principled(Converter):
    """Base, metal, highlights, coat, transmission, emission, alpha."""

    idname = "ShaderNodeBsdfPrincipled"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return a preview surface, mixed with glass by the transmission."""
        node.ignore_authored(_PRINCIPLED_OFF, linked=("Tangent", "Coat Normal"))
        graph = node.graph
        base, roughness = node.color("Base Color"), node.value("Roughness")
        metallic, ior = node.value("Metallic"), self._ior(node)
        _warn_unless_white(node, "Specular Tint", "Coat Tint")
        body: NodeInput = graph.add(
            "preview_surface",
            diffuseColor=base,
            metallic=metallic,
            roughness=roughness,
            ior=ior,
            clearcoat=node.value("Coat Weight"),
            clearcoatRoughness=node.value("Coat Roughness"),
            normal=normal_of(node),
        )
        transmission = node.value("Transmission Weight")
        if transmission != 0.0:
            share = graph.combine("multiply", transmission, graph.combine("subtract", 1.0, metallic))
            glass = graph.add("dielectric", ior=ior, roughness=roughness, tint=_root(node, base), mode="RT")
            body = glass if share == 1.0 else graph.add("mix_closure", a=body, b=glass, mix=share)
        emission = graph.combine("multiply", node.color("Emission Color"), node.value("Emission Strength"))
        alpha = node.value("Alpha", 1.0)
        if emission == (0.0, 0.0, 0.0) and alpha == 1.0:
            return body
        glow = None if emission == (0.0, 0.0, 0.0) else graph.add("emission", color=emission)
        return graph.add("surface", bsdf=body, emission=glow, opacity=alpha)

    @staticmethod
    def _ior(node: SourceNode) -> NodeInput:
        """Return the index that has the reflectance that the specular level makes of the authored one."""
        ior, level = node.value("IOR", 1.5), node.value("Specular IOR Level", _NEUTRAL_SPECULAR)
        if level == _NEUTRAL_SPECULAR:
            return ior
        if not (isinstance(ior, float) and isinstance(level, float)):
            node.warn("varies Specular IOR Level", "the index of refraction alone is used")
            return ior
        reflectance = ((ior - 1.0) / (ior + 1.0)) ** 2 * level / _NEUTRAL_SPECULAR
        root = math.sqrt(min(reflectance, 0.99))
        return (1.0 + root) / (1.0 - root)


class Diffuse(Converter):
    """Lambert; with roughness, a model of rough surfaces that keeps energy."""

    idname = "ShaderNodeBsdfDiffuse"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return the graph's node of that name."""
        roughness = node.value("Roughness")
        if roughness != 0.0:
            node.info("is rough", "the energy-preserving Oren-Nayar model is used, which is brighter")
        _ignore_normal(node)
        return node.graph.add("diffuse", color=node.color("Color"), roughness=roughness)


class Glossy(Converter):
    """A tinted mirror."""

    idname = "ShaderNodeBsdfAnisotropic"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return a metal with that reflectance."""
        node.ignore_authored({"Anisotropy": 0.0}, linked=("Tangent",))
        _ignore_normal(node)
        return node.graph.add("conductor", reflectance=node.color("Color"), roughness=node.value("Roughness"))


class Metallic(Converter):
    """A metal by index and extinction, or by colour."""

    idname = "ShaderNodeBsdfMetallic"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return a metal."""
        node.ignore_authored({"Anisotropy": 0.0, "Thin Film Thickness": 0.0}, linked=("Tangent",))
        _ignore_normal(node)
        roughness = node.value("Roughness")
        if node.node.fresnel_type == "PHYSICAL_CONDUCTOR":
            return node.graph.add(
                "conductor", ior=node.color("IOR"), extinction=node.color("Extinction"), roughness=roughness
            )
        node.info("has an edge tint", "the edge is that of a metal of the base colour")
        return node.graph.add("conductor", reflectance=node.color("Base Color"), roughness=roughness)


class Glass(Converter):
    """Reflection and refraction."""

    idname = "ShaderNodeBsdfGlass"
    mode = "RT"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return a dielectric."""
        node.ignore_authored({"Thin Film Thickness": 0.0})
        _ignore_normal(node)
        return node.graph.add(
            "dielectric",
            ior=node.value("IOR"),
            roughness=node.value("Roughness"),
            tint=node.color("Color"),
            mode=self.mode,
        )


class Refraction(Glass):
    """Refraction alone."""

    idname = "ShaderNodeBsdfRefraction"
    mode = "T"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return the transmitted part of a dielectric."""
        node.info("is refraction alone", "what would be reflected is missing, as at real glass")
        return super().convert(node)


class Transparent(Converter):
    """What lets light pass straight on."""

    idname = "ShaderNodeBsdfTransparent"

    def convert(self, node: SourceNode) -> NodeRef:
        """Return the graph's node of that name."""
        return node.graph.add("transparent", color=node.color("Color"))


class Emission(Converter):
    """Light of surfaces, or of volumes by length."""

    idname = "ShaderNodeEmission"

    def convert(self, node: SourceNode) -> Converted:
        """Return an emission of either kind."""
        color = node.graph.combine("multiply", node.color("Color"), node.value("Strength"))
        if node.translation.is_volume:
            return Medium(emission=color)
        return node.graph.add("emission", color=color)


class MixShader(Converter):
    """A mixture of two shaders."""

    idname = "ShaderNodeMixShader"

    def convert(self, node: SourceNode) -> Converted | None:
        """Return a mixture; a missing shader is black."""
        share = node.value("Fac", 0.5)
        if node.translation.is_volume:
            return mix_media(node, node.medium("Shader"), node.medium("Shader_001"), share)
        a, b = node.closure("Shader"), node.closure("Shader_001")
        return node.graph.add("mix_closure", a=a, b=b, mix=share)


class AddShader(Converter):
    """The sum of two shaders."""

    idname = "ShaderNodeAddShader"

    def convert(self, node: SourceNode) -> Converted | None:
        """Return the sum."""
        if node.translation.is_volume:
            return sum_of_media(node, node.medium("Shader"), node.medium("Shader_001"))
        return node.graph.add("add_closure", a=node.closure("Shader"), b=node.closure("Shader_001"))


def normal_of(node: SourceNode) -> NodeInput | None:
    """Return the tangent-space normal that is connected."""
    return node.value("Normal") if node.is_linked("Normal") else None


def _ignore_normal(node: SourceNode) -> None:
    if node.is_linked("Normal"):
        node.warn("has a normal of its own", "it was ignored; the Principled BSDF can have one")


def _warn_unless_white(node: SourceNode, *names: str) -> None:
    for name in names:
        value = node.value(name, (1.0, 1.0, 1.0))
        if value not in (1.0, (1.0, 1.0, 1.0)):
            node.warn(f"has a {name.lower()}", "white was used")


def _root(node: SourceNode, color: NodeInput) -> NodeInput:
    """Return the tint of glass whose base colour light takes on by passing twice."""
    if isinstance(color, (float, tuple)):
        x, y, z = to_vector(color)
        if (x, y, z) != (1.0, 1.0, 1.0):
            node.info("is tinted glass", "reflections are tinted too")
        return math.sqrt(max(x, 0.0)), math.sqrt(max(y, 0.0)), math.sqrt(max(z, 0.0))
    node.warn("varies the colour of glass", "the colour itself is the tint, not its square root")
    return color

# SPDX-License-Identifier: GPL-3.0-or-later
"""Images on surfaces and where on them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tyndall.graph import to_vector
from tyndall.prims import NodeInput, NodeRef

from .tree import Converter

if TYPE_CHECKING:
    from .tree import SourceNode

_WRAPS = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "black", "MIRROR": "mirror"}
_SPACES = {"sRGB": "sRGB", "Non-Color": "raw", "Raw": "raw", "Linear Rec.709": "raw", "Linear": "raw"}
#: The core's name of the UV map that counts if none is named.
ACTIVE_UV = "st"


class ImageTexture(Converter):
    """An image on the surface."""

    idname = "ShaderNodeTexImage"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return an image by UV."""
        image = node.node.image
        file = None if image is None else node.translation.images.file_of(image)
        if file is None or node.translation.is_volume:
            node.warn("has no image that can be read", "magenta was used")
            return (1.0, 0.0, 1.0)
        if node.node.projection != "FLAT":
            node.warn(f"projects by {node.node.projection.lower()}", "the flat projection is used")
        if node.node.interpolation == "Closest":
            node.warn("shows pixels as they are", "it is interpolated between them")
        vector = node.value("Vector") if node.is_linked("Vector") else None
        space = image.colorspace_settings.name
        if space not in _SPACES:
            node.warn(f"has the colour space {space}", "the file's own is used")
        texture = node.graph.add(
            "image",
            file=file,
            st=vector if isinstance(vector, NodeRef) else None,
            wrap_s=_WRAPS[node.node.extension],
            wrap_t=_WRAPS[node.node.extension],
            color_space=_SPACES.get(space, "auto"),
            fallback=(1.0, 0.0, 1.0),
        )
        channel = "a" if node.output.identifier == "Alpha" else "rgb"
        return node.graph.add("channel", channel=channel, **{"in": texture}) if channel == "a" else texture


class UvMap(Converter):
    """Texture coordinates of a UV map."""

    idname = "ShaderNodeUVMap"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return a primvar."""
        name = node.node.uv_map or ACTIVE_UV
        node.translation.primvars.add(name)
        return node.graph.add("primvar", name=name)


class TextureCoordinate(Converter):
    """Texture coordinates: UV."""

    idname = "ShaderNodeTexCoord"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the active UV map."""
        if node.output.identifier != "UV":
            node.warn(f"is asked for {node.output.name}", "UV was used")
        return node.graph.add("primvar", name=ACTIVE_UV)


class Mapping(Converter):
    """Texture coordinates scaled, turned around z, and moved."""

    idname = "ShaderNodeMapping"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return a 2-D transform."""
        rotation = to_vector(node.constant_color("Rotation", (0.0, 0.0, 0.0)))
        if rotation[0] != 0.0 or rotation[1] != 0.0 or node.node.vector_type != "POINT":
            node.warn("is no point mapping around z alone", "the rest of it is ignored")
        return node.graph.add(
            "transform2d",
            rotation=math.degrees(rotation[2]),
            scale=node.constant_color("Scale", (1.0, 1.0, 1.0)),
            translation=node.constant_color("Location", (0.0, 0.0, 0.0)),
            **{"in": node.value("Vector")},
        )


class NormalMap(Converter):
    """A tangent-space normal."""

    idname = "ShaderNodeNormalMap"

    def convert(self, node: SourceNode) -> NodeInput | None:
        """Return the graph's node of that name."""
        if node.node.space != "TANGENT":
            node.warn(f"is in {node.node.space.lower()} space", "it was ignored")
            return (0.0, 0.0, 1.0)
        color = node.color("Color")
        return node.graph.add("normal_map", scale=node.constant("Strength", 1.0), **{"in": color})

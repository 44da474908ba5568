# SPDX-License-Identifier: GPL-3.0-or-later
"""Images, and where textures are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mathutils import Euler, Matrix
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
    """Texture coordinates: UV, in the object's box, or in an object's space."""

    idname = "ShaderNodeTexCoord"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the coordinates that are asked for."""
        wanted = node.output.identifier
        is_volume = node.translation.is_volume
        if wanted == "Object":
            other = node.node.object
            if other is None:
                return node.graph.add("coordinate", space="object")
            world = node.graph.add("coordinate", space="world")
            return _transformed(node, world, other.matrix_world.inverted_safe())
        if wanted == "UV" and not is_volume:
            return node.graph.add("primvar", name=ACTIVE_UV)
        if wanted != "Generated":
            node.warn(f"is asked for {node.output.name}", "Generated was used")
        return node.graph.add("coordinate", space="box")


class Geometry(Converter):
    """Where on the stage a point is."""

    idname = "ShaderNodeNewGeometry"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return the position."""
        if node.output.identifier != "Position":
            node.warn(f"is asked for {node.output.name}", "0 was used")
            return 0.0
        return node.graph.add("coordinate", space="world")


class Mapping(Converter):
    """Points scaled, turned and moved."""

    idname = "ShaderNodeMapping"

    def convert(self, node: SourceNode) -> NodeInput:
        """Return an affine map; of a direction its unit vector."""
        kind = node.node.vector_type
        point, scale = node.value("Vector"), node.value("Scale", (1.0, 1.0, 1.0))
        rotation = Euler(node.constant_color("Rotation", (0.0, 0.0, 0.0))).to_matrix().to_4x4()
        location = node.value("Location") if kind in ("POINT", "TEXTURE") else (0.0, 0.0, 0.0)
        combine = node.graph.combine
        if kind == "TEXTURE":
            turned = _transformed(node, combine("subtract", point, location), rotation.transposed())
            return node.graph.add("math", function="divide", in1=turned, in2=scale)
        if kind == "NORMAL":
            scaled = node.graph.add("math", function="divide", in1=point, in2=scale)
            return node.graph.add(
                "vector_math", function="normalize", in1=_transformed(node, scaled, rotation)
            )
        return combine("add", _transformed(node, combine("multiply", point, scale), rotation), location)


def _transformed(node: SourceNode, point: NodeInput, matrix: Matrix) -> NodeInput:
    """Return a point in another space."""
    if matrix == Matrix.Identity(4):
        return point
    columns = [tuple(float(x) for x in column[:3]) for column in matrix.col]
    x, y, z, translation = columns
    return node.graph.add("transform3d", x=x, y=y, z=z, translation=translation, **{"in": point})


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

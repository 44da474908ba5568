# SPDX-License-Identifier: GPL-3.0-or-later
"""Walking a node tree: from a socket to the node that feeds it, through groups, reroutes and muted nodes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from tyndall.graph import Graph, to_vector
from tyndall.medium import Medium
from tyndall.prims import NodeInput, NodeRef

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    import bpy
    from tyndall.graph import Vector
    from tyndall.messages import Messages

    from ..sync.images import ImageFiles

#: Rec.709, as Blender turns colours into numbers.
LUMINANCE: Vector = (0.2126, 0.7152, 0.0722)
_MEAN: Vector = (1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0)
#: Shaders inside shaders inside shaders: more is a circle that Blender would not have let pass.
_MAX_DEPTH = 200

Converted: TypeAlias = NodeInput | Medium
#: The group nodes that a node is inside of, outermost first.
Groups: TypeAlias = "tuple[bpy.types.Node, ...]"


class Converter(ABC):
    """Translates one type of node; `SourceNode` is what it sees."""

    #: The node's type.
    idname: str

    @abstractmethod
    def convert(self, node: SourceNode) -> Converted | None:
        """Return the value of the output that is asked for."""


@dataclass
class Translation:
    """The translation of one tree, for surfaces or for volumes.

    Parameters
    ----------
    is_volume : bool
        Attributes then name fields of volumes, not primvars of meshes.
    has_grids : bool
        Whether there are fields: a volume inside a mesh, or of the world, is the same everywhere.
    primvars : set of str
        Collects the names of attributes that meshes must bring along.
    """

    path: str
    messages: Messages
    images: ImageFiles
    is_volume: bool
    has_grids: bool
    converters: Mapping[str, Converter]
    graph: Graph = field(default_factory=Graph)
    primvars: set[str] = field(default_factory=set)
    _depth: int = 0

    def of_socket(self, socket: bpy.types.NodeSocket, groups: Groups = ()) -> Converted | None:
        """Return what feeds an input socket, or its own value; ``None`` if it has neither."""
        found = source_of(socket, groups)
        if found is None:
            return None
        source, groups = found
        if not source.is_output:
            return own_value(source)
        node = source.node
        converter = self.converters.get(node.bl_idname)
        seen = SourceNode(self, node, source, groups)
        if converter is None or self._depth > _MAX_DEPTH:
            is_shader = source.type == "SHADER"
            stand_in = "there is no medium" if is_shader and self.is_volume else "middle grey was used"
            seen.warn("is not supported", stand_in)
            return self._fallback(seen)
        self._depth += 1
        value = converter.convert(seen)
        self._depth -= 1
        return value

    def _fallback(self, node: SourceNode) -> Converted | None:
        """Return what stands for an unknown node: visible, but not louder than the rest."""
        if node.output.type == "SHADER":
            if self.is_volume:
                return None
            return self.graph.add("diffuse", color=(0.5, 0.5, 0.5))
        return 0.5 if node.output.type == "VALUE" else (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class SourceNode:
    """One node as converters see it: inputs by identifier."""

    translation: Translation
    node: bpy.types.Node
    output: bpy.types.NodeSocket
    groups: Groups

    @property
    def graph(self) -> Graph:
        """The graph it is translated into."""
        return self.translation.graph

    def warn(self, what: str, action: str) -> None:
        """Add a message about this node."""
        self.translation.messages.warning(self.translation.path, f"{self._name()} {what}", action)

    def info(self, what: str, action: str) -> None:
        """Add a message about a small difference."""
        self.translation.messages.info(self.translation.path, f"{self._name()} {what}", action)

    def _name(self) -> str:
        return f"node {self.node.bl_label!r}"

    def _socket(self, identifier: str) -> bpy.types.NodeSocket | None:
        return next((s for s in self.node.inputs if s.identifier == identifier), None)

    def is_linked(self, identifier: str) -> bool:
        """Return whether something is connected."""
        socket = self._socket(identifier)
        return socket is not None and socket.is_linked

    def converted(self, identifier: str) -> Converted | None:
        """Return the value of an input, of whatever kind."""
        socket = self._socket(identifier)
        return None if socket is None else self.translation.of_socket(socket, self.groups)

    def value(self, identifier: str, default: NodeInput = 0.0) -> NodeInput:
        """Return a number or colour, constant or not; a number if the socket is one."""
        value = self.converted(identifier)
        if value is None or isinstance(value, (Medium, str)):
            return default
        socket = self._socket(identifier)
        if socket is not None and socket.type == "VALUE":
            found = source_of(socket, self.groups)
            return value if found is None else to_number(self.graph, value, found[0].type)
        return value

    def color(self, identifier: str) -> NodeInput:
        """Return a colour; numbers are grey."""
        value = self.value(identifier)
        return to_vector(value) if isinstance(value, float) else value

    def varies(self, *identifiers: str) -> bool:
        """Return whether one of these inputs is not constant."""
        return any(isinstance(self.value(name), NodeRef) for name in identifiers)

    def constant(self, identifier: str, default: float) -> float:
        """Return a number that cannot vary; what varies gives a message and the socket's own value."""
        value = self.value(identifier, default)
        if isinstance(value, float):
            return value
        if isinstance(value, tuple):
            return sum(value) / 3.0
        self.warn(f"cannot vary {identifier}", "the value of the socket itself is used")
        socket = self._socket(identifier)
        return default if socket is None else float(socket.default_value)

    def constant_color(self, identifier: str, default: Vector) -> Vector:
        """Return a colour that cannot vary."""
        value = self.value(identifier, default)
        if isinstance(value, (float, tuple)):
            return to_vector(value)
        self.warn(f"cannot vary {identifier}", "the value of the socket itself is used")
        return default

    def closure(self, identifier: str) -> NodeRef | None:
        """Return a connected surface shader."""
        value = self.converted(identifier)
        return value if isinstance(value, NodeRef) else None

    def medium(self, identifier: str) -> Medium | None:
        """Return a connected volume shader."""
        value = self.converted(identifier)
        return value if isinstance(value, Medium) else None

    def ignore_authored(self, defaults: Mapping[str, float], *, linked: Collection[str] = ()) -> None:
        """Warn about inputs that are not translated, unless they are off: unlinked and at these values."""
        on = [
            name
            for name, off in defaults.items()
            if (socket := self._socket(name)) is not None
            and (socket.is_linked or abs(float(socket.default_value) - off) > 1e-6)
        ]
        on += [name for name in linked if self.is_linked(name)]
        if on:
            self.warn(f"has inputs that are not supported: {', '.join(on)}", "they were ignored")


def to_number(graph: Graph, value: NodeInput, kind: str) -> NodeInput:
    """Return a colour's luminance or a vector's mean; `kind` is the type of the socket that gives it.

    Numbers stay, and so do fields, whose grids say what they are.
    """
    weights = {"RGBA": LUMINANCE, "VECTOR": _MEAN}.get(kind)
    if isinstance(value, tuple):
        return sum(v * w for v, w in zip(value, weights or LUMINANCE, strict=True))
    if weights is None or not isinstance(value, NodeRef) or graph.node(value).kind == "field":
        return value
    return graph.add("vector_math", function="dot", in1=value, in2=weights)


def own_value(socket: bpy.types.NodeSocket) -> NodeInput | None:
    """Return the value that a socket has without a link."""
    if socket.type in ("VALUE", "INT", "BOOLEAN"):
        return float(socket.default_value)
    if socket.type in ("RGBA", "VECTOR", "ROTATION"):
        x, y, z = tuple(socket.default_value)[:3]
        return float(x), float(y), float(z)
    return None


def source_of(socket: bpy.types.NodeSocket, groups: Groups) -> tuple[bpy.types.NodeSocket, Groups] | None:
    """Return the output that feeds `socket`, or the input whose own value counts, and the groups it is in."""
    for _ in range(_MAX_DEPTH):
        if not socket.is_output:
            if not socket.is_linked:
                return socket, groups
            link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
            if link is None:
                return socket, groups
            socket = link.from_socket
            continue
        node = socket.node
        if node.mute or node.bl_idname == "NodeReroute":
            inside = next((i.from_socket for i in node.internal_links if i.to_socket == socket), None)
            if node.bl_idname == "NodeReroute":
                inside = node.inputs[0]
            if inside is None:
                return None
            socket = inside
        elif node.bl_idname == "ShaderNodeGroup":
            inside = _output_inside(node, socket)
            if inside is None:
                return None
            socket, groups = inside, (*groups, node)
        elif node.bl_idname == "NodeGroupInput" and groups:
            outside = next((s for s in groups[-1].inputs if s.identifier == socket.identifier), None)
            if outside is None:
                return None
            socket, groups = outside, groups[:-1]
        else:
            return socket, groups
    return None


def _output_inside(group: bpy.types.Node, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the input of a group's output node that is seen from outside as `socket`."""
    if group.node_tree is None:
        return None
    outputs = [n for n in group.node_tree.nodes if n.bl_idname == "NodeGroupOutput"]
    active = next((n for n in outputs if n.is_active_output), outputs[0] if outputs else None)
    if active is None:
        return None
    return next((s for s in active.inputs if s.identifier == socket.identifier), None)

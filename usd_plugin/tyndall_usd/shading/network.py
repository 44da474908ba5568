"""Walking a UsdShade network: inputs through node graphs to constants or to the nodes that feed them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from pxr import Sdf, UsdShade
from tyndall.graph import Graph, Vector, to_vector
from tyndall.medium import Medium
from tyndall.prims import NodeInput, NodeRef

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from pxr import Usd
    from tyndall.messages import Messages

    from tyndall_usd.assets import Assets


Converted: TypeAlias = NodeInput | Medium


@dataclass(slots=True)
class Network:
    """The conversion of one terminal of one material.

    Parameters
    ----------
    is_volume : bool
        Whether geometric properties name fields of a volume instead of primvars.
    converters : mapping
        Source node id (or the start of it, ending in ``_``) to converter.
    """

    graph: Graph
    time: Usd.TimeCode
    assets: Assets
    messages: Messages
    is_volume: bool
    converters: Mapping[str, Callable[[ShaderNode], Converted | None]]
    _done: dict[tuple[Sdf.Path, str], Converted | None] = field(default_factory=dict)
    _open: set[Sdf.Path] = field(default_factory=set)

    def converter(self, node_id: str) -> Callable[[ShaderNode], Converted | None] | None:
        """Return the converter for `node_id`: its own, or that of the longest start in the table."""
        exact = self.converters.get(node_id)
        if exact is not None:
            return exact
        starts = [start for start in self.converters if start.endswith("_") and node_id.startswith(start)]
        return self.converters[max(starts, key=len)] if starts else None

    def convert(self, shader: UsdShade.Shader, output: str) -> Converted | None:
        """Convert `shader`; ``None``, with a message, if that is not possible."""
        path = shader.GetPath()
        key = (path, output)
        if key in self._done:
            return self._done[key]
        if path in self._open:
            self.messages.error(path, "the shader network runs in a circle", "its input keeps its default")
            return None
        node_id = shader_id(shader)
        converter = self.converter(node_id)
        if converter is None:
            self.messages.warning(path, f"shader {node_id!r} is not known", "its output is ignored")
            return None
        self._open.add(path)
        result = converter(ShaderNode(self, shader, output, node_id))
        self._open.discard(path)
        self._done[key] = result
        return result


def shader_id(shader: UsdShade.Shader) -> str:
    """Return the id of `shader`, or where its source is if it has none."""
    node_id = shader.GetIdAttr().Get()
    if node_id:
        return str(node_id)
    source = next((a for a in shader.GetPrim().GetAuthoredAttributes() if "sourceAsset" in a.GetName()), None)
    value = source.Get() if source else None
    return f"source {value.path}" if value is not None else ""


@dataclass(frozen=True, slots=True)
class ShaderNode:
    """One source node as converters see it."""

    network: Network
    shader: UsdShade.Shader
    output: str
    node_id: str

    @property
    def graph(self) -> Graph:
        """The graph that is built."""
        return self.network.graph

    def warn(self, what: str, action: str) -> None:
        """Add a message about this node."""
        self.network.messages.warning(self.shader.GetPath(), what, action)

    def is_authored(self, name: str) -> bool:
        """Return whether the input has a value or a connection."""
        source = self.shader.GetInput(name)
        return bool(source) and (source.HasConnectedSource() or source.GetAttr().HasAuthoredValue())

    def converted(self, name: str) -> Converted | None:
        """Return the input as a constant or what feeds it; ``None`` if it has neither."""
        attribute = self._producer(name)
        if attribute is None:
            return None
        if UsdShade.Output.IsOutput(attribute):
            shader = UsdShade.Shader(attribute.GetPrim())
            if shader and shader.GetPrim().IsA(UsdShade.Shader):
                return self.network.convert(shader, UsdShade.Output(attribute).GetBaseName())
        return _constant(attribute.Get(self.network.time))

    def value(self, name: str) -> NodeInput | None:
        """Return the input as a constant or a node."""
        value = self.converted(name)
        return None if isinstance(value, Medium) else value

    def value_or(self, name: str, default: NodeInput) -> NodeInput:
        """Return the input as a constant or a node, or `default` if there is neither."""
        value = self.value(name)
        return default if value is None else value

    def text(self, name: str, default: str = "") -> str:
        """Return a token or string input."""
        value = self.value(name)
        return value if isinstance(value, str) else default

    def number(self, name: str, default: float) -> float:
        """Return an input that must be constant; a connected one gives a message and `default`."""
        value = self.value(name)
        if isinstance(value, NodeRef):
            self.warn(f"input {name} varies; only a constant is supported", f"{default:g} is used")
            return default
        if isinstance(value, tuple):
            return value[0]
        return value if isinstance(value, float) else default

    def vector(self, name: str, default: Vector) -> Vector:
        """Return a vector input that must be constant; a connected one gives a message and `default`."""
        value = self.value(name)
        if isinstance(value, NodeRef):
            self.warn(f"input {name} varies; only a constant is supported", f"{default} is used")
            return default
        return to_vector(value) if isinstance(value, (float, tuple)) else default

    def raw(self, name: str) -> Any:  # noqa: ANN401 - a value of any of USD's types
        """Return an unconverted constant."""
        attribute = self._producer(name)
        return None if attribute is None else attribute.Get(self.network.time)

    def file(self, name: str) -> tuple[str | None, str]:
        """Return the file an asset input names, if it exists, and its authored colour space."""
        attribute = self._producer(name)
        if attribute is None:
            self.warn(f"input {name} is empty", "name an image file")
            return None, ""
        if not isinstance(attribute.Get(self.network.time), Sdf.AssetPath):
            self.warn(f"input {name} is not a file", "name an image file")
            return None, ""
        space = attribute.GetColorSpace() if attribute.HasColorSpace() else ""
        return self.network.assets.resolve(attribute, self.network.time, self.network.messages), str(space)

    def authored(self) -> list[str]:
        """Return the names of the inputs that have a value or a connection."""
        names = (str(i.GetBaseName()) for i in self.shader.GetInputs(onlyAuthored=True))
        return sorted(name for name in names if self.is_authored(name))

    def ignore_all_but(self, supported: Collection[str]) -> None:
        """Add one message that names the authored inputs that are not in `supported`."""
        ignored = [name for name in self.authored() if name not in supported]
        if ignored:
            self.warn(
                f"{self.node_id} is approximated; ignored inputs: {', '.join(ignored)}", "check the look"
            )

    def _producer(self, name: str) -> Usd.Attribute | None:
        source = self.shader.GetInput(name)
        if not source:
            return None
        producers = UsdShade.Utils.GetValueProducingAttributes(source)
        return producers[0] if producers else None


def _constant(value: object) -> NodeInput | None:
    if value is None:
        return None
    if isinstance(value, (bool, int, float)):
        return float(value)
    if isinstance(value, (str, Sdf.AssetPath)):
        return value if isinstance(value, str) else str(value.path)
    try:
        numbers = [float(component) for component in value]  # type: ignore[attr-defined]
    except TypeError:
        return None
    x, y, z = (*numbers, 0.0, 0.0, 0.0)[:3]
    return x, y, z

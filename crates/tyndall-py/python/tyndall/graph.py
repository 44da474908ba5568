"""The shading graph while it is built."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from tyndall.prims import Node, NodeInput, NodeRef, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

Vector: TypeAlias = tuple[float, float, float]


class Graph:
    """Nodes in order, inputs before their users; equal nodes are one."""

    __slots__ = ("_refs", "nodes")

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._refs: dict[object, NodeRef] = {}

    def add(self, kind: str, /, **inputs: NodeInput | Table | None) -> NodeRef:
        """Return a node of `kind`; inputs that are ``None`` keep the kind's default."""
        authored = {name: value for name, value in inputs.items() if value is not None}
        ref = self._refs.setdefault(
            (kind, tuple(sorted(authored.items(), key=_name))), NodeRef(len(self.nodes))
        )
        if ref.index == len(self.nodes):
            self.nodes.append(Node(kind, authored))
        return ref

    def node(self, ref: NodeRef) -> Node:
        """Return the node `ref` points to."""
        return self.nodes[ref.index]

    def combine(self, kind: str, a: NodeInput, b: NodeInput) -> NodeInput:
        """Return the product, sum or difference (`kind` multiply, add, subtract); constants are folded."""
        if isinstance(a, (NodeRef, str)) or isinstance(b, (NodeRef, str)):
            if kind == "multiply" and is_one(a):
                return b
            if kind == "multiply" and is_one(b):
                return a
            if kind != "multiply" and is_zero(b):
                return a
            return self.add(kind, in1=a, in2=b)
        if isinstance(a, float) and isinstance(b, float):
            return _fold(kind, a, b)
        (ax, ay, az), (bx, by, bz) = to_vector(a), to_vector(b)
        return _fold(kind, ax, bx), _fold(kind, ay, by), _fold(kind, az, bz)


def _name(item: tuple[str, object]) -> str:
    return item[0]


def _fold(kind: str, a: float, b: float) -> float:
    return {"multiply": a * b, "add": a + b, "subtract": a - b}[kind]


def to_vector(value: float | Vector) -> Vector:
    """Return a number as a grey vector, a vector as it is."""
    return (value, value, value) if isinstance(value, float) else value


def is_one(value: NodeInput) -> bool:
    """Return whether `value` is the constant 1."""
    return value in (1.0, (1.0, 1.0, 1.0))


def is_zero(value: NodeInput) -> bool:
    """Return whether `value` is the constant 0."""
    return value in (0.0, (0.0, 0.0, 0.0))


def compact(nodes: Sequence[Node], roots: Sequence[int]) -> tuple[list[Node], dict[int, int]]:
    """Return the nodes that `roots` need, and their new index by the old one."""
    needed: set[int] = set()
    pending = list(roots)
    while pending:
        index = pending.pop()
        if index not in needed:
            needed.add(index)
            pending += [value.index for value in nodes[index].inputs.values() if isinstance(value, NodeRef)]
    new_index = {old: new for new, old in enumerate(sorted(needed))}
    kept = [
        Node(
            nodes[old].kind,
            {
                name: NodeRef(new_index[value.index]) if isinstance(value, NodeRef) else value
                for name, value in nodes[old].inputs.items()
            },
        )
        for old in sorted(needed)
    ]
    return kept, new_index

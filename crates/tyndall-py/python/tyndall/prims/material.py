"""Shading graphs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True, slots=True)
class NodeRef:
    """The output of the node at `index`, which comes earlier in the list."""

    index: int


@dataclass(frozen=True, slots=True)
class Table:
    """A list of numbers, such as the colours of a ramp."""

    values: tuple[float, ...]


NodeInput: TypeAlias = float | tuple[float, float, float] | str | NodeRef


@dataclass(frozen=True, slots=True)
class Node:
    """A node of the shading graph: its kind's name and the inputs that are authored."""

    kind: str
    inputs: Mapping[str, NodeInput | Table] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Material:
    """A shading graph: nodes, inputs before their users, and the indices of its two terminals.

    ``surface=None`` means no surface at all: an invisible, index-matched boundary.
    """

    nodes: Sequence[Node] = ()
    surface: int | None = None
    volume: int | None = None

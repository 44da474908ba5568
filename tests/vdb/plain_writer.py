"""Writes VDB files in storage forms that OpenVDB's Python module cannot be asked for.

The module always writes Blosc with active masks in the current file version. This writer makes the other
combinations (no packing, zip, Blosc, each with and without active masks, full or half floats, every value
type, file versions 218 to 225, stream files, every linear map type). It is written from the format alone and
judged by OpenVDB, which has to read its files back with equal values.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import blosc
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Sequence

ZIP = 1
ACTIVE_MASK = 2
BLOSC = 4
NODE_MASKS = 222
SELECTIVE_COMPRESSION = 220
SLOTS_LOG2 = {7: 5, 3: 4}

Origin = tuple[int, int, int]
Values = npt.NDArray[Any]
Bits = npt.NDArray[np.bool_]
Leaf = tuple[Values, Bits]
Value = Any
"""A number, or three of them in a tuple."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A type of values."""

    name: str
    dtype: type
    width: int = 1
    """Numbers in a value."""
    has_half: bool = False
    """Whether grids of it can be saved as half floats."""

    def full(self, count: int, value: Value) -> Values:
        """Return an array of equal values."""
        shape = (count,) if self.width == 1 else (count, self.width)
        return np.full(shape, value, dtype=self.dtype)

    def bytes(self, *values: Value) -> bytes:
        """Return values as nodes and backgrounds store them."""
        return np.asarray(values, dtype=self.dtype).tobytes()

    def where_equal(self, values: Values, value: Value) -> Bits:
        """Return which of the values equal one."""
        equal = values == np.asarray(value, dtype=self.dtype)
        return equal if self.width == 1 else equal.all(axis=-1)

    def distinct(self, values: Values) -> list[Value]:
        """Return the different values in order of appearance, vectors as tuples."""
        return list(dict.fromkeys(values.tolist() if self.width == 1 else map(tuple, values.tolist())))

    def negated(self, value: Value) -> Value:
        """Return what OpenVDB calls the negative of a value."""
        if self.dtype is np.bool_:
            return not value
        return -value if self.width == 1 else tuple(-v for v in value)


KINDS = {
    kind.name: kind
    for kind in (
        Kind("float", np.float32, has_half=True),
        Kind("double", np.float64, has_half=True),
        Kind("half", np.float16),
        Kind("int32", np.int32),
        Kind("int64", np.int64),
        Kind("bool", np.bool_),
        Kind("mask", np.bool_),
        Kind("vec3s", np.float32, width=3, has_half=True),
        Kind("vec3d", np.float64, width=3, has_half=True),
        Kind("vec3i", np.int32, width=3),
    )
}


@dataclass(frozen=True, slots=True)
class Tile:
    """A cube of side ``2**size_log2`` (8, 128 or 4096 voxels) with one value."""

    origin: Origin
    size_log2: int
    value: Value
    active: bool


@dataclass(slots=True)
class Tree:
    """Leaves of 512 values (z fastest) with their active masks, and tiles."""

    background: Value
    leaves: dict[Origin, Leaf] = field(default_factory=dict)
    tiles: list[Tile] = field(default_factory=list)
    kind: Kind = KINDS["float"]


@dataclass(frozen=True, slots=True)
class Form:
    """How a tree is stored."""

    flags: int
    half: bool = False
    version: int = 224
    block_bytes: int = 0
    """Forced Blosc block size; 0 is one block, as OpenVDB writes since version 4."""
    wrong_hint: bool = False
    """State that the leaf buffers begin at the grid's start; OpenVDB does not go by that offset."""


@dataclass(frozen=True, slots=True)
class PlainGrid:
    """A grid to write; ``parent`` is the unique name of the grid whose tree it shares."""

    unique_name: str
    tree: Tree
    map_type: str
    map_numbers: Sequence[float]
    form: Form
    grid_class: str = "unknown"
    parent: str = ""


def write_file(grids: Sequence[PlainGrid], *, stream: bool = False) -> bytes:
    """Return the bytes of a file; all grids must have the same version."""
    form = grids[0].form
    out = bytearray(b" BDV\0\0\0\0" + struct.pack("<III?", form.version, 10, 0, not stream))
    if SELECTIVE_COMPRESSION <= form.version < NODE_MASKS:
        out += bytes([form.flags & ZIP])
    out += b"00000000-0000-0000-0000-000000000000"
    out += struct.pack("<Ii", 0, len(grids))
    for grid in grids:
        half_suffix = "_HalfFloat" if grid.form.half else ""
        tree_type = f"Tree_{grid.tree.kind.name}_5_4_3{half_suffix}"
        out += _text(grid.unique_name) + _text(tree_type) + _text(grid.parent)
        head, topology, buffers = _grid_parts(grid)
        start = len(out) + 24
        block = start + len(head) + len(topology)
        hint = start if grid.form.wrong_hint else block
        offsets = (0, 0, 0) if stream else (start, hint, block + len(buffers))
        out += struct.pack("<qqq", *offsets) + head + topology + buffers
    return bytes(out)


def _text(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _grid_parts(grid: PlainGrid) -> tuple[bytes, bytes, bytes]:
    head = struct.pack("<I", grid.form.flags) if grid.form.version >= NODE_MASKS else b""
    head += struct.pack("<I", 2) + _text("class") + _text("string") + _text(grid.grid_class)
    # OpenVDB goes by this entry, not by the type's suffix; without it, it reads garbage.
    head += _text("is_saved_as_half_float") + _text("bool") + struct.pack("<I?", 1, grid.form.half)
    head += _text(grid.map_type) + struct.pack(f"<{len(grid.map_numbers)}d", *grid.map_numbers)
    if grid.parent:
        return head, b"", b""
    writer = _TreeWriter(grid.tree, grid.form)
    return head, writer.topology(), writer.buffers()


def scale_numbers(scale: Sequence[float]) -> list[float]:
    """Return what a scale map stores: scale, voxel size, 1/s, 1/s², 1/2s."""
    values = np.asarray(scale, dtype=np.float64)
    parts = [values, np.abs(values), 1 / values, 1 / values**2, 0.5 / values]
    return [float(v) for v in np.concatenate(parts)]


class _TreeWriter:
    """Serializes one tree in one form."""

    def __init__(self, tree: Tree, form: Form) -> None:
        self.tree = tree
        self.kind = tree.kind
        self.form = form
        self.leaf_order: list[Origin] = []
        self.lower: dict[Origin, list[Origin]] = {}
        self.upper: dict[Origin, list[Origin]] = {}
        for origin in tree.leaves:
            self._add_below(origin, 3)
        for tile in tree.tiles:
            if tile.size_log2 < 12:
                self._add_below(tile.origin, tile.size_log2)

    def _add_below(self, origin: Origin, size_log2: int) -> None:
        """Make sure the internal nodes above a leaf or tile exist."""
        upper = _aligned(origin, 12)
        self.upper.setdefault(upper, [])
        if size_log2 == 3:
            lower = _aligned(origin, 7)
            if lower not in self.lower:
                self.lower[lower] = []
                self.upper[upper].append(lower)
            if origin in self.tree.leaves:
                self.lower[lower].append(origin)

    def topology(self) -> bytes:
        root_tiles = [tile for tile in self.tree.tiles if tile.size_log2 == 12]
        out = struct.pack("<i", 1) + self.kind.bytes(self.tree.background)
        out += struct.pack("<II", len(root_tiles), len(self.upper))
        for tile in sorted(root_tiles, key=lambda tile: tile.origin):
            out += struct.pack("<iii", *tile.origin) + self.kind.bytes(tile.value) + bytes([tile.active])
        for origin in sorted(self.upper):
            out += struct.pack("<iii", *origin) + self._node(origin, 7, sorted(self.upper[origin]))
            for lower in sorted(self.upper[origin]):
                leaves = sorted(self.lower[lower])
                out += self._node(lower, 3, leaves)
                for leaf in leaves:
                    out += _mask(self.tree.leaves[leaf][1])
                    self.leaf_order.append(leaf)
        return out

    def _node(self, origin: Origin, child_log2: int, children: list[Origin]) -> bytes:
        log2 = SLOTS_LOG2[child_log2]
        count = 1 << (3 * log2)
        child_mask = np.zeros(count, dtype=np.bool_)
        active = np.zeros(count, dtype=np.bool_)
        values = self.kind.full(count, self.tree.background)
        for child in children:
            child_mask[_slot(origin, child, child_log2)] = True
            values[_slot(origin, child, child_log2)] = 0
        for tile in self.tree.tiles:
            if tile.size_log2 == child_log2 and _aligned(tile.origin, child_log2 + log2) == origin:
                values[_slot(origin, tile.origin, child_log2)] = tile.value
                active[_slot(origin, tile.origin, child_log2)] = tile.active
        out = _mask(child_mask) + _mask(active)
        if self.form.version < NODE_MASKS:
            return out + self._pack(values[~child_mask])
        return out + self._block(values, active, child_mask)

    def buffers(self) -> bytes:
        out = bytearray()
        for origin in self.leaf_order:
            values, active = self.tree.leaves[origin]
            out += _mask(active)
            if self.kind.dtype is np.bool_:
                # Never packed; in mask grids the active voxels are the true ones.
                out += struct.pack("<iii", *origin) + (_mask(values) if self.kind.name == "bool" else b"")
            elif self.form.version < NODE_MASKS:
                out += struct.pack("<iiib", *origin, 1) + self._pack(values)
            else:
                out += self._block(values, active, np.zeros(512, dtype=np.bool_))
        return bytes(out)

    def _block(self, values: Values, active: Bits, children: Bits) -> bytes:
        if not self.form.flags & ACTIVE_MASK:
            return b"\x06" + self._pack(values)
        inactive = self.kind.distinct(values[~active & ~children])
        code, stored, selected = _mask_code(inactive, self.tree.background, self.kind)
        if code == 6:
            return b"\x06" + self._pack(values)
        out = bytes([code]) + self.kind.bytes(*stored)
        if 3 <= code <= 5:
            out += _mask(~active & self.kind.where_equal(values, selected))
        return out + self._pack(values[active])

    def _pack(self, values: Values) -> bytes:
        is_half = self.form.half and self.kind.has_half
        data = (values.astype(np.float16) if is_half else values).tobytes()
        if is_half and not data:
            return b""
        packed = b""
        if self.form.flags & BLOSC and data:
            blosc.set_blocksize(self.form.block_bytes or len(data))
            packed = blosc.compress(data, typesize=4, clevel=9, shuffle=blosc.SHUFFLE, cname="lz4")
        elif self.form.flags & ZIP:
            packed = zlib.compress(data)
        elif not self.form.flags & BLOSC:
            return data
        if 0 < len(packed) < len(data):
            return struct.pack("<q", len(packed)) + packed
        return struct.pack("<q", -len(data)) + data


def _mask_code(inactive: list[Value], background: Value, kind: Kind) -> tuple[int, list[Value], Value]:
    """Return the code byte, the inactive values to store, and the value that the selection mask marks."""
    background = kind.distinct(kind.full(1, background))[0]
    others = [value for value in inactive if value != background]
    if len(inactive) > 2:
        return 6, [], None
    if not others:
        return 0, [], None
    if len(inactive) == 1:
        return (1, [], None) if others[0] == kind.negated(background) else (2, others, None)
    if len(others) == 1:
        is_negative = others[0] == kind.negated(background)
        return (3, [], background) if is_negative else (4, others, background)
    return 5, others, others[1]


def _aligned(origin: Origin, log2: int) -> Origin:
    x, y, z = (c >> log2 << log2 for c in origin)
    return x, y, z


def _slot(node: Origin, child: Origin, child_log2: int) -> int:
    log2 = SLOTS_LOG2[child_log2]
    x, y, z = ((c - n) >> child_log2 for c, n in zip(child, node, strict=True))
    return x << (2 * log2) | y << log2 | z


def _mask(bits: Bits) -> bytes:
    return np.packbits(bits, bitorder="little").tobytes()

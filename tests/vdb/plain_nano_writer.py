"""Writes NanoVDB files (format 32) from the layout that ``NanoVDB.h`` describes.

The tree is the plain writer's; `ctypes` arranges the structures as a C compiler does, so that this shares no
arithmetic with the reader under test. All codecs, bare grids, and floats quantized to 4, 8, 16 or a varying
number of bits can be written. Statistics and checksums are left empty: nothing needs them to look up values.
"""

from __future__ import annotations

import ctypes as c
import struct
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import blosc
import numpy as np
from plain_writer import Kind, Origin, Tree, Values, _aligned, _slot

if TYPE_CHECKING:
    from collections.abc import Sequence

ALIGNMENT = 32
VERSION = 32 << 21 | 6 << 10
MAGIC_FILE, MAGIC_GRID = b"NanoVDB2", b"NanoVDB1"
CODECS = {"none": 0, "zip": 1, "blosc": 2}
GRID_TYPES = {
    "float": 1,
    "double": 2,
    "int32": 4,
    "int64": 5,
    "vec3s": 6,
    "vec3d": 7,
    "mask": 8,
    "bool": 11,
    "fp4": 13,
    "fp8": 14,
    "fp16": 15,
    "fpn": 16,
}
CLASSES = {"unknown": 0, "level set": 1, "fog volume": 2, "staggered": 3}
BITS = {"fp4": 4, "fp8": 8, "fp16": 16}
SCALARS = {
    np.float32: c.c_float,
    np.float64: c.c_double,
    np.int32: c.c_int32,
    np.int64: c.c_int64,
    np.bool_: c.c_bool,
}


@dataclass(frozen=True, slots=True)
class NanoGrid:
    """A grid to write; ``storage`` is the value type's name or a quantization."""

    name: str
    tree: Tree
    storage: str
    matrix: Sequence[float] = (1, 0, 0, 0, 1, 0, 0, 0, 1)
    translation: Sequence[float] = (0, 0, 0)
    grid_class: str = "unknown"


class _Map(c.Structure):
    _fields_ = (
        ("matrix_f", c.c_float * 9),
        ("inverse_f", c.c_float * 9),
        ("vector_f", c.c_float * 3),
        ("taper_f", c.c_float),
        ("matrix", c.c_double * 9),
        ("inverse", c.c_double * 9),
        ("vector", c.c_double * 3),
        ("taper", c.c_double),
    )


class _GridData(c.Structure):
    _fields_ = (
        ("magic", c.c_char * 8),
        ("checksum", c.c_uint64),
        ("version", c.c_uint32),
        ("flags", c.c_uint32),
        ("index", c.c_uint32),
        ("count", c.c_uint32),
        ("size", c.c_uint64),
        ("name", c.c_char * 256),
        ("map", _Map),
        ("world_box", c.c_double * 6),
        ("voxel_size", c.c_double * 3),
        ("grid_class", c.c_uint32),
        ("grid_type", c.c_uint32),
        ("blind_offset", c.c_int64),
        ("blind_count", c.c_uint32),
        ("data", c.c_uint32 * 5),
    )


class _TreeData(c.Structure):
    _fields_ = (
        ("node_offset", c.c_int64 * 4),
        ("node_count", c.c_uint32 * 3),
        ("tile_count", c.c_uint32 * 3),
        ("voxel_count", c.c_uint64),
    )


class _Layout:
    """The structures for one kind of values."""

    def __init__(self, kind: Kind, storage: str) -> None:
        scalar = SCALARS[kind.dtype]
        value = scalar if kind.width == 1 else scalar * kind.width
        floating = c.c_bool if scalar is c.c_bool else c.c_double if c.sizeof(scalar) == 8 else c.c_float
        stats = [("least", value), ("most", value), ("mean", floating), ("deviation", floating)]
        box = ("box", c.c_int32 * 6)
        entry = type("Entry", (c.Union,), {"_fields_": [("value", value), ("child", c.c_int64)]})

        def structure(*fields: tuple[str, Any]) -> Any:
            return type("Structure", (c.Structure,), {"_fields_": fields})

        def aligned_last(fields: list[tuple[str, Any]], last: tuple[str, Any]) -> Any:
            padding = -c.sizeof(structure(*fields)) % ALIGNMENT
            return structure(*fields, ("padding", c.c_uint8 * padding), last)

        def node(slots: int) -> Any:
            masks = [("active", c.c_uint8 * (slots // 8)), ("children", c.c_uint8 * (slots // 8))]
            return aligned_last([box, ("flags", c.c_uint64), *masks, *stats], ("table", entry * slots))

        self.root = structure(box, ("table_size", c.c_uint32), ("background", value), *stats)
        self.root_entry = structure(
            ("key", c.c_uint64), ("child", c.c_int64), ("state", c.c_uint32), ("value", value)
        )
        self.upper, self.lower = node(32**3), node(16**3)
        head = [
            ("low", c.c_int32 * 3),
            ("span", c.c_uint8 * 3),
            ("flags", c.c_uint8),
            ("active", c.c_uint8 * 64),
        ]
        if storage == "bool":
            self.leaf = structure(*head, ("values", c.c_uint8 * 64), ("padding", c.c_uint64 * 2))
        elif storage == "mask":
            self.leaf = structure(*head, ("padding", c.c_uint64 * 2))
        elif storage in {"fp4", "fp8", "fp16", "fpn"}:
            self.leaf = structure(
                *head, ("offset", c.c_float), ("step", c.c_float), ("codes_of_stats", c.c_uint16 * 4)
            )
        else:
            self.leaf = aligned_last([*head, *stats], ("values", value * 512))


def quantized(values: Values, bits: int) -> tuple[Values, np.float32, np.float32]:
    """Return codes, step and offset for the values of a leaf."""
    low, high = np.float32(values.min()), np.float32(values.max())
    step = np.float32(high - low) / np.float32((1 << bits) - 1)
    codes = np.zeros(512) if step == 0 else np.round((values - low) / step)
    return codes.clip(0, (1 << bits) - 1).astype(np.uint16), step, low


def leaf_bits(grid: NanoGrid, origin: Origin) -> int:
    """Return how many bits a code of a quantized leaf has."""
    x, y, z = origin
    return BITS.get(grid.storage) or 1 << (x + 3 * y + 7 * z) // 8 % 5


def dequantized(grid: NanoGrid) -> Tree:
    """Return the tree with the values that a reader must find."""
    tree = Tree(grid.tree.background, tiles=grid.tree.tiles, kind=grid.tree.kind)
    for origin, (values, active) in grid.tree.leaves.items():
        codes, step, low = quantized(values, leaf_bits(grid, origin))
        tree.leaves[origin] = (codes.astype(np.float32) * step + low, active)
    return tree


def image(grid: NanoGrid, *, index: int = 0, count: int = 1) -> bytes:
    """Return a grid as it lies in memory."""
    return _ImageWriter(grid).image(index, count)


class _ImageWriter:
    def __init__(self, grid: NanoGrid) -> None:
        self.grid = grid
        self.kind = grid.tree.kind
        self.layout = _Layout(self.kind, grid.storage)
        tree = grid.tree
        below = [*tree.leaves, *(tile.origin for tile in tree.tiles if tile.size_log2 == 3)]
        lowers = dict.fromkeys(_aligned(origin, 7) for origin in below)
        uppers = [*lowers, *(tile.origin for tile in tree.tiles if tile.size_log2 == 7)]
        self.leaves = sorted(tree.leaves)
        self.lowers = sorted(lowers)
        self.uppers = sorted(dict.fromkeys(_aligned(origin, 12) for origin in uppers))
        self.root_tiles = [tile for tile in tree.tiles if tile.size_log2 == 12]

    def image(self, index: int, count: int) -> bytes:
        entries = len(self.uppers) + len(self.root_tiles)
        sizes = {
            "root": _round_up(c.sizeof(self.layout.root))
            + entries * _round_up(c.sizeof(self.layout.root_entry)),
            "upper": len(self.uppers) * _round_up(c.sizeof(self.layout.upper)),
            "lower": len(self.lowers) * _round_up(c.sizeof(self.layout.lower)),
        }
        root_at = c.sizeof(_GridData) + c.sizeof(_TreeData)
        upper_at = root_at + sizes["root"]
        lower_at = upper_at + sizes["upper"]
        leaf_at = lower_at + sizes["lower"]
        leaves, leaf_offsets = self._leaves(leaf_at)
        lower_offsets = _offsets(self.lowers, lower_at, _round_up(c.sizeof(self.layout.lower)))
        upper_offsets = _offsets(self.uppers, upper_at, _round_up(c.sizeof(self.layout.upper)))
        body = self._root(root_at, upper_offsets)
        body += self._nodes(self.layout.upper, upper_offsets, lower_offsets, 7)
        body += self._nodes(self.layout.lower, lower_offsets, leaf_offsets, 3)
        body += leaves
        tree_at = c.sizeof(_GridData)
        tree = _TreeData(
            (leaf_at - tree_at, lower_at - tree_at, upper_at - tree_at, root_at - tree_at),
            (len(self.leaves), len(self.lowers), len(self.uppers)),
            (0, 0, 0),
            sum(int(active.sum()) for _, active in self.grid.tree.leaves.values()),
        )
        head = self._head(root_at + len(body), index, count)
        return bytes(head) + bytes(tree) + body

    def _head(self, size: int, index: int, count: int) -> _GridData:
        grid = self.grid
        inverse = np.linalg.inv(np.reshape(grid.matrix, (3, 3))).ravel()
        mapping = _Map(
            tuple(grid.matrix), tuple(inverse), tuple(grid.translation), 1.0,
            tuple(grid.matrix), tuple(inverse), tuple(grid.translation), 1.0,
        )  # fmt: skip
        return _GridData(
            magic=MAGIC_GRID,
            checksum=2**64 - 1,
            version=VERSION,
            flags=1 << 5,  # breadth first
            index=index,
            count=count,
            size=size,
            name=grid.name.encode(),
            map=mapping,
            voxel_size=tuple(np.abs(np.reshape(grid.matrix, (3, 3))).max(axis=0)),
            grid_class=CLASSES[grid.grid_class],
            grid_type=GRID_TYPES[grid.storage],
            blind_offset=size,
        )

    def _root(self, root_at: int, upper_offsets: dict[Origin, int]) -> bytes:
        root = self.layout.root(table_size=len(self.uppers) + len(self.root_tiles))
        _set(root, "background", self.grid.tree.background, self.kind)
        out = _padded(root)
        entries = [(origin, None) for origin in self.uppers]
        entries += [(tile.origin, tile) for tile in self.root_tiles]
        for origin, tile in sorted(entries, key=lambda entry: entry[0]):
            x, y, z = ((axis % 2**32) >> 12 for axis in origin)
            entry = self.layout.root_entry(key=x << 42 | y << 21 | z)
            if tile is None:
                entry.child = upper_offsets[origin] - root_at
            else:
                entry.state = tile.active
                _set(entry, "value", tile.value, self.kind)
            out += _padded(entry)
        return out

    def _nodes(
        self, structure: Any, offsets: dict[Origin, int], below: dict[Origin, int], child_log2: int
    ) -> bytes:
        log2 = 12 if child_log2 == 7 else 7
        nodes = {
            origin: structure(box=(*origin, *(axis + (1 << log2) - 1 for axis in origin)))
            for origin in offsets
        }
        for node in nodes.values():
            for entry in node.table:
                _set(entry, "value", self.grid.tree.background, self.kind)
        for child, offset in below.items():
            origin = _aligned(child, log2)
            slot = _slot(origin, child, child_log2)
            nodes[origin].children[slot // 8] |= 1 << slot % 8
            nodes[origin].table[slot].child = offset - offsets[origin]
        for tile in self.grid.tree.tiles:
            if tile.size_log2 == child_log2:
                origin = _aligned(tile.origin, log2)
                slot = _slot(origin, tile.origin, child_log2)
                nodes[origin].active[slot // 8] |= int(tile.active) << slot % 8
                _set(nodes[origin].table[slot], "value", tile.value, self.kind)
        return b"".join(_padded(node) for node in nodes.values())

    def _leaves(self, at: int) -> tuple[bytes, dict[Origin, int]]:
        out, offsets = bytearray(), {}
        for origin in self.leaves:
            offsets[origin] = at + len(out)
            values, active = self.grid.tree.leaves[origin]
            leaf = self.layout.leaf(low=origin, span=(7, 7, 7))
            leaf.active[:] = np.packbits(active, bitorder="little").tolist()
            codes = b""
            if self.grid.storage == "bool":
                leaf.values[:] = np.packbits(values, bitorder="little").tolist()
            elif self.grid.storage.startswith("fp"):
                bits = leaf_bits(self.grid, origin)
                leaf.flags = (bits.bit_length() - 1) << 5
                numbers, leaf.step, leaf.offset = quantized(values, bits)
                planes = (numbers[:, None] >> np.arange(bits)) & 1
                codes = np.packbits(planes.ravel().astype(np.bool_), bitorder="little").tobytes()
            elif self.grid.storage != "mask":
                c.memmove(leaf.values, values.tobytes(), len(values.tobytes()))
            out += bytes(leaf) + codes
            out += bytes(-len(out) % ALIGNMENT)
        return bytes(out), offsets


def _set(structure: Any, name: str, value: Any, kind: Kind) -> None:
    setattr(structure, name, kind.dtype(value).item() if kind.width == 1 else tuple(value))


def _round_up(size: int) -> int:
    return size + -size % ALIGNMENT


def _padded(structure: Any) -> bytes:
    return bytes(structure) + bytes(-c.sizeof(structure) % ALIGNMENT)


def _offsets(origins: list[Origin], at: int, size: int) -> dict[Origin, int]:
    return {origin: at + i * size for i, origin in enumerate(origins)}


def segment(grids: Sequence[NanoGrid], codec: str) -> bytes:
    """Return a segment: header, one entry per grid, then the grids."""
    out = MAGIC_FILE + struct.pack("<IHH", VERSION, len(grids), CODECS[codec])
    bodies = []
    for grid in grids:
        raw = image(grid)
        bodies.append(pack(raw, codec))
        name = grid.name.encode() + b"\0"
        numbers = (GRID_TYPES[grid.storage], CLASSES[grid.grid_class])
        out += struct.pack("<QQQQII", len(raw), len(bodies[-1]), 0, 0, *numbers)
        out += bytes(96) + struct.pack("<I", len(name)) + bytes(28)
        out += struct.pack("<HHI", CODECS[codec], 0, VERSION) + name
    return out + b"".join(bodies)


def pack(raw: bytes, codec: str) -> bytes:
    """Return a grid's bytes as a file has them."""
    if codec == "none":
        return raw
    if codec == "zip":
        packed = zlib.compress(raw)
    else:
        blosc.set_blocksize(1 << 18)
        packed = blosc.compress(raw, typesize=4, clevel=9, shuffle=blosc.SHUFFLE, cname="lz4")
    return struct.pack("<Q", len(packed)) + packed


def bare(grids: Sequence[NanoGrid]) -> bytes:
    """Return grids one after the other, without a segment."""
    return b"".join(image(grid, index=i, count=len(grids)) for i, grid in enumerate(grids))

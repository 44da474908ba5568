"""The facts about a grid that a reader must reproduce, in the form in which tests read them."""

from __future__ import annotations

import gzip
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from plain_writer import Origin, Tree, Value

SAMPLES = 400
CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]


def write_truth(path: Path, entries: list[dict[str, Any]]) -> None:
    """Write one grid per line, compressed; equal facts give equal bytes."""
    lines = ",\n".join(json.dumps(entry, separators=(",", ":")) for entry in entries)
    path.write_bytes(gzip.compress(f"[\n{lines}\n]\n".encode(), mtime=0))


def numbers(value: Value) -> list[float | int]:
    """Return a value's numbers; truth values as 0 and 1."""
    return [v.item() if isinstance(v, np.generic) else v for v in np.atleast_1d(np.asarray(value) * 1)]


def lookup(tree: Tree, voxel: Origin) -> tuple[Value, bool]:
    """Return the value and the state of a voxel."""
    leaf = tree.leaves.get(tuple(axis & ~7 for axis in voxel))
    if leaf is not None:
        x, y, z = (axis & 7 for axis in voxel)
        offset = x << 6 | y << 3 | z
        return leaf[0][offset], bool(leaf[1][offset])
    for tile in tree.tiles:
        side = 1 << tile.size_log2
        if all(low <= axis < low + side for low, axis in zip(tile.origin, voxel, strict=True)):
            return tile.value, tile.active
    return tree.background, False


def describe_tree(tree: Tree, rng: np.random.Generator) -> dict[str, Any]:
    """Return the facts about a tree, without its transform and class."""
    width = tree.kind.width
    boxes: list[tuple[Origin, Origin]] = []
    on: list[tuple[Origin, Origin]] = []
    active: list[tuple[list[float], int]] = []
    for (x, y, z), (values, states) in tree.leaves.items():
        for offset in range(512):
            voxel = (x + (offset >> 6), y + (offset >> 3 & 7), z + (offset & 7))
            boxes.append((voxel, voxel))
            if states[offset]:
                on.append(boxes[-1])
                active.append((numbers(values[offset]), 1))
    for tile in tree.tiles:
        x, y, z = (axis + (1 << tile.size_log2) - 1 for axis in tile.origin)
        boxes.append((tile.origin, (x, y, z)))
        if tile.active:
            on.append(boxes[-1])
            active.append((numbers(tree.kind.full(1, tile.value)[0]), 1 << 3 * tile.size_log2))
    points = sample_points(boxes, rng)
    found = [lookup(tree, point) for point in points]
    return {
        "type": tree.kind.name,
        "background": numbers(tree.kind.full(1, tree.background)[0]),
        "active": sum(count for _, count in active),
        **sums(active, width),
        "bounds": bounds(on) if on else None,
        "leaves": len(tree.leaves),
        "samples": [
            [*point, is_on, *numbers(tree.kind.full(1, value)[0])]
            for point, (value, is_on) in zip(points, found, strict=True)
        ],
    }


def bounds(boxes: list[tuple[Origin, Origin]]) -> list[list[int]]:
    """Return the box around boxes."""
    low, high = np.asarray(boxes).min(axis=0)[0], np.asarray(boxes).max(axis=0)[1]
    return [low.tolist(), high.tolist()]


def sums(active: list[tuple[list[float], int]], width: int) -> dict[str, list[float]]:
    """Return the sum of each component, and of its magnitude, over values and how often they occur."""
    return {
        name: [math.fsum(f(value[axis]) * count for value, count in active) for axis in range(width)]
        for name, f in (("sum", float), ("absolute_sum", abs))
    }


def sample_points(boxes: list[tuple[Origin, Origin]], rng: np.random.Generator) -> list[Origin]:
    """Return voxels in and around boxes, and at the ends of the range."""
    low, high = -(2**31), 2**31 - 1
    points: list[Origin] = [(0, 0, 0), (low, low, low), (high, high, high)]
    picks = rng.integers(len(boxes), size=4 * SAMPLES).tolist() if boxes else []
    for pick in picks:
        inside = [int(rng.integers(a, b, endpoint=True)) for a, b in zip(*boxes[pick], strict=True)]
        jump = rng.integers(-9, 10, size=3) if rng.random() < 0.3 else np.zeros(3, dtype=int)
        x, y, z = (min(max(c + int(d), low), high) for c, d in zip(inside, jump, strict=True))
        points.append((x, y, z))
    return list(dict.fromkeys(points))[:SAMPLES]

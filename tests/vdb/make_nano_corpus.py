"""Makes the NanoVDB files of ``crates/tyndall-vdb/tests/corpus_nano`` and their truth.

Usage: ``make_nano_corpus.py FOLDER`` with ``pip install warp-lang==1.19.0 blosc numpy``. NVIDIA Warp contains
NanoVDB and looks values up on the CPU; it is the referee. Some files Warp writes itself; those of
`plain_nano_writer` are accepted only if Warp finds the same values in them as in the tree they were made of.
Warp has no look-up for quantized, truth and mask grids: of those the tree is the truth.
"""

# No postponed annotations: Warp reads those of kernels.

import io
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
from plain_nano_writer import NanoGrid, bare, dequantized, segment
from plain_writer import KINDS, Kind, Origin, Tile, Tree, Value
from truth import CORNERS, bounds, describe_tree, numbers, sums, write_truth

wp.config.quiet = True
QUANTIZED = ("fp4", "fp8", "fp16", "fpn")
WARP_TYPES = {
    "float": wp.float32,
    "double": wp.float64,
    "int32": wp.int32,
    "int64": wp.int64,
    "vec3s": wp.vec3f,
    "vec3d": wp.vec3d,
}
# Turned by a quarter about z, scaled and shifted.
TURNED: dict[str, Any] = {"matrix": (0, -0.5, 0, 0.5, 0, 0, 0, 0, 2), "translation": (1.5, -2.5, 3.5)}


def kernel_for(dtype: Any) -> Any:
    """Return a kernel that looks up voxels."""

    @wp.kernel(module="unique")
    def look_up(volume: wp.uint64, voxels: wp.array(dtype=wp.vec3i), out: wp.array(dtype=dtype)):  # type: ignore[valid-type]
        voxel = voxels[wp.tid()]
        out[wp.tid()] = wp.volume_lookup(volume, voxel[0], voxel[1], voxel[2], dtype=dtype)

    return look_up


def warp_values(data: bytes, kind: Kind, points: list[Origin]) -> list[Any]:
    """Return the values that NanoVDB finds in the first grid of a file."""
    volume = wp.Volume.load_from_nvdb(io.BytesIO(data), device="cpu")
    dtype = WARP_TYPES[kind.name]
    out = wp.zeros(len(points), dtype=dtype, device="cpu")
    voxels = wp.array(np.asarray(points, dtype=np.int32), dtype=wp.vec3i, device="cpu")
    wp.launch(kernel_for(dtype), len(points), inputs=[volume.id, voxels, out], device="cpu")
    return [numbers(value) for value in out.numpy()]


def blob(kind: Kind, size: int = 11, low: Origin = (-3, 5, 1)) -> Tree:
    """Return a smooth blob off the leaf lattice, leaves only."""
    tree = Tree(kind.full(1, 0)[0], kind=kind)
    for voxel in np.ndindex(size, size, size):
        offset = np.asarray(voxel) - size / 2 + 0.3
        value = 1 - np.sqrt((offset**2).sum()) / (0.5 * size) * (1 + 0.2 * np.sin(offset[0] * offset[1]))
        if value <= 0:
            continue
        x, y, z = (int(a) + b for a, b in zip(voxel, low, strict=True))
        empty = (kind.full(512, 0), np.zeros(512, dtype=np.bool_))
        values, active = tree.leaves.setdefault((x & ~7, y & ~7, z & ~7), empty)
        at = (x & 7) << 6 | (y & 7) << 3 | z & 7
        number = value * (1000 if np.issubdtype(kind.dtype, np.integer) else 1)
        values[at] = number if kind.width == 1 else (number, -number, number * number)
        active[at] = True
    return tree


def with_tiles(tree: Tree, values: list[Value]) -> Tree:
    """Add tiles of all sizes, active and inactive."""
    a, b = values
    tree.tiles = [
        Tile((64, 0, 0), 3, a, active=True),
        Tile((72, 0, 0), 3, b, active=False),
        Tile((128, 0, 0), 7, b, active=True),
        Tile((0, 256, 0), 7, a, active=False),
        Tile((-8192, 0, 4096), 12, a, active=True),
        Tile((4096, -4096, 0), 12, b, active=False),
    ]
    return tree


class Corpus:
    """Collects files and their truth in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.truth: list[dict[str, Any]] = []
        self.rng = np.random.default_rng(20210806)

    def add(self, file: str, data: bytes, grids: list[NanoGrid], *, is_bare: bool = False) -> None:
        """Write a file; Warp must agree about the first grid, if it can look it up and opens the file."""
        (self.folder / file).write_bytes(data)
        for i, grid in enumerate(grids):
            tree = dequantized(grid) if grid.storage in QUANTIZED else grid.tree
            facts = describe_tree(tree, self.rng)
            if i == 0 and grid.storage in WARP_TYPES and not is_bare:
                points = [tuple(sample[:3]) for sample in facts["samples"]]
                if warp_values(data, tree.kind, points) != [sample[4:] for sample in facts["samples"]]:
                    message = f"{file}: Warp does not read what was written"
                    raise ValueError(message)
            matrix = np.reshape(grid.matrix, (3, 3))
            corners = [(matrix @ corner + grid.translation).tolist() for corner in CORNERS]
            index = sum(other.name == grid.name for other in grids[:i])
            entry = {"file": file, "name": grid.name, "index": index, "class": grid.grid_class}
            self.truth.append(entry | facts | {"corners": corners})

    def warp(self, file: str, codec: str, values: Any, background: Value, kind: Kind) -> None:
        """Let Warp write a dense array; its tiles of 8³ voxels are wholly active."""
        volume = wp.Volume.load_from_numpy(values, voxel_size=0.5, bg_value=background, device="cpu")
        path = self.folder / file
        volume.save_to_nvdb(str(path), codec=codec)
        leaves = sorted({tuple(int(c) & ~7 for c in voxel) for voxel in volume.get_voxels().numpy()})
        boxes = [((x, y, z), (x + 7, y + 7, z + 7)) for x, y, z in leaves]
        voxels = [tuple(int(c) for c in voxel) for voxel in volume.get_voxels().numpy()]
        found = warp_values(path.read_bytes(), kind, voxels)
        picks = self.rng.choice(len(voxels), size=min(400, len(voxels)), replace=False).tolist()
        outside = [(-1, 0, 0), (10**6, 5, -(10**6))]
        entry = {
            "file": file,
            "name": "",
            "index": 0,
            "class": "unknown",
            "type": kind.name,
            "background": numbers(kind.full(1, background)[0]),
            "active": len(voxels),
            **sums([(value, 1) for value in found], kind.width),
            "bounds": bounds(boxes),
            "leaves": len(leaves),
            "samples": [[*voxels[i], True, *found[i]] for i in picks]
            + [[*voxel, False, *numbers(kind.full(1, background)[0])] for voxel in outside],
            "corners": [[c * 0.5 for c in corner] for corner in CORNERS],
        }
        self.truth.append(entry)


def main() -> None:
    """Write the corpus into the folder named on the command line."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    wp.init()
    corpus = Corpus(folder)
    vector = [(1, 2, 3), (-4, 5, -6)]
    tile_values = {"bool": [True, True], "mask": [True, True], "vec3s": vector, "vec3d": vector}
    for name in ("float", "double", "int32", "int64", "vec3s", "vec3d", "bool", "mask"):
        tree = with_tiles(blob(KINDS[name]), tile_values.get(name, [7, -9]))
        if name == "mask":  # Active tiles are the true ones.
            tree.tiles = [replace(tile, value=tile.active) for tile in tree.tiles]
        grid = NanoGrid(name, tree, name, grid_class="fog volume")
        for codec in ("zip", "blosc"):
            corpus.add(f"type_{name}_{codec}.nvdb", segment([grid], codec), [grid])
    for storage in QUANTIZED:
        grid = NanoGrid("density", with_tiles(blob(KINDS["float"], 13), [7, -9]), storage, **TURNED)
        corpus.add(f"type_{storage}_zip.nvdb", segment([grid], "zip"), [grid])
    single = [
        NanoGrid("density", blob(KINDS["float"], 6, (5, 5, 5)), "float", grid_class="level set", **TURNED)
    ]
    corpus.add("raw.nvdb", segment(single, "none"), single)
    hollow = [Tree(0.5, tiles=[Tile((4096, 0, 0), 12, 2.0 + i, active=True)]) for i in range(3)]
    grids = [NanoGrid("same", tree, "float") for tree in hollow[:2]] + [NanoGrid("last", hollow[2], "float")]
    corpus.add("bare.nvdb", bare(grids), grids, is_bare=True)
    corpus.add("two_segments.nvdb", segment(grids[:2], "zip") + segment(grids[2:], "blosc"), grids)
    empty = [NanoGrid("nothing", Tree(7.0), "float")]
    corpus.add("empty.nvdb", segment(empty, "none"), empty)
    values = np.random.default_rng(5).random((19, 9, 11), dtype=np.float32)
    # Not Blosc: Warp packs with BloscLZ, which NanoVDB's own writer never does.
    for codec in ("none", "zip"):
        corpus.warp(f"warp_float_{codec}.nvdb", codec, values, 0.25, KINDS["float"])
    whole = (values * 1000).astype(np.int32)
    corpus.warp("warp_int32_zip.nvdb", "zip", whole, 3, KINDS["int32"])
    vectors = np.stack([values, -values, values * values], axis=-1)
    corpus.warp("warp_vec3s_zip.nvdb", "zip", vectors, (0.0, 1.0, 2.0), KINDS["vec3s"])
    write_truth(folder / "truth.json.gz", corpus.truth)
    files = sorted(folder.glob("*.nvdb"))
    total = sum(path.stat().st_size for path in folder.iterdir())
    sys.stdout.write(f"{len(files)} files, {len(corpus.truth)} grids, {total} bytes\n")


if __name__ == "__main__":
    main()

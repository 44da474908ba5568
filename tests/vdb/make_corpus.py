"""Makes the VDB corpus of ``crates/tyndall-vdb/tests/corpus`` and its truth.

Usage: ``make_corpus.py FOLDER`` with ``pip install bpy==5.0.1 blosc numpy`` (Python 3.11; the wheel of
Blender's ``bpy`` contains OpenVDB 12 as a Python module). Truth comes from OpenVDB reading the finished
files. Files made by `plain_writer` are accepted only if OpenVDB gets the same values from them as from the
grid they were made of. Two types are unknown to the module, ``half`` (new in OpenVDB 13) and ``mask``: of
those the tree that was written is the truth.
The corpus is the project's own data: nothing in it comes from third parties.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from plain_writer import (
    ACTIVE_MASK,
    BLOSC,
    KINDS,
    ZIP,
    Form,
    Origin,
    PlainGrid,
    Tile,
    Tree,
    Value,
    scale_numbers,
    write_file,
)
from truth import CORNERS, describe_tree, numbers, sample_points, sums, write_truth

IDENTITY = ("UniformScaleMap", scale_numbers([1, 1, 1]))
# A box, then world from local, its inverse, local from index, its inverse: a shift, then twice the size.
OLD_TRANSFORM = (
    "LinearTransform",
    [
        *[0.0] * 3,
        *[2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1],
        *[0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1],
        *[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1],
        *[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -3, -4, -5, 1],
    ],
)


def import_openvdb() -> Any:
    """Return the ``openvdb`` module hidden inside the ``bpy`` wheel."""
    import bpy  # noqa: F401  (loads the shared libraries that openvdb needs)

    for folder in map(Path, sys.path):
        found = next(folder.glob("bpy/**/openvdb.cpython*.so"), None)
        if found:
            sys.path.append(str(found.parent))
            break
    import openvdb

    return openvdb


vdb = import_openvdb()


@dataclass(frozen=True, slots=True)
class Ref:
    """A grid of a file as the reader under test is asked for it."""

    name: str
    index: int = 0
    unique_name: str | None = None

    def for_openvdb(self) -> str:
        """Return the name by which OpenVDB finds the grid."""
        return self.unique_name if self.unique_name is not None else self.name


class Corpus:
    """Collects files and their truth in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.truth: list[dict[str, Any]] = []
        self.rng = np.random.default_rng(20130701)

    def native(self, file: str, grids: list[Any], refs: list[Ref] | None = None) -> None:
        """Write grids with OpenVDB itself."""
        vdb.write(str(self.folder / file), grids=grids)
        self.record(file, refs or [Ref(grid.name) for grid in grids])

    def plain(self, file: str, grids: list[PlainGrid], *, stream: bool = False, like: Any = None) -> None:
        """Write grids with `plain_writer`; ``like`` is the grid OpenVDB must find in each of them."""
        (self.folder / file).write_bytes(write_file(grids, stream=stream))
        refs: list[Ref] = []
        for grid in grids:
            name = grid.unique_name.split("\x1e")[0]
            index = sum(ref.name == name for ref in refs)
            unique = grid.unique_name.replace("\x1e", "[") + "]" if "\x1e" in grid.unique_name else None
            refs.append(Ref(name, index, unique))
            if like is not None:
                check_equal(self.folder / file, refs[-1], like, half=grid.form.half)
        self.record(file, refs)

    def record(self, file: str, refs: list[Ref]) -> None:
        """Let OpenVDB read the file and note what it finds."""
        for ref in refs:
            grid = vdb.read(str(self.folder / file), ref.for_openvdb())
            facts = describe(grid, self.rng)
            self.truth.append({"file": file, "name": ref.name, "index": ref.index, **facts})

    def made(self, file: str, grid: PlainGrid) -> None:
        """Write a grid that OpenVDB's module cannot read; what was written is the truth."""
        (self.folder / file).write_bytes(write_file([grid]))
        entry = {"file": file, "name": grid.unique_name, "index": 0, "class": "unknown", "corners": CORNERS}
        self.truth.append(entry | describe_tree(grid.tree, self.rng))

    def finish(self) -> None:
        """Write ``truth.json.gz``."""
        write_truth(self.folder / "truth.json.gz", self.truth)


def describe(grid: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Return the facts a reader must reproduce."""
    entry: dict[str, Any] = {"type": grid.valueTypeName, "class": grid.gridClass}
    if grid.valueTypeName not in KINDS:
        return entry
    active = [(numbers(item.value), item.count) for item in grid.citerOnValues()]
    interesting = [
        (item.min, item.max) for item in grid.citerAllValues() if item.active or item.value != grid.background
    ]
    accessor = grid.getConstAccessor()
    entry |= {
        "background": numbers(grid.background),
        "active": grid.activeVoxelCount(),
        **sums(active, len(numbers(grid.background))),
        "bounds": grid.evalActiveVoxelBoundingBox() if active else None,
        "leaves": grid.leafCount(),
        "samples": [
            [*point, accessor.isValueOn(point), *numbers(accessor.getValue(point))]
            for point in sample_points(interesting, rng)
        ],
    }
    if "frustum" not in grid.transform.info().lower():
        entry["corners"] = [grid.transform.indexToWorld(corner) for corner in CORNERS]
    return entry


def check_equal(path: Path, ref: Ref, like: Any, *, half: bool) -> None:
    """Fail unless OpenVDB reads the same tree from the file as ``like`` holds."""
    found = stored_values(vdb.read(str(path), ref.for_openvdb()))
    expected = stored_values(like)
    if half:
        rounded = {key: (as_half(value), active) for key, (value, active) in expected.items()}
        # Root tiles and the background keep full floats.
        expected = {key: found[key] if key[1][0] - key[0][0] == 4095 else rounded[key] for key in found}
    if found != expected:
        message = f"{path.name}: OpenVDB does not read back what was written"
        raise ValueError(message)


def as_half(value: Value) -> Value:
    """Return a number or vector rounded to half floats."""
    rounded = np.float16(value).astype(np.float64).tolist()
    return tuple(rounded) if isinstance(rounded, list) else rounded


def stored_values(grid: Any) -> dict[tuple[Any, Any], tuple[Value, bool]]:
    """Return all values that are not inactive background, by their boxes."""
    return {
        (item.min, item.max): (item.value, item.active)
        for item in grid.citerAllValues()
        if item.active or item.value != grid.background
    }


def tree_of(grid: Any) -> Tree:
    """Copy an OpenVDB grid into the plain writer's tree."""
    tree = Tree(grid.background, kind=KINDS[grid.valueTypeName])
    for item in grid.citerAllValues():
        size = item.max[0] - item.min[0] + 1
        if size > 1:
            if item.active or item.value != grid.background:
                tree.tiles.append(Tile(item.min, size.bit_length() - 1, item.value, item.active))
            continue
        x, y, z = item.min
        empty = (tree.kind.full(512, grid.background), np.zeros(512, dtype=np.bool_))
        values, active = tree.leaves.setdefault((x & ~7, y & ~7, z & ~7), empty)
        offset = (x & 7) << 6 | (y & 7) << 3 | z & 7
        values[offset] = item.value
        active[offset] = item.active
    return tree


def cloud(name: str = "density", size: int = 20, *, kind: Any = None, low: Origin = (3, 5, 1)) -> Any:
    """Return a smooth blob with a rough surface, off the leaf lattice, with ``low`` as the lowest corner."""
    axis = np.arange(size) - size / 2 + 0.3
    x, y, z = np.meshgrid(axis, axis * 1.2, axis, indexing="ij")
    wobble = 1 + 0.2 * np.sin(x) * np.cos(1.3 * y) * np.sin(0.7 * z + 1)
    values = np.maximum(0, 1 - np.sqrt(x**2 + y**2 + z**2) / (0.45 * size) * wobble)
    grid = (kind or vdb.FloatGrid)()
    value_kind = KINDS[grid.valueTypeName]
    scale = 100 if np.issubdtype(value_kind.dtype, np.integer) else 1
    if value_kind.width == 3:
        values = np.stack([values, -values, values * values], axis=-1)
    grid.copyFromArray((values * scale).astype(value_kind.dtype), ijk=low)
    grid.name = name
    return grid


def fog(name: str = "density", **options: Any) -> Any:
    """Return `cloud` with class fog volume."""
    grid = cloud(name, **options)
    grid.gridClass = "fog volume"
    return grid


def node_codes() -> Any:
    """Return a grid whose leaves have every kind of inactive values: node codes 0 to 6."""
    grid = vdb.FloatGrid(0.5)
    grid.name = "codes"
    accessor = grid.getAccessor()
    kinds: list[list[float]] = [
        [0.5],
        [-0.5],
        [3.0],
        [0.5, -0.5],
        [-0.5, 0.5],
        [0.5, 3.0],
        [3.0, 0.5],
        [4.0, 3.0],
        [1, 2, 4],
    ]
    for leaf, kind in enumerate(kinds):
        for offset in range(512):
            voxel = (leaf * 8 + (offset >> 6), offset >> 3 & 7, offset & 7)
            if offset % 5 == 0:
                accessor.setValueOn(voxel, 1 + offset / 512)
            else:
                accessor.setValueOff(voxel, kind[offset % len(kind)])
    return grid


def tiles() -> Any:
    """Return a grid with active and inactive tiles of all sizes next to leaves."""
    grid = vdb.FloatGrid(0.25)
    grid.name = "tiles"
    grid.fill((8, 8, 8), (23, 15, 15), 1.5)
    grid.fill((64, 0, 0), (71, 7, 7), -0.25, active=False)
    grid.fill((128, 0, 0), (255, 127, 127), 2.0)
    grid.fill((0, 256, 0), (127, 383, 127), 4.0, active=False)
    grid.fill((-4096, 0, 0), (-1, 4095, 4095), 0.125)
    grid.fill((-8192, 0, 0), (-4097, 4095, 4095), 0.375, active=False)
    grid.getAccessor().setValueOn((40, 41, 42), 9.0)
    return grid


def far_apart() -> Any:
    """Return a grid with voxels at the ends of the 32-bit range."""
    grid = vdb.FloatGrid(0)
    grid.name = "far"
    accessor = grid.getAccessor()
    for i, voxel in enumerate([(-(2**31), 5, 2**31 - 1), (2**31 - 1,) * 3, (-1, -1, -1)]):
        accessor.setValueOn(voxel, 1.0 + i)
    return grid


def sphere() -> Any:
    """Return a level set: inactive interior and exterior of opposite sign."""
    grid = vdb.createLevelSetSphere(radius=7.0, center=(12.0, 13.0, 14.0), voxelSize=0.75, halfWidth=1.5)
    grid.name = "surface"
    return grid


def add_native_files(corpus: Corpus) -> None:
    """Write files with OpenVDB: Blosc with active masks, tree and value types, names, transforms."""
    corpus.native("native_fog.vdb", [fog(low=(-9, 5, 1))])
    corpus.native("native_half.vdb", [half(fog())])
    corpus.native("native_codes.vdb", [node_codes()])
    corpus.native("native_tiles.vdb", [tiles()])
    corpus.native("native_far.vdb", [far_apart()])
    corpus.native("native_level_set.vdb", [sphere()])
    empty = vdb.FloatGrid(7.0)
    empty.name = "nothing"
    corpus.native("native_empty.vdb", [empty])
    same = [fog("density", size=8), fog("heat", size=7), fog("density", size=10)]
    numbered = [Ref("density", i, f"density[{i}]") for i in range(2)]
    corpus.native("native_same_names.vdb", same, [numbered[0], Ref("heat"), numbered[1]])
    shared = fog("original", size=10)
    instance = shared.copy()
    instance.name = "instance"
    instance.transform = vdb.createLinearTransform(0.125)
    not_ascii = shared.copy()
    not_ascii.name = "Dichte-äöü-密度"
    corpus.native("native_instance.vdb", [shared, instance, not_ascii])
    numbers = [cloud("d", size=7, kind=vdb.DoubleGrid), cloud("i", size=7, kind=vdb.Int32Grid)]
    numbers += [cloud("l", size=5, kind=vdb.Int64Grid), half(cloud("dh", size=5, kind=vdb.DoubleGrid))]
    corpus.native("native_numbers.vdb", numbers)
    others = [kind() for kind in (vdb.BoolGrid, vdb.Vec3SGrid, vdb.PointDataGrid)]
    for grid, value in zip(others, (True, (1.0, 2.0, 3.0)), strict=False):
        grid.fill((0, 0, 0), (3, 3, 3), value)
    for i, grid in enumerate(others):
        grid.name = f"other{i}"
    corpus.native("native_other_types.vdb", [*others, fog(size=8)])


def tiles_of(kind: Any, values: list[Value], *, background: Value) -> Any:
    """Return a grid of any type with tiles of all sizes, active and inactive, and a leaf of mixed values."""
    grid = kind(background)
    a, b, c = values
    grid.fill((8, 8, 8), (23, 15, 15), a)
    grid.fill((64, 0, 0), (71, 7, 7), b, active=False)
    grid.fill((128, 0, 0), (255, 127, 127), c)
    grid.fill((-4096, 0, 0), (-1, 4095, 4095), b)
    grid.fill((-8192, 0, 0), (-4097, 4095, 4095), c, active=False)
    accessor = grid.getAccessor()
    for offset in range(400):
        voxel = (40 + (offset >> 6), 40 + (offset >> 3 & 7), 40 + (offset & 7))
        (accessor.setValueOn if offset % 3 else accessor.setValueOff)(voxel, values[offset % 7 % 3])
    return grid


def add_value_types(corpus: Corpus) -> None:
    """Write every type with OpenVDB, and packed in the ways that it does not offer."""
    vectors = [(1, 2, 3), (-4, 5, -6), (7, 8, 9)]
    cases = {
        "bool": (vdb.BoolGrid, [True, False, True], False),
        "bool_true": (vdb.BoolGrid, [False, True, False], True),
        "double": (vdb.DoubleGrid, [1e-300, 0.1, -2e200], 0.25),
        "int32": (vdb.Int32Grid, [-(2**31), 2**31 - 1, 7], -3),
        "int64": (vdb.Int64Grid, [2**40, -(2**50), 7], 5),
        "vec3s": (vdb.Vec3SGrid, vectors, (0.5, 0.0, -0.5)),
        "vec3d": (vdb.Vec3DGrid, [(0.1, 0.2, 0.3), *vectors[1:]], (0.5, 0.25, -0.125)),
        "vec3i": (vdb.Vec3IGrid, vectors, (0, 1, -1)),
    }
    for name, (kind, values, background) in cases.items():
        grid = tiles_of(kind, values, background=background)
        grid.name = name
        corpus.native(f"type_{name}.vdb", [grid])
        tree = tree_of(grid)
        for packing, flags in {"zip": ZIP, "zip_masks": ZIP | ACTIVE_MASK, "blosc": BLOSC}.items():
            plain = PlainGrid(name, tree, *IDENTITY, Form(flags))
            corpus.plain(f"type_{name}_{packing}.vdb", [plain], like=grid)
        if tree.kind.has_half and name != "double":  # 2e200 is no half float.
            plain = PlainGrid(name, tree, *IDENTITY, Form(ZIP | ACTIVE_MASK, half=True))
            corpus.plain(f"type_{name}_zip_masks_half.vdb", [plain], like=grid)
    clouds = [cloud("d", size=6, kind=vdb.Vec3DGrid), half(cloud("dh", size=6, kind=vdb.Vec3DGrid))]
    clouds += [cloud("s", size=6, kind=vdb.Vec3SGrid), half(cloud("sh", size=6, kind=vdb.Vec3SGrid))]
    velocity = cloud("v", size=6, kind=vdb.Vec3SGrid)
    velocity.gridClass = "staggered"
    corpus.native("native_vectors.vdb", [*clouds, velocity, cloud("i", size=6, kind=vdb.Vec3IGrid)])


def add_types_unknown_to_openvdb_12(corpus: Corpus) -> None:
    """Write half and mask grids, of which only leaves are used."""
    source = tree_of(cloud(size=9))
    halves = Tree(0.0, kind=KINDS["half"])
    masks = Tree(False, kind=KINDS["mask"])
    for origin, (values, active) in source.leaves.items():
        halves.leaves[origin] = (values.astype(np.float16), active)
        masks.leaves[origin] = (active, active)
    for packing, flags in {"none": ACTIVE_MASK, "zip": ZIP, "blosc": BLOSC | ACTIVE_MASK}.items():
        form = Form(flags, version=225)
        corpus.made(f"made_half_{packing}.vdb", PlainGrid("density", halves, *IDENTITY, form))
        corpus.made(f"made_mask_{packing}.vdb", PlainGrid("region", masks, *IDENTITY, Form(flags)))


def half(grid: Any) -> Any:
    """Return the grid, to be saved as half floats."""
    grid.saveFloatAsHalf = True
    return grid


def add_native_transforms(corpus: Corpus) -> None:
    """Write transforms that OpenVDB composes and simplifies itself, a frustum among them."""
    turned = vdb.createLinearTransform(0.5)
    turned.postRotate(0.7, vdb.Axis.Z)
    turned.postTranslate((1.0, -2.0, 3.0))
    sheared = vdb.createLinearTransform(0.25)
    sheared.preShear(0.3, vdb.Axis.X, vdb.Axis.Y)
    mirrored = vdb.createLinearTransform(1.0)
    mirrored.postScale((-1.0, 2.0, 0.5))
    frustum = vdb.createFrustumTransform((0, 0, 0), (9, 9, 9), 0.5, 2.0, 0.1)
    shared = fog("plain", size=6)
    grids = [shared]
    transforms = {"turned": turned, "frustum": frustum, "sheared": sheared, "mirrored": mirrored}
    for name, transform in transforms.items():
        grids.append(shared.copy())
        grids[-1].name = name
        grids[-1].transform = transform
    corpus.native("native_transforms.vdb", grids)


def add_storage_forms(corpus: Corpus) -> None:
    """Write one grid in the combinations of packing, active masks and half floats."""
    grid = cloud(size=9)
    tree = tree_of(grid)
    for packing, flags in {"none": 0, "zip": ZIP, "blosc": BLOSC, "zip_and_blosc": ZIP | BLOSC}.items():
        for masks in (0, ACTIVE_MASK):
            for as_half in (False, True):
                # Left out: 150 kB of zeros, and repetitions of what Blosc alone shows.
                needless = packing == "zip_and_blosc" and (masks or as_half)
                if needless or (packing == "none" and not masks and not as_half):
                    continue
                file = f"form_{packing}{'_masks' if masks else ''}{'_half' if as_half else ''}.vdb"
                form = Form(flags | masks, half=as_half)
                corpus.plain(file, [PlainGrid("density", tree, *IDENTITY, form)], like=grid)
    form = Form(BLOSC, block_bytes=256)
    corpus.plain("form_blosc_small_blocks.vdb", [PlainGrid("density", tree, *IDENTITY, form)], like=grid)


def add_contents(corpus: Corpus) -> None:
    """Write all kinds of trees zipped, which OpenVDB itself refuses for fog volumes and level sets."""
    for name, grid, flags in [
        ("codes", node_codes(), ZIP | ACTIVE_MASK),
        ("tiles", tiles(), ZIP | ACTIVE_MASK),
        ("tiles_all_values", tiles(), ZIP),
    ]:
        plain = PlainGrid(grid.name, tree_of(grid), *IDENTITY, Form(flags))
        corpus.plain(f"plain_{name}.vdb", [plain], like=grid)
    for name, grid in [("codes", node_codes()), ("tiles", tiles())]:
        plain = PlainGrid(grid.name, tree_of(grid), *IDENTITY, Form(ZIP | ACTIVE_MASK, half=True))
        corpus.plain(f"plain_{name}_half.vdb", [plain], like=grid)


def add_map_types(corpus: Corpus) -> None:
    """Write each linear map type under its own name."""
    scale = scale_numbers([0.5, 2, 4])
    turn = [0.0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    affine = [0.5, 0.1, 0, 0, -0.2, 0.7, 0.3, 0, 0, 0.1, 0.9, 0, 11, 12, 13, 1]
    maps: dict[str, list[float]] = {
        "AffineMap": affine,
        "UnitaryMap": turn,
        "ScaleMap": scale,
        "UniformScaleMap": scale_numbers([0.1] * 3),
        "TranslationMap": [1.5, -2.5, 3.5],
        "ScaleTranslateMap": [9, 8, 7, *scale],
        "UniformScaleTranslateMap": [-1, -2, -3, *scale_numbers([0.3] * 3)],
    }
    tree = tree_of(cloud(size=5))
    form = Form(ACTIVE_MASK | ZIP, half=True)
    grids = [
        PlainGrid(kind, tree, kind, numbers, form, parent="" if kind == "AffineMap" else "AffineMap")
        for kind, numbers in maps.items()
    ]
    corpus.plain("plain_maps.vdb", grids)


def add_old_versions_and_streams(corpus: Corpus) -> None:
    """Write file versions 218 to 225 and stream files (without grid offsets)."""
    grid = cloud(size=9)
    tree = tree_of(grid)
    for version, flags, as_half in [
        (218, ZIP, False),
        (218, ZIP, True),
        (219, ZIP, False),
        (220, ZIP, True),
        (221, ZIP, False),
        (221, ZIP, True),
        (222, ZIP | ACTIVE_MASK, True),
        (223, BLOSC | ACTIVE_MASK, False),
        (225, BLOSC | ACTIVE_MASK, False),
    ]:
        file = f"version_{version}{'_half' if as_half else ''}.vdb"
        form = Form(flags, half=as_half, version=version)
        transform = OLD_TRANSFORM if version == 218 else IDENTITY
        corpus.plain(file, [PlainGrid("density", tree, *transform, form)], like=grid)
    form = Form(ZIP | ACTIVE_MASK, wrong_hint=True)
    corpus.plain("wrong_buffer_offset.vdb", [PlainGrid("density", tree, *IDENTITY, form)], like=grid)
    tree_221 = tree_of(tiles())
    plain = PlainGrid("tiles", tree_221, *IDENTITY, Form(ZIP, version=221))
    corpus.plain("version_221_tiles.vdb", [plain], like=tiles())
    form = Form(ZIP | ACTIVE_MASK)
    names = ["a\x1e0", "a\x1e1", "c"]
    parents = ["", "", "a\x1e1"]
    grids = [
        PlainGrid(name, tree, *IDENTITY, form, grid_class="fog volume", parent=parent)
        for name, parent in zip(names, parents, strict=True)
    ]
    corpus.plain("stream.vdb", grids, stream=True, like=grid)
    corpus.plain("same_names_and_instance.vdb", grids, like=grid)
    mixed = [tiles_of(vdb.BoolGrid, [True, False, True], background=False), cloud(size=5, kind=vdb.Vec3DGrid)]
    for name, flags, as_half in [("blosc_half", BLOSC | ACTIVE_MASK, True), ("none", ACTIVE_MASK, False)]:
        form = Form(flags, half=as_half)
        grids = [
            PlainGrid(str(i), tree_of(other), *IDENTITY, form) for i, other in enumerate([*mixed, tiles()])
        ]
        corpus.plain(f"stream_{name}.vdb", grids, stream=True)


def main() -> None:
    """Write the corpus into the folder named on the command line."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    corpus = Corpus(folder)
    add_native_files(corpus)
    add_native_transforms(corpus)
    add_storage_forms(corpus)
    add_value_types(corpus)
    add_types_unknown_to_openvdb_12(corpus)
    add_contents(corpus)
    add_map_types(corpus)
    add_old_versions_and_streams(corpus)
    corpus.finish()
    files = sorted(folder.glob("*.vdb"))
    total = sum(path.stat().st_size for path in folder.iterdir())
    sys.stdout.write(f"{len(files)} files, {len(corpus.truth)} grids, {total} bytes\n")


if __name__ == "__main__":
    main()

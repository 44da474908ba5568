"""Lets OpenVDB judge the files that ``crates/tyndall-vdb/tests/write.rs`` leaves behind.

Usage: ``check_written.py WRITTEN CORPUS`` where WRITTEN is ``<target>/tmp/written`` after ``cargo test`` and
CORPUS is ``crates/tyndall-vdb/tests/corpus``. Needs what `make_corpus` needs. Exits with an error at the
first difference.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

from make_corpus import stored_values, vdb

DIMS = (30, 21, 17)
ORIGIN = (-11, 5, -140)


def formula(x: int, y: int, z: int) -> float:
    """Return the value that ``write.rs`` gives a voxel."""
    return 1 + x * 0.5 + y * 0.25 + z * 0.125 if (x + y + z) % 3 == 0 else 0.0


def require(condition: bool, what: str) -> None:
    """Exit with a message unless the condition holds."""
    if not condition:
        sys.exit(f"OpenVDB disagrees: {what}")


def check_dense(path: Path) -> int:
    """Compare every voxel of the dense grids; return the number compared."""
    expected = {}
    for x in range(ORIGIN[0], ORIGIN[0] + DIMS[0]):
        for y in range(ORIGIN[1], ORIGIN[1] + DIMS[1]):
            for z in range(ORIGIN[2], ORIGIN[2] + DIMS[2]):
                if formula(x, y, z) != 0:
                    expected[(x, y, z), (x, y, z)] = (formula(x, y, z), True)
    for name in ("density[0]", "density[1]", "heat"):
        grid = vdb.read(str(path), name)
        label = f"{path.name} {name}"
        require(stored_values(grid) == expected, f"{label}: values")
        require(grid.gridClass == "fog volume", f"{label}: class {grid.gridClass}")
        require(grid.metadata["file_voxel_count"] == len(expected), f"{label}: file_voxel_count")
        stated = [tuple(map(int, grid.metadata[f"file_bbox_{end}"])) for end in ("min", "max")]
        require(stated == list(grid.evalActiveVoxelBoundingBox()), f"{label}: bounds")
        check_transform(grid, turned=name == "density[1]", label=label)
    vectors = {box: ((v, -2 * v, 0.0), active) for box, (v, active) in expected.items()}
    grid = vdb.read(str(path), "v")
    require(
        grid.valueTypeName == "vec3s" and grid.gridClass == "fog volume", f"{path.name} v: type and class"
    )
    require(stored_values(grid) == vectors, f"{path.name} v: values")
    check_transform(grid, turned=False, label=f"{path.name} v")
    return 4 * len(expected)


def check_transform(grid: Any, *, turned: bool, label: str) -> None:
    """Compare where one voxel centre is in the world."""
    x, y, z = 2 * 0.5 + 1, 4 * 0.5 + 2, 6 * 0.25 + 3
    if turned:
        x, y = x * math.cos(0.5) - y * math.sin(0.5), x * math.sin(0.5) + y * math.cos(0.5)
    found = grid.transform.indexToWorld((2.0, 4.0, 6.0))
    require(math.dist(found, (x, y, z)) < 1e-14, f"{label}: {found} instead of {(x, y, z)}")


def main() -> None:
    """Check all files."""
    written, corpus = map(Path, sys.argv[1:3])
    count = 0
    for packing in ("none", "zip"):
        count += check_dense(written / f"dense_{packing}.vdb")
        for name in ("tiles", "codes", "far"):
            original = stored_values(vdb.read(str(corpus / f"native_{name}.vdb"), name))
            copy = vdb.read(str(written / f"{name}_{packing}.vdb"), name)
            require(stored_values(copy) == original, f"{name}_{packing}.vdb")
            count += len(original)
    sys.stdout.write(f"8 files, {count} values equal\n")


if __name__ == "__main__":
    main()

"""Writes grids, or loads one of a file and says what that took; a process of its own for each.

Usage: ``lean_grids.py write DENSITY_FILE ALL_FILE`` writes the grid `density` alone, and with `temperature`
and `velocity`, with Blender's OpenVDB. ``lean_grids.py load FILE`` makes a scene with its `density` ready for
rays and prints the bytes read and the CPU seconds as JSON.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from pathlib import Path

import numpy as np

# Voxels along a side.
SIZE = 128


def write(density_file: str, all_file: str) -> None:
    """Write noise, which does not compress, so that what is read shows."""
    import bpy

    bpy.utils.expose_bundled_modules()
    import openvdb

    def grid(kind: type, name: str, *components: int) -> object:
        made = kind()
        made.name = name
        rng = np.random.default_rng(len(name))
        made.copyFromArray(rng.uniform(0.5, 1.0, (SIZE, SIZE, SIZE, *components)).astype(np.float32))
        return made

    density = grid(openvdb.FloatGrid, "density")
    others = [grid(openvdb.FloatGrid, "temperature"), grid(openvdb.Vec3SGrid, "velocity", 3)]
    openvdb.write(density_file, grids=[density])
    openvdb.write(all_file, grids=[density, *others])
    sys.stdout.flush()
    os._exit(0)


def _read_so_far() -> int:
    """Return the bytes this process read by system calls, cached files included (proc(5), `rchar`)."""
    fields = dict(line.split(": ") for line in Path("/proc/self/io").read_text(encoding="ascii").splitlines())
    return int(fields["rchar"])


def _cpu_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def load(file: str) -> dict[str, float]:
    """Make the world of a volume with the file's density."""
    import tyndall
    from tyndall import prims

    delegate = tyndall.RenderDelegate()
    delegate.sync("/density", prims.Field(path=file, grid="density"))
    delegate.sync("/volume", prims.Volume(fields=[("density", "/density")]))
    delegate.sync("/camera", prims.Camera())
    scene = delegate.commit()
    read, cpu = _read_so_far(), _cpu_seconds()
    session = tyndall.Session(scene, {"resolution": [8, 8], "samples": 1, "threads": 1})
    result = {"bytes": _read_so_far() - read, "cpu_seconds": _cpu_seconds() - cpu}
    assert session.statistics["world"], "an empty world"
    return result


if __name__ == "__main__":
    if sys.argv[1] == "write":
        write(*sys.argv[2:])
    else:
        sys.stdout.write(json.dumps(load(sys.argv[2])))

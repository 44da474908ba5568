# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume objects: grids by file, of sequences and geometry nodes alike."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tyndall.prims import Field

if TYPE_CHECKING:
    import bpy
    from tyndall.messages import Messages

    from .images import TemporaryFolder


class VolumeFiles:
    """Finds the file of a volume's grids; grids that nodes or modifiers made are written to one."""

    def __init__(self, folder: TemporaryFolder) -> None:
        self._folder = folder
        self._count = 0

    def file_of(
        self, volume: bpy.types.Volume, path: str, messages: Messages, *, is_generated: bool
    ) -> str | None:
        """Return the file with the grids of this frame; ``None``, with a message, if there is none."""
        grids = volume.grids
        # Without this, 4.2 does not know the file's name from the second frame on.
        if not grids.load() or grids.error_message:
            why = grids.error_message or "its grids cannot be loaded"
            messages.error(path, f"the volume is not drawn: {why}", "check its file and frame range")
            return None
        if len(grids) == 0:
            messages.warning(path, "the volume has no grids", "nothing is drawn")
            return None
        file = grids.frame_filepath
        if file and not is_generated:
            return file
        self._count += 1
        # A name of its own each time: the core knows files by name and date.
        target = self._folder.path / f"volume-{self._count}.vdb"
        if not grids.save(filepath=str(target)) or not Path(target).is_file():
            messages.error(path, "the grids could not be written to a temporary file", "nothing is drawn")
            return None
        return str(target)


def read_fields(volume: bpy.types.Volume, file: str, world_from_field: np.ndarray) -> dict[str, Field]:
    """Return a field for every grid, by its name."""
    names = dict.fromkeys(grid.name for grid in volume.grids)
    return {name: Field(path=file, grid=name, world_from_field=world_from_field) for name in names}


def density_scale(volume: bpy.types.Volume, world: np.ndarray) -> float:
    """Return the factor on coefficients that keeps a scaled object as opaque as before (Cycles does so)."""
    if volume.render.space == "WORLD":
        return 1.0
    length = float(np.linalg.norm(world[:3, :3] @ np.full(3, 1.0 / math.sqrt(3.0))))
    if length <= 0.0:
        return 1.0
    # Rotations alone are no scale: rounded, instances share their material.
    scale = float(np.float32(round(1.0 / length, 6)))
    return 1.0 if abs(scale - 1.0) < 1e-5 else scale

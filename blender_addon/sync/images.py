# SPDX-License-Identifier: GPL-3.0-or-later
"""Images as files the core can open; packed and painted ones are written to a temporary folder."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from .. import compat

if TYPE_CHECKING:
    from bpy.types import Image


class TemporaryFolder:
    """A folder that goes with its owner; the core opens files only when it builds the world."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="tyndall-"))
        self._finalizer = weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)


class ImageFiles:
    """Finds or makes the file of an image."""

    def __init__(self, folder: TemporaryFolder) -> None:
        self._folder = folder
        self._written: dict[int, str] = {}

    def forget(self, image: Image) -> None:
        """Have the image written anew: it was edited."""
        self._written.pop(compat.session_uid(image), None)

    def file_of(self, image: Image) -> str | None:
        """Return a path; ``None`` if there are no pixels to be had."""
        if image.source in ("TILED", "VIEWER", "MOVIE"):
            return None
        if image.source == "FILE" and not image.packed_file and not image.is_dirty:
            path = Path(bpy.path.abspath(image.filepath_from_user(), library=image.library))
            return str(path) if path.is_file() else None
        uid = compat.session_uid(image)
        if uid not in self._written:
            written = self._write(image, uid)
            if written is None:
                return None
            self._written[uid] = written
        return self._written[uid]

    def _write(self, image: Image, uid: int) -> str | None:
        if image.packed_file and not image.is_dirty:
            target = self._folder.path / f"image-{uid}{Path(image.filepath).suffix or '.png'}"
            target.write_bytes(image.packed_file.data)
            return str(target)
        target = self._folder.path / f"image-{uid}.{'exr' if image.is_float else 'png'}"
        try:
            image.save(filepath=str(target), save_copy=True)
        except RuntimeError:
            return None
        return str(target) if target.is_file() else None

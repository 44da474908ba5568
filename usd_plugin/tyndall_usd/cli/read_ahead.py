"""Grids of the next frame, decoded while this one renders."""

from __future__ import annotations

from threading import Thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    import tyndall


class ReadAhead:
    """Reads files of one frame at a time into the cache of a delegate, on a thread of its own."""

    def __init__(self, delegate: tyndall.RenderDelegate) -> None:
        self._delegate = delegate
        self._thread: Thread | None = None

    def start(self, grids: Sequence[tuple[str, str, int | None]]) -> None:
        """Read `grids`: file, name and index of each. What cannot be read is told when it is needed."""
        self.wait()
        if grids:
            self._thread = Thread(target=self._read, args=(grids,), name="read-ahead", daemon=True)
            self._thread.start()

    def wait(self) -> None:
        """Wait until all are read: two that read one file would do it twice."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _read(self, grids: Sequence[tuple[str, str, int | None]]) -> None:
        for file, grid, index in grids:
            self._delegate.read_ahead(file, grid, index)

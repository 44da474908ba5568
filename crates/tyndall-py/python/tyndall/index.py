"""What is at a delegate, so that only what differs is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from tyndall.delegate import DirtyBits
from tyndall.dirty import dirty_bits

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tyndall.delegate import Severity
    from tyndall.prims import Prim


class Delegate(Protocol):
    """The part of `tyndall.RenderDelegate` that translation needs."""

    def sync(self, path: str, prim: Prim, dirty_bits: DirtyBits = DirtyBits.ALL) -> None:
        """Set the prim at `path`."""

    def remove(self, path: str) -> bool:
        """Remove the prim at `path`."""

    def report(self, severity: Severity, path: str, what: str, action: str = "") -> None:
        """Add a message."""


class PrimIndex:
    """The prims of one front end at a delegate, by path."""

    __slots__ = ("_delegate", "_prims")

    def __init__(self, delegate: Delegate) -> None:
        self._delegate = delegate
        self._prims: dict[str, Prim] = {}

    @property
    def prims(self) -> Mapping[str, Prim]:
        """What is at the delegate."""
        return self._prims

    def replace_all(self, prims: Mapping[str, Prim]) -> int:
        """Bring the delegate to `prims`; return how many changed."""
        changed = 0
        for path in self._prims.keys() - prims.keys():
            self._delegate.remove(path)
            changed += 1
        for path, prim in prims.items():
            changed += self._send(path, prim)
        self._prims = dict(prims)
        return changed

    def replace(self, path: str, prim: Prim) -> bool:
        """Set the prim at `path`; return whether it changed."""
        changed = self._send(path, prim)
        self._prims[path] = prim
        return changed

    def _send(self, path: str, prim: Prim) -> bool:
        old = self._prims.get(path)
        bits = DirtyBits.ALL if old is None else dirty_bits(old, prim)
        if bits:
            self._delegate.sync(path, prim, bits)
        return bool(bits)

"""Asset paths to file paths the core can open, also out of .usdz packages."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from pxr import Ar, Sdf

if TYPE_CHECKING:
    from pxr import Usd
    from tyndall.messages import Messages


class Assets:
    """Resolves asset attributes; files in packages are unpacked to a folder that lasts as long as we do.

    The core opens files when it builds the world, which may be after the stage and its index are gone.
    """

    __slots__ = ("_folder", "_unpacked")

    def __init__(self) -> None:
        self._folder: Path | None = None
        self._unpacked: dict[str, str] = {}

    def resolve(self, attribute: Usd.Attribute, time: Usd.TimeCode, messages: Messages) -> str | None:
        """Return the file `attribute` names at `time`; ``None``, with a message, if it does not exist."""
        prim_path = attribute.GetPath().GetPrimPath()
        value = attribute.Get(time)
        if value is None or not value.path:
            return None
        if "<UDIM>" in value.path:
            messages.error(
                prim_path, f"{attribute.GetName()} is a UDIM set: {value.path}", "name one tile of the set"
            )
            return None
        resolved = value.resolvedPath
        if not resolved:
            wanted = _anchored(attribute, value.path)
            messages.error(
                prim_path,
                f"{attribute.GetName()}: file not found: {wanted}",
                "check the path or copy the file",
            )
            return None
        if Ar.IsPackageRelativePath(resolved):
            return self._unpack(resolved, prim_path, messages)
        return str(resolved)

    def _unpack(self, resolved: str, prim_path: Sdf.Path, messages: Messages) -> str | None:
        if resolved in self._unpacked:
            return self._unpacked[resolved]
        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if asset is None:
            messages.error(prim_path, f"cannot read {resolved}", "check the package")
            return None
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="tyndall-usdz-"))
            atexit.register(shutil.rmtree, self._folder, ignore_errors=True)
        suffix = Path(Ar.SplitPackageRelativePathInner(resolved)[1]).name
        target = self._folder / f"{len(self._unpacked)}-{suffix}"
        target.write_bytes(asset.GetBuffer())
        self._unpacked[resolved] = str(target)
        return str(target)


def _anchored(attribute: Usd.Attribute, path: str) -> str:
    """Return `path` as seen from the layer that says it, for messages."""
    stack = attribute.GetPropertyStack()
    return str(Sdf.ComputeAssetPathRelativeToLayer(stack[0].layer, path)) if stack else path

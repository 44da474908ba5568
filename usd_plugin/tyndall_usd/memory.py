"""What was read of a stage at one time and is the same at every other.

Whether an attribute varies is asked once, when its prim is first read; what does not vary is read again only
if the stage was edited meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pxr import Tf, Usd

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from pxr import Sdf
    from tyndall.messages import Messages

#: Attributes that traversal asks for at every time anyway.
_READ_ALWAYS = ("xformOp", "visibility")


@dataclass(frozen=True, slots=True)
class _Kept:
    key: object
    content: Any
    messages: Messages


class Memory:
    """Content of prims that do not vary in time, by path.

    Parameters
    ----------
    stage : Usd.Stage
    written : sequence of Sdf.Path
        Roots below which values are written anew for every time: nothing there is kept.
    """

    def __init__(self, stage: Usd.Stage, written: Sequence[Sdf.Path]) -> None:
        self._written = written
        self._kept: dict[str, _Kept] = {}
        self._listener = Tf.Notice.Register(Usd.Notice.ObjectsChanged, self._on_change, stage)

    def recall(
        self,
        path: str,
        key: object,
        prims: Callable[[], Iterable[Usd.Prim]],
        messages: Messages,
        read: Callable[[Messages], Any],
    ) -> Any:  # noqa: ANN401 - whatever `read` returns
        """Return what `read` gave for `path` before, or what it gives now; `messages` are told either way.

        Parameters
        ----------
        key : object
            What the result depends on besides `prims`; if it is another one, the content is read again.
        prims : callable
            Gives the prims whose attributes are read.
        """
        kept = self._kept.get(path)
        if kept is None or kept.key != key:
            own = type(messages)()
            kept = _Kept(key, read(own), own)
            self._kept.pop(path, None)
            if not any(self._varies(prim) for prim in prims()):
                self._kept[path] = kept
        messages.extend(kept.messages)
        return kept.content

    def _varies(self, prim: Usd.Prim) -> bool:
        return self._is_written(prim.GetPath()) or any(
            attribute.ValueMightBeTimeVarying()
            for attribute in prim.GetAuthoredAttributes()
            if not attribute.GetName().startswith(_READ_ALWAYS)
        )

    def _is_written(self, path: Sdf.Path) -> bool:
        return any(path.HasPrefix(root) for root in self._written)

    def _on_change(self, notice: Usd.Notice.ObjectsChanged, _stage: Usd.Stage) -> None:
        paths = (*notice.GetResyncedPaths(), *notice.GetChangedInfoOnlyPaths())
        if not all(self._is_written(path) for path in paths):
            self._kept.clear()

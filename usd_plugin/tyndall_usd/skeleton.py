"""Skinned meshes: UsdSkel bakes them for one time into a layer of the session."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pxr import Gf, Sdf, Usd

if TYPE_CHECKING:
    from tyndall.messages import Messages


class SkeletonBaker:
    """Keeps one layer with the skinned points of the current time; all of them are below `roots`."""

    __slots__ = ("_layer", "_stage", "roots")

    def __init__(self, stage: Usd.Stage) -> None:
        self._stage = stage
        self._layer: Sdf.Layer | None = None
        self.roots = [prim.GetPath() for prim in stage.Traverse() if prim.GetTypeName() == "SkelRoot"]

    def bake(self, time: Usd.TimeCode, messages: Messages) -> None:
        """Write the points of all skinned meshes at `time`; what was baked before is dropped."""
        if not self.roots:
            return
        from pxr import UsdSkel

        if self._layer is None:
            self._layer = Sdf.Layer.CreateAnonymous("skinned")
            self._stage.GetSessionLayer().subLayerPaths.append(self._layer.identifier)
        self._layer.Clear()
        at = (
            time.GetValue()
            if time.IsNumeric() and not time.IsEarliestTime()
            else self._stage.GetStartTimeCode()
        )
        with Usd.EditContext(self._stage, self._layer):
            for path in self.roots:
                root = UsdSkel.Root(self._stage.GetPrimAtPath(path))
                if root and not UsdSkel.BakeSkinning(root, Gf.Interval(at, at)):
                    messages.warning(path, "the skinned meshes cannot be computed", "they are drawn at rest")

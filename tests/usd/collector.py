"""A delegate that only remembers what it was told, and the slow, obviously right twin of instancing."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import tyndall_usd
from pxr import Gf, Usd, UsdGeom
from tyndall.delegate import DirtyBits
from tyndall.prims import Instancer, Mesh, Prim, Shape, Volume


@dataclass
class Collector:
    """Collects prims, dirty bits and messages."""

    prims: dict[str, Prim] = field(default_factory=dict)
    bits: dict[str, DirtyBits] = field(default_factory=dict)
    removed: list[str] = field(default_factory=list)
    messages: list[tuple[str, str, str, str]] = field(default_factory=list)

    def sync(self, path: str, prim: Prim, dirty_bits: DirtyBits = DirtyBits.ALL) -> None:
        self.prims[path] = prim
        self.bits[path] = dirty_bits

    def remove(self, path: str) -> bool:
        self.removed.append(path)
        return self.prims.pop(path, None) is not None

    def report(self, severity: str, path: str, what: str, action: str = "") -> None:
        self.messages.append((severity, path, what, action))

    def of_type(self, kind: type) -> dict[str, Prim]:
        return {path: prim for path, prim in self.prims.items() if isinstance(prim, kind)}

    def said(self, path: str, *words: str) -> bool:
        """Return whether a message about the prim at `path` has all the words."""
        return any(
            at == path and all(w in what + action for w in words) for _, at, what, action in self.messages
        )


def translate(stage: Usd.Stage, *, time: Usd.TimeCode | None = None, **options: object) -> Collector:
    """Return what a delegate is told about `stage`."""
    collector = Collector()
    index = tyndall_usd.SceneIndex(stage, collector, **options)
    index.sync(tyndall_usd.first_time(stage) if time is None else time)
    return collector


def placements(collector: Collector, instancer: str) -> npt.NDArray[np.float64]:
    """Return the world matrices of an instancer, as the renderer expands them."""
    prim = collector.prims[instancer]
    assert isinstance(prim, Instancer)
    if prim.parent is None:
        return prim.transforms
    outer = placements(collector, prim.parent)
    return np.concatenate([matrix @ prim.transforms for matrix in outer])


def drawn_matrices(collector: Collector) -> npt.NDArray[np.float64]:
    """Return the world matrix of every gprim that is drawn, sorted."""
    matrices = []
    for prim in collector.prims.values():
        if isinstance(prim, (Mesh, Shape, Volume)):
            outer = np.eye(4)[None] if prim.instancer is None else placements(collector, prim.instancer)
            matrices += [matrix @ prim.world_from_object for matrix in outer]
    return _sorted(matrices)


def expected_matrices(stage: Usd.Stage, time: Usd.TimeCode) -> npt.NDArray[np.float64]:
    """Return the same by plain recursion over the stage, every instance visited by itself."""
    roots: set[object] = set()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.PointInstancer):
            roots.update(UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets())
    found: list[npt.NDArray[np.float64]] = []
    for child in stage.GetPseudoRoot().GetFilteredChildren(Usd.TraverseInstanceProxies()):
        _expand(child, Gf.Matrix4d(1.0), time, roots, found)
    return _sorted(found)


def _expand(prim, outer, time, roots, found, *, is_root=False) -> None:
    if prim.GetPath() in roots and not is_root:
        return
    imageable = UsdGeom.Imageable(prim)
    if imageable and imageable.GetVisibilityAttr().Get(time) == "invisible":
        return
    local = (
        UsdGeom.Xformable(prim).GetLocalTransformation(time) if UsdGeom.Xformable(prim) else Gf.Matrix4d(1.0)
    )
    matrix = local * outer
    if prim.IsA(UsdGeom.PointInstancer):
        instancer = UsdGeom.PointInstancer(prim)
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        indices = instancer.GetProtoIndicesAttr().Get(time)
        if not targets or not indices or not instancer.GetPositionsAttr().Get(time):
            return
        transforms = instancer.ComputeInstanceTransformsAtTime(
            time, time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        mask = list(instancer.ComputeMaskAtTime(time)) or [True] * len(indices)
        for index, transform, is_shown in zip(indices, transforms, mask, strict=True):
            if is_shown:
                root = prim.GetStage().GetPrimAtPath(targets[index])
                _expand(root, transform * matrix, time, roots, found, is_root=True)
        return
    is_drawn = prim.GetTypeName() in ("Mesh", "Cube", "Sphere")
    if is_drawn and imageable.ComputePurpose() in ("default", "render"):
        found.append(np.array(matrix).T)
    everything = Usd.PrimIsActive & Usd.PrimIsLoaded & Usd.PrimHasDefiningSpecifier
    for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies(everything)):
        if not child.IsAbstract() or is_root:
            _expand(child, matrix, time, roots, found)


def _sorted(matrices) -> npt.NDArray[np.float64]:
    rows = np.array(matrices).reshape(-1, 16)
    return rows[np.lexsort(np.round(rows, 6).T)].reshape(-1, 4, 4)

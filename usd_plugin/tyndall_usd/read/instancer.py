"""UsdGeomPointInstancer: valid placements by prototype."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt
from pxr import UsdGeom

if TYPE_CHECKING:
    from pxr import Gf, Usd
    from tyndall.prims import Matrix

    from tyndall_usd.read.context import ReadContext

    Mask: TypeAlias = npt.NDArray[np.bool_]


def read_point_instancer(
    prim: Usd.Prim, ctx: ReadContext, *, matrix: Gf.Matrix4d
) -> list[tuple[Usd.Prim, Matrix, Mask]]:
    """Return each prototype root with its placements, shape (n, 4, 4), and which of all instances they are.

    Parameters
    ----------
    matrix : Gf.Matrix4d
        The instancer's own placement, in USD's row-vector convention.

    Placements exclude the prototype root's own transform, which belongs to the prototype.
    """
    instancer = UsdGeom.PointInstancer(prim)
    prototypes = instancer.GetPrototypesRel().GetForwardedTargets()
    indices = instancer.GetProtoIndicesAttr().Get(ctx.time)
    positions = instancer.GetPositionsAttr().Get(ctx.time)
    missing = [
        name
        for name, value in (("prototypes", prototypes), ("protoIndices", indices), ("positions", positions))
        if not value
    ]
    if missing:
        _not_drawn(prim, ctx, f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} empty")
        return []
    if len(indices) != len(positions):
        _not_drawn(prim, ctx, f"there are {len(indices)} protoIndices for {len(positions)} positions")
        return []
    transforms = _transforms(instancer, ctx, n_instances=len(indices))
    if transforms is None:
        return []
    _report_instance_primvars(prim, ctx)
    kept, proto_indices = _kept(instancer, ctx, np.asarray(indices), len(prototypes))
    placed = np.asarray(matrix, dtype=np.float64).T @ transforms
    result = []
    for index, target in enumerate(prototypes):
        chosen = kept & (proto_indices == index)
        if not chosen.any():
            continue
        root = prim.GetStage().GetPrimAtPath(target)
        if root and root.IsActive():
            result.append((root, placed[chosen], chosen))
        else:
            ctx.messages.error(
                prim.GetPath(), f"prototype <{target}> is not an active prim", "its instances are not drawn"
            )
    return result


def varies(prim: Usd.Prim) -> bool:
    """Return whether the instances of a point instancer may be elsewhere at other times."""
    instancer = UsdGeom.PointInstancer(prim)
    places = (instancer.GetPositionsAttr(), instancer.GetOrientationsAttr(), instancer.GetScalesAttr())
    speeds = (instancer.GetVelocitiesAttr(), instancer.GetAngularVelocitiesAttr())
    return any(a.ValueMightBeTimeVarying() for a in places) or any(a.HasAuthoredValue() for a in speeds)


def transforms_at(prim: Usd.Prim, time: Usd.TimeCode, frame: Usd.TimeCode, chosen: Mask) -> Matrix:
    """Return where instances are at `time` near that of the `frame`, relative to the instancer.

    Empty if their number is another one then: they cannot be followed.
    """
    instancer = UsdGeom.PointInstancer(prim)
    rows = instancer.ComputeInstanceTransformsAtTime(
        time, frame, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    )
    transforms = np.asarray(rows, dtype=np.float64)
    return transforms.transpose(0, 2, 1)[chosen] if len(transforms) == len(chosen) else np.empty((0, 4, 4))


def _not_drawn(prim: Usd.Prim, ctx: ReadContext, what: str) -> None:
    ctx.messages.error(prim.GetPath(), what, "the point instancer is not drawn")


def _transforms(instancer: UsdGeom.PointInstancer, ctx: ReadContext, *, n_instances: int) -> Matrix | None:
    problem = _wrong_length(instancer, ctx, n_instances)
    if problem:
        _not_drawn(instancer.GetPrim(), ctx, problem)
        return None
    rows = instancer.ComputeInstanceTransformsAtTime(
        ctx.time,
        ctx.time,
        UsdGeom.PointInstancer.ExcludeProtoXform,
        UsdGeom.PointInstancer.IgnoreMask,
    )
    transforms = np.asarray(rows, dtype=np.float64)
    if len(transforms) != n_instances:
        _not_drawn(instancer.GetPrim(), ctx, "the instance transforms cannot be computed")
        return None
    return transforms.transpose(0, 2, 1)


def _wrong_length(instancer: UsdGeom.PointInstancer, ctx: ReadContext, n_instances: int) -> str:
    for attribute in (instancer.GetOrientationsAttr(), instancer.GetScalesAttr(), instancer.GetIdsAttr()):
        value = attribute.Get(ctx.time)
        if value and len(value) != n_instances:
            return f"there are {len(value)} {attribute.GetName()} for {n_instances} instances"
    return ""


def _kept(
    instancer: UsdGeom.PointInstancer, ctx: ReadContext, indices: npt.NDArray[np.int32], n_prototypes: int
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.int32]]:
    """Apply invisibleIds, inactiveIds and the range of the indices."""
    mask = instancer.ComputeMaskAtTime(ctx.time)
    kept = np.ones(len(indices), bool) if not mask else np.asarray(mask, bool)
    valid = (indices >= 0) & (indices < n_prototypes)
    if not valid.all():
        ctx.messages.error(
            instancer.GetPath(),
            f"{int((~valid).sum())} protoIndices are outside the {n_prototypes} prototypes",
            "these instances are not drawn",
        )
    return kept & valid, indices


def _report_instance_primvars(prim: Usd.Prim, ctx: ReadContext) -> None:
    names = [
        str(p.GetPrimvarName())
        for p in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()
        if p.GetInterpolation() not in ("constant", "uniform")
    ]
    if names:
        ctx.messages.warning(
            prim.GetPath(),
            f"primvars that differ between instances are not supported: {', '.join(sorted(names))}",
            "bake them into prototypes",
        )

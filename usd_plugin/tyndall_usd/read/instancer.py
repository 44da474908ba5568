"""UsdGeomPointInstancer: valid placements by prototype."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pxr import UsdGeom

if TYPE_CHECKING:
    from pxr import Gf, Usd
    from tyndall.prims import Matrix

    from tyndall_usd.read.context import ReadContext


def read_point_instancer(
    prim: Usd.Prim, ctx: ReadContext, *, matrix: Gf.Matrix4d
) -> list[tuple[Usd.Prim, Matrix]]:
    """Return each prototype root with its placements, shape (n, 4, 4).

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
            result.append((root, placed[chosen]))
        else:
            ctx.messages.error(
                prim.GetPath(), f"prototype <{target}> is not an active prim", "its instances are not drawn"
            )
    return result


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

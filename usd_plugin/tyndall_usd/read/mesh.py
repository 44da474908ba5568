"""UsdGeomMesh and its GeomSubsets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pxr import Usd, UsdGeom
from tyndall.prims import FloatArray, IntArray, Mesh, Primvar, Subdivision, SubdivisionScheme, Subset

from tyndall_usd.read.primvar import fit_values, flatten_primvar, read_primvars, to_float_rows

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from tyndall_usd.read.context import ReadContext

_SCHEMES: dict[str, SubdivisionScheme] = {
    "none": "none",
    "catmullClark": "catmullClark",
    "loop": "loop",
    "bilinear": "bilinear",
}
_SUBSETS = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded & Usd.PrimHasDefiningSpecifier)


def read_mesh(
    prim: Usd.Prim,
    ctx: ReadContext,
    *,
    material: str | None,
    subsets: Sequence[Subset] = (),
    primvars: Collection[str] = (),
) -> Mesh | None:
    """Read the mesh `prim`; ``None``, with a message, if it has no valid faces.

    Parameters
    ----------
    material : str or None
        Delegate path of the bound material.
    primvars : collection of str
        Names of the primvars that shading asks for.
    """
    mesh = UsdGeom.Mesh(prim)
    points = _points(mesh, ctx)
    if points is None:
        return None
    counts = _ints(mesh.GetFaceVertexCountsAttr(), ctx)
    indices = _ints(mesh.GetFaceVertexIndicesAttr(), ctx)
    if not _is_valid_topology(prim, ctx, n_points=len(points), counts=counts, indices=indices):
        return None
    subdivision = _read_subdivision(mesh, ctx)
    sizes = {
        "constant": 1,
        "uniform": len(counts),
        "varying": len(points),
        "vertex": len(points),
        "faceVarying": len(indices),
    }
    return Mesh(
        world_from_object=ctx.world_from_object,
        points=points,
        face_vertex_counts=counts,
        face_vertex_indices=indices,
        hole_indices=_ints(mesh.GetHoleIndicesAttr(), ctx),
        left_handed=mesh.GetOrientationAttr().Get(ctx.time) == "leftHanded",
        double_sided=bool(mesh.GetDoubleSidedAttr().Get(ctx.time)),
        subdivision=subdivision,
        normals=_read_normals(mesh, ctx, sizes) if subdivision.scheme == "none" else None,
        primvars=read_primvars(prim, ctx, wanted=primvars, counts=sizes),
        material=material,
        subsets=tuple(subsets),
        instancer=ctx.instancer,
    )


def material_subsets(prim: Usd.Prim) -> list[Usd.Prim]:
    """Return the children of `prim` that bind materials to some of its faces."""
    return [
        child
        for child in prim.GetFilteredChildren(_SUBSETS)
        if child.GetTypeName() == "GeomSubset"
        and UsdGeom.Subset(child).GetFamilyNameAttr().Get() == "materialBind"
        and UsdGeom.Subset(child).GetElementTypeAttr().Get() in (None, "face")
    ]


def read_subset(prim: Usd.Prim, ctx: ReadContext, *, n_faces: int, material: str | None) -> Subset | None:
    """Read the faces of a GeomSubset; faces that do not exist are dropped with a message."""
    faces = _ints(UsdGeom.Subset(prim).GetIndicesAttr(), ctx)
    valid = (faces >= 0) & (faces < n_faces)
    if not valid.all():
        ctx.messages.warning(
            prim.GetPath(),
            f"{int((~valid).sum())} indices are outside the mesh's {n_faces} faces",
            "they are ignored",
        )
        faces = faces[valid]
    return Subset(faces, material) if len(faces) else None


def face_count(prim: Usd.Prim, time: Usd.TimeCode) -> int:
    """Return the number of faces of the mesh `prim`."""
    return len(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(time) or ())


def _points(mesh: UsdGeom.Mesh, ctx: ReadContext) -> FloatArray | None:
    value = mesh.GetPointsAttr().Get(ctx.time)
    if value is None:
        return np.empty((0, 3), np.float32)
    rows = np.asarray(value, dtype=np.float32)
    if rows.size and (rows.ndim != 2 or rows.shape[1] != 3):
        ctx.messages.error(
            mesh.GetPath(),
            f"points are of type {type(value).__name__}, not point3f[]",
            "the mesh is not drawn",
        )
        return None
    return rows.reshape(-1, 3)


def _ints(attribute: Usd.Attribute, ctx: ReadContext) -> IntArray:
    value = attribute.Get(ctx.time)
    return np.empty(0, np.int32) if value is None else np.asarray(value, dtype=np.int32).reshape(-1)


def _is_valid_topology(
    prim: Usd.Prim, ctx: ReadContext, *, n_points: int, counts: IntArray, indices: IntArray
) -> bool:
    path, messages = prim.GetPath(), ctx.messages
    if n_points == 0 or len(counts) == 0:
        messages.info(path, "the mesh has no points or no faces", "nothing is drawn")
        return False
    if counts.min() < 0 or int(counts.sum(dtype=np.int64)) != len(indices):
        messages.error(
            path,
            f"faceVertexCounts sum to {int(counts.sum(dtype=np.int64))}, "
            f"but there are {len(indices)} faceVertexIndices",
            "the mesh is not drawn; correct its topology",
        )
        return False
    if len(indices) and (indices.min() < 0 or indices.max() >= n_points):
        worst = int(indices.max() if indices.max() >= n_points else indices.min())
        messages.error(
            path,
            f"faceVertexIndices has {worst}, but there are {n_points} points",
            "the mesh is not drawn; correct its topology",
        )
        return False
    return True


def _read_subdivision(mesh: UsdGeom.Mesh, ctx: ReadContext) -> Subdivision:
    name = str(mesh.GetSubdivisionSchemeAttr().Get(ctx.time))
    scheme = _SCHEMES.get(name)
    if scheme is None:
        ctx.messages.warning(mesh.GetPath(), f"subdivisionScheme {name!r} is not known", "drawn as polygons")
        scheme = "none"
    if scheme == "none":
        return Subdivision()
    floats = np.float32
    return Subdivision(
        scheme=scheme,
        crease_indices=_ints(mesh.GetCreaseIndicesAttr(), ctx),
        crease_lengths=_ints(mesh.GetCreaseLengthsAttr(), ctx),
        crease_sharpnesses=np.asarray(mesh.GetCreaseSharpnessesAttr().Get(ctx.time) or (), dtype=floats),
        corner_indices=_ints(mesh.GetCornerIndicesAttr(), ctx),
        corner_sharpnesses=np.asarray(mesh.GetCornerSharpnessesAttr().Get(ctx.time) or (), dtype=floats),
    )


def _read_normals(mesh: UsdGeom.Mesh, ctx: ReadContext, sizes: Mapping[str, int]) -> Primvar | None:
    """``primvars:normals`` wins over ``normals``."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasAuthoredValue():
        values = flatten_primvar(primvar, ctx.time, ctx.messages)
        interpolation = str(primvar.GetInterpolation())
    else:
        values = to_float_rows(mesh.GetNormalsAttr().Get(ctx.time))
        interpolation = str(mesh.GetNormalsInterpolation())
    if values is None or len(values) == 0:
        return None
    if values.shape[1] != 3:
        ctx.messages.warning(mesh.GetPath(), f"normals have {values.shape[1]} components", "they are ignored")
        return None
    return fit_values("normals", interpolation, values, mesh.GetPrim(), ctx, counts=sizes)

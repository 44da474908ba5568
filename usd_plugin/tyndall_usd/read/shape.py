"""The implicit shapes of UsdGeom, with their axis folded into the transform."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall.prims import Shape, ShapeKind

from tyndall_usd.read.primvar import read_primvars
from tyndall_usd.read.xform import axis_from_z, plane_from_z

if TYPE_CHECKING:
    from collections.abc import Collection

    from pxr import Usd
    from tyndall.prims import Matrix

    from tyndall_usd.read.context import ReadContext

#: Type name -> kind of the delegate and, for each of its parameters, the attribute that holds it.
SHAPES: dict[str, tuple[ShapeKind, dict[str, str]]] = {
    "Sphere": ("sphere", {"radius": "radius"}),
    "Cube": ("cube", {"size": "size"}),
    "Cone": ("cone", {"radius": "radius", "height": "height"}),
    "Cylinder": ("cylinder", {"radius_top": "radius", "radius_bottom": "radius", "height": "height"}),
    "Cylinder_1": (
        "cylinder",
        {"radius_top": "radiusTop", "radius_bottom": "radiusBottom", "height": "height"},
    ),
    "Capsule": ("capsule", {"radius_top": "radius", "radius_bottom": "radius", "height": "height"}),
    "Capsule_1": (
        "capsule",
        {"radius_top": "radiusTop", "radius_bottom": "radiusBottom", "height": "height"},
    ),
    "Plane": ("plane", {"width": "width", "length": "length"}),
}


def read_shape(
    prim: Usd.Prim, ctx: ReadContext, *, material: str | None, primvars: Collection[str] = ()
) -> Shape:
    """Read the implicit shape `prim`."""
    kind, attributes = SHAPES[prim.GetTypeName()]
    return Shape(
        kind=kind,
        params={param: float(prim.GetAttribute(name).Get(ctx.time)) for param, name in attributes.items()},
        world_from_object=ctx.world_from_object @ turn_of(prim, ctx.time),
        primvars=read_primvars(prim, ctx, wanted=primvars, counts={"constant": 1}),
        material=material,
        instancer=ctx.instancer,
    )


def turn_of(prim: Usd.Prim, time: Usd.TimeCode) -> Matrix:
    """Return what turns the delegate's shape onto the axis of `prim`."""
    axis = prim.GetAttribute("axis")
    name = str(axis.Get(time)) if axis else "Z"
    return plane_from_z(name) if prim.GetTypeName() == "Plane" else axis_from_z(name)

"""UsdVolVolume and its fields.

A field is placed by the *field prim's* transform. The relationship's name is what shaders ask for;
``fieldName`` picks the grid in the file and ``fieldIndex`` tells grids of one name apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall.prims import Field, Matrix, Volume

if TYPE_CHECKING:
    from collections.abc import Callable

    from pxr import Usd

    from tyndall_usd.read.context import ReadContext


def field_targets(prim: Usd.Prim, ctx: ReadContext) -> list[tuple[str, Usd.Prim]]:
    """Return the name and prim of each field of `prim`; relationships to nothing give a message."""
    fields = []
    for prop in prim.GetPropertiesInNamespace("field"):
        relationship = prim.GetRelationship(prop.GetName())
        targets = relationship.GetForwardedTargets() if relationship else []
        if not targets:
            continue
        name = prop.GetName().removeprefix("field:")
        target = prim.GetStage().GetPrimAtPath(targets[0])
        if target:
            fields.append((name, target))
        else:
            ctx.messages.error(
                prim.GetPath(),
                f"{prop.GetName()} names <{targets[0]}>, which is not a prim",
                "correct the relationship",
            )
    return fields


def read_field(prim: Usd.Prim, ctx: ReadContext, *, name: str, world_from_field: Matrix) -> Field | None:
    """Read the field that its Volume calls `name`; ``None``, with a message, if there is no such file."""
    kind = prim.GetTypeName()
    if kind != "OpenVDBAsset":
        ctx.messages.error(
            prim.GetPath(), f"fields of type {kind} are not supported", "convert it to OpenVDB"
        )
        return None
    attribute = prim.GetAttribute("filePath")
    value = attribute.Get(ctx.time)
    if value is None or not value.path:
        ctx.messages.error(prim.GetPath(), "filePath is empty", "name an OpenVDB file")
        return None
    path = ctx.assets.resolve(attribute, ctx.time, ctx.messages)
    if path is None:
        return None
    grid = prim.GetAttribute("fieldName").Get(ctx.time)
    if not grid:
        ctx.messages.info(prim.GetPath(), "fieldName is empty", f"the grid is looked up as {name!r}")
        grid = name
    index = prim.GetAttribute("fieldIndex").Get(ctx.time)
    return Field(
        world_from_field=world_from_field,
        path=path,
        grid=str(grid),
        index=None if index is None or index < 0 else int(index),
    )


def read_volume(
    prim: Usd.Prim,
    ctx: ReadContext,
    *,
    material: str | None,
    place_field: Callable[[str, Usd.Prim], tuple[str, Matrix]],
) -> tuple[Volume | None, dict[str, Field]]:
    """Read the Volume `prim` and its fields by path; no volume, with a message, if no field can be read.

    Parameters
    ----------
    place_field : callable
        Gives, for a field's name and prim, its path at the delegate and ``world_from_field``.
    """
    fields: dict[str, Field] = {}
    names: list[tuple[str, str]] = []
    for name, target in field_targets(prim, ctx):
        path, world_from_field = place_field(name, target)
        field = read_field(target, ctx, name=name, world_from_field=world_from_field)
        if field is not None:
            fields[path] = field
            names.append((name, path))
    if not names:
        ctx.messages.error(prim.GetPath(), "the volume has no field that can be read", "nothing is drawn")
        return None, {}
    volume = Volume(
        fields=names, material=material, world_from_object=ctx.world_from_object, instancer=ctx.instancer
    )
    return volume, fields

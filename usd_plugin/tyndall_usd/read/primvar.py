"""Primvars: typed, indexed and inherited values to flat float32 arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import UsdGeom
from tyndall.prims import INTERPOLATIONS, FloatArray, Primvar

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from pxr import Usd
    from tyndall.messages import Messages

    from tyndall_usd.read.context import ReadContext


def to_float_rows(value: Any) -> FloatArray | None:  # noqa: ANN401 - a value of any of USD's types
    """Return a scalar, vector or array of USD as rows of float32; ``None`` for what is not numbers."""
    if isinstance(value, (str, bytes)) or value is None:
        return None
    try:
        array = np.asarray(value, dtype=np.float32)
    except (TypeError, ValueError):
        return None
    if array.ndim == 0 or (array.ndim == 1 and not _is_array(value)):
        array = array.reshape(1, -1)
    elif array.ndim == 1:
        array = array.reshape(-1, 1)
    if array.ndim != 2 or not 1 <= array.shape[1] <= 4:
        return None
    return np.ascontiguousarray(array)


def _is_array(value: object) -> bool:
    return type(value).__module__.startswith("pxr.Vt")


def flatten_primvar(primvar: UsdGeom.Primvar, time: Usd.TimeCode, messages: Messages) -> FloatArray | None:
    """Return the values of `primvar`, one row each, with its indices applied."""
    path, name = primvar.GetAttr().GetPrimPath(), primvar.GetPrimvarName()
    if primvar.GetElementSize() != 1:
        messages.warning(path, f"primvar {name} has elementSize {primvar.GetElementSize()}", "it is ignored")
        return None
    rows = to_float_rows(primvar.Get(time))
    if rows is None or not primvar.IsIndexed():
        return rows
    indices = np.asarray(primvar.GetIndices(time), dtype=np.int64)
    if indices.size and (indices.min() < 0 or indices.max() >= len(rows)):
        messages.warning(
            path, f"primvar {name} has an index outside its {len(rows)} values", "the primvar is ignored"
        )
        return None
    return np.ascontiguousarray(rows[indices])


def read_primvars(
    prim: Usd.Prim, ctx: ReadContext, *, wanted: Collection[str], counts: Mapping[str, int]
) -> dict[str, Primvar]:
    """Read the primvars of `prim` that shading asks for.

    Parameters
    ----------
    wanted : collection of str
        Names to read; others cost nothing.
    counts : mapping
        Number of values each interpolation needs; a primvar that has another number is dropped with a
        message.
    """
    found = {}
    for primvar in UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance(list(ctx.inherited_primvars)):
        name = str(primvar.GetPrimvarName())
        if name not in wanted or not primvar.HasValue():
            continue
        values = flatten_primvar(primvar, ctx.time, ctx.messages)
        if values is None:
            continue
        checked = fit_values(name, str(primvar.GetInterpolation()), values, prim, ctx, counts=counts)
        if checked is not None:
            found[name] = checked
    return found


def fit_values(
    name: str,
    interpolation: str,
    values: FloatArray,
    prim: Usd.Prim,
    ctx: ReadContext,
    *,
    counts: Mapping[str, int],
) -> Primvar | None:
    """Return a primvar whose number of values suits its interpolation, or ``None`` with a message."""
    known = next((i for i in INTERPOLATIONS if i == interpolation), None)
    expected = counts.get(interpolation)
    if len(values) == 1 and expected != 1:
        return Primvar("constant", values)
    if known is None or expected is None or len(values) == 0 or len(values) < expected:
        wanted = "is not an interpolation here" if expected is None else f"needs {expected} values"
        ctx.messages.warning(
            prim.GetPath(),
            f"{name} has {len(values)} values, but {interpolation} {wanted}",
            f"{name} is ignored; correct its values or its interpolation",
        )
        return None
    if len(values) > expected:
        ctx.messages.info(
            prim.GetPath(),
            f"{name} has {len(values)} values where {interpolation} needs {expected}",
            "the rest is ignored",
        )
    return Primvar(known, values[:expected])

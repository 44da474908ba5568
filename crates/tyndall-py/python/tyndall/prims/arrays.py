"""Arrays as the core reads them."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float32]
IntArray: TypeAlias = npt.NDArray[np.int32]
Matrix: TypeAlias = npt.NDArray[np.float64]


def identity() -> Matrix:
    """Return the 4x4 identity, the default of every transform."""
    return np.eye(4)


def _array(
    name: str, value: npt.ArrayLike, dtype: type[np.generic], shape: tuple[int | None, ...]
) -> npt.NDArray[Any]:
    """Return `value` contiguous and of `dtype`; raise if it is not of `shape` (``None`` is any length)."""
    array = np.ascontiguousarray(value, dtype=dtype)
    if array.size == 0 and None in shape:
        array = array.reshape(tuple(0 if n is None else n for n in shape))
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise ValueError(f"{name} has shape {array.shape}; it must be ({wanted})")
    return array


def convert(prim: object, name: str, dtype: type[np.generic], *shape: int | None) -> None:
    """Replace the attribute `name` of a frozen dataclass by its contiguous form."""
    object.__setattr__(prim, name, _array(name, getattr(prim, name), dtype, shape))


def no_ints() -> IntArray:
    """Return an empty array of int32."""
    return np.empty(0, np.int32)


def no_floats() -> FloatArray:
    """Return an empty array of float32."""
    return np.empty(0, np.float32)

"""What differs between two versions of a prim, as the delegate's dirty bits.

Comparing data instead of following change notices makes an edited scene equal to a fresh one by construction.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from tyndall.delegate import DirtyBits
from tyndall.prims import Camera, Field, Light, Material

if TYPE_CHECKING:
    from tyndall.prims import Prim

_BY_NAME = {
    "world_from_object": DirtyBits.TRANSFORM,
    "world_from_field": DirtyBits.TRANSFORM,
    "world_from_light": DirtyBits.TRANSFORM,
    "motion": DirtyBits.TRANSFORM,
    "world_from_camera": DirtyBits.TRANSFORM | DirtyBits.CAMERA,
    "points": DirtyBits.POINTS,
    "normals": DirtyBits.POINTS,
    "primvars": DirtyBits.PRIMVARS,
    "material": DirtyBits.MATERIAL_ID,
    "subsets": DirtyBits.MATERIAL_ID,
    "visible": DirtyBits.VISIBILITY,
    "transforms": DirtyBits.INSTANCES,
    "instancer": DirtyBits.INSTANCES,
    "parent": DirtyBits.INSTANCES,
    "fields": DirtyBits.FIELD,
}
_BY_TYPE: dict[type, DirtyBits] = {
    Camera: DirtyBits.CAMERA,
    Field: DirtyBits.FIELD,
    Light: DirtyBits.PARAMS,
    Material: DirtyBits.PARAMS,
}


def dirty_bits(old: Prim, new: Prim) -> DirtyBits:
    """Return what must be synced to turn `old` into `new`; ``DirtyBits.NONE`` if they are equal."""
    if type(old) is not type(new):
        return DirtyBits.ALL
    rest = _BY_TYPE.get(type(new), DirtyBits.TOPOLOGY)
    changed = (
        _BY_NAME.get(f.name, rest)
        for f in fields(new)
        if not is_same(getattr(old, f.name), getattr(new, f.name))
    )
    return reduce(lambda bits, bit: bits | bit, changed, DirtyBits.NONE)


def is_same(a: object, b: object) -> bool:
    """Return whether two values of prim attributes are equal, arrays bit by bit (NaN equals itself)."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(is_same(value, b[key]) for key, value in a.items())
    if isinstance(a, (list, tuple)) and isinstance(b, (list, tuple)):
        return len(a) == len(b) and all(is_same(x, y) for x, y in zip(a, b, strict=True))
    if is_dataclass(a) and is_dataclass(b):
        return all(is_same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return bool(a == b)

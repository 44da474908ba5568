"""Where prims are while the shutter is open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .arrays import convert

if TYPE_CHECKING:
    from .arrays import Matrix


@dataclass(frozen=True, slots=True, eq=False)
class TransformKey:
    """Where an object or a camera is at `time` in [0, 1]: 0 when the shutter opens, 1 when it closes."""

    time: float
    world_from_object: Matrix

    def __post_init__(self) -> None:
        convert(self, "world_from_object", np.float64, 4, 4)


@dataclass(frozen=True, slots=True, eq=False)
class InstancerKey:
    """Where the instances of an instancer are at `time`: as many as it has, in the same order."""

    time: float
    transforms: Matrix

    def __post_init__(self) -> None:
        convert(self, "transforms", np.float64, None, 4, 4)

"""What every reader is given besides the prim."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pxr import Usd
    from tyndall.messages import Messages
    from tyndall.prims import Matrix

    from tyndall_usd.assets import Assets


@dataclass(frozen=True, slots=True)
class ReadContext:
    """Where and when a prim is read.

    Parameters
    ----------
    time : Usd.TimeCode
    world_from_object : ndarray, shape (4, 4), float64
        Relative to the instance for prims of a prototype.
    instancer : str or None
        Delegate path of the instancer that places the prim.
    inherited_primvars : list of UsdGeom.Primvar
        Constant primvars of the ancestors.
    """

    time: Usd.TimeCode
    messages: Messages
    assets: Assets
    world_from_object: Matrix
    instancer: str | None = None
    inherited_primvars: Sequence[Any] = field(default_factory=list)

"""Meshes, shapes, and their instances."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from .arrays import convert, identity, no_floats, no_ints

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .arrays import FloatArray, IntArray, Matrix
    from .motion import InstancerKey, TransformKey


Interpolation: TypeAlias = Literal["constant", "uniform", "varying", "vertex", "faceVarying"]
SubdivisionScheme: TypeAlias = Literal["none", "catmullClark", "loop", "bilinear"]
ShapeKind: TypeAlias = Literal["sphere", "cube", "cylinder", "cone", "capsule", "plane"]

INTERPOLATIONS: tuple[Interpolation, ...] = ("constant", "uniform", "varying", "vertex", "faceVarying")


@dataclass(frozen=True, slots=True, eq=False)
class Primvar:
    """Values over a mesh, indices already resolved.

    Parameters
    ----------
    interpolation : one of INTERPOLATIONS
        What the values belong to.
    values : ndarray, shape (n, components), float32
        One row a value; 1 to 4 components. A flat array means one component.
    """

    interpolation: Interpolation
    values: FloatArray

    def __post_init__(self) -> None:
        if self.interpolation not in INTERPOLATIONS:
            raise ValueError(
                f"interpolation is {self.interpolation!r}; it must be one of {', '.join(INTERPOLATIONS)}"
            )
        values = np.ascontiguousarray(self.values, dtype=np.float32)
        if values.ndim == 1:
            values = values.reshape(-1, 1)
        if values.ndim != 2 or not 1 <= values.shape[1] <= 4:
            raise ValueError(f"values has shape {values.shape}; it must be (n, 1 to 4)")
        object.__setattr__(self, "values", values)

    @property
    def components(self) -> int:
        """Numbers per value."""
        return int(self.values.shape[1])


@dataclass(frozen=True, slots=True, eq=False)
class Subdivision:
    """How a mesh is subdivided; index arrays are int32, sharpnesses float32, all one-dimensional."""

    scheme: SubdivisionScheme = "none"
    crease_indices: IntArray = field(default_factory=no_ints)
    crease_lengths: IntArray = field(default_factory=no_ints)
    crease_sharpnesses: FloatArray = field(default_factory=no_floats)
    corner_indices: IntArray = field(default_factory=no_ints)
    corner_sharpnesses: FloatArray = field(default_factory=no_floats)

    def __post_init__(self) -> None:
        for name in ("crease_indices", "crease_lengths", "corner_indices"):
            convert(self, name, np.int32, None)
        for name in ("crease_sharpnesses", "corner_sharpnesses"):
            convert(self, name, np.float32, None)


@dataclass(frozen=True, slots=True, eq=False)
class Subset:
    """Faces (indices, int32) with a material of their own; ``None`` leaves the mesh's."""

    faces: IntArray
    material: str | None

    def __post_init__(self) -> None:
        convert(self, "faces", np.int32, None)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Mesh:
    """A polygon mesh in object space.

    Parameters
    ----------
    world_from_object : ndarray, shape (4, 4), float64
        Places the object at the time of the frame; for instanced prims relative to the instance.
    motion : tuple of TransformKey
        Where it is while the shutter is open, in the order of time; empty if it stands still. Between two
        keys, matrices are interpolated linearly.
    points : ndarray, shape (n, 3), float32
    face_vertex_counts, face_vertex_indices, hole_indices : ndarray, shape (n,), int32
    left_handed : bool
        Corners run clockwise seen from outside.
    normals : Primvar or None
        Three components; ignored on subdivided meshes.
    material, instancer : str or None
        Paths. A prim that names an instancer is a prototype: drawn once an instance and not by itself.
    """

    points: FloatArray
    face_vertex_counts: IntArray
    face_vertex_indices: IntArray
    world_from_object: Matrix = field(default_factory=identity)
    motion: tuple[TransformKey, ...] = ()
    hole_indices: IntArray = field(default_factory=no_ints)
    left_handed: bool = False
    double_sided: bool = False
    subdivision: Subdivision = field(default_factory=Subdivision)
    normals: Primvar | None = None
    primvars: Mapping[str, Primvar] = field(default_factory=dict)
    material: str | None = None
    subsets: Sequence[Subset] = ()
    instancer: str | None = None
    visible: bool = True

    def __post_init__(self) -> None:
        convert(self, "world_from_object", np.float64, 4, 4)
        convert(self, "points", np.float32, None, 3)
        for name in ("face_vertex_counts", "face_vertex_indices", "hole_indices"):
            convert(self, name, np.int32, None)
        if self.normals is not None and self.normals.components != 3:
            raise ValueError(f"normals has {self.normals.components} components; it must have 3")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Shape:
    """An implicit shape around the object's origin.

    Cylinder, cone and capsule stand along z, the plane faces +z.

    `params` by kind: sphere {radius}; cube {size}; cylinder and capsule {radius_top, radius_bottom, height};
    cone {radius, height}; plane {width, length}. `motion` is as of a mesh.
    """

    kind: ShapeKind
    params: Mapping[str, float]
    world_from_object: Matrix = field(default_factory=identity)
    motion: tuple[TransformKey, ...] = ()
    primvars: Mapping[str, Primvar] = field(default_factory=dict)
    material: str | None = None
    instancer: str | None = None
    visible: bool = True

    def __post_init__(self) -> None:
        convert(self, "world_from_object", np.float64, 4, 4)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Instancer:
    """Placements: shape (n, 4, 4), float64, ``parent_from_instance`` (the world if there is no parent).

    Prims that name this instancer are drawn once an entry, at
    ``instances of parent @ transforms[i] @ prim.world_from_object``. `motion` says where they are while the
    shutter is open, as of a mesh.
    """

    transforms: Matrix
    motion: tuple[InstancerKey, ...] = ()
    parent: str | None = None
    visible: bool = True

    def __post_init__(self) -> None:
        convert(self, "transforms", np.float64, None, 4, 4)
        for key in self.motion:
            if len(key.transforms) != len(self.transforms):
                raise ValueError(
                    f"motion has {len(key.transforms)} transforms at {key.time}; it must have "
                    f"{len(self.transforms)}"
                )

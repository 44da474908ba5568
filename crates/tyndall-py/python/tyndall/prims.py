"""The prims of a shot as a front end hands them to the render delegate.

Each class mirrors the struct of the same name in the crate ``tyndall-scene``, field by field. Array arguments
are converted once, here, to the contiguous dtype the core reads without copying again; a wrong shape raises
``ValueError`` naming the argument.

Conventions: stage units, never rescaled; linear Rec.709; matrices are float64 in *column-vector* convention,
so ``world_from_object @ [x, y, z, 1]`` (USD's ``Gf.Matrix4d`` and Blender's row storage differ: the front end
transposes where needed).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FloatArray: TypeAlias = npt.NDArray[np.float32]
IntArray: TypeAlias = npt.NDArray[np.int32]
Matrix: TypeAlias = npt.NDArray[np.float64]

Interpolation: TypeAlias = Literal["constant", "uniform", "varying", "vertex", "faceVarying"]
SubdivisionScheme: TypeAlias = Literal["none", "catmullClark", "loop", "bilinear"]
ShapeKind: TypeAlias = Literal["sphere", "cube", "cylinder", "cone", "capsule", "plane"]
LightKind: TypeAlias = Literal["sphere", "rect", "disk", "cylinder", "distant", "dome"]
ConeProfile: TypeAlias = Literal["angle", "cosine", "honeycomb"]
Projection: TypeAlias = Literal["perspective", "orthographic"]

INTERPOLATIONS: tuple[Interpolation, ...] = ("constant", "uniform", "varying", "vertex", "faceVarying")


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


def _convert(prim: object, name: str, dtype: type[np.generic], *shape: int | None) -> None:
    """Replace the attribute `name` of a frozen dataclass by its contiguous form."""
    object.__setattr__(prim, name, _array(name, getattr(prim, name), dtype, shape))


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


def _no_ints() -> IntArray:
    return np.empty(0, np.int32)


def _no_floats() -> FloatArray:
    return np.empty(0, np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Subdivision:
    """How a mesh is subdivided; index arrays are int32, sharpnesses float32, all one-dimensional."""

    scheme: SubdivisionScheme = "none"
    crease_indices: IntArray = field(default_factory=_no_ints)
    crease_lengths: IntArray = field(default_factory=_no_ints)
    crease_sharpnesses: FloatArray = field(default_factory=_no_floats)
    corner_indices: IntArray = field(default_factory=_no_ints)
    corner_sharpnesses: FloatArray = field(default_factory=_no_floats)

    def __post_init__(self) -> None:
        for name in ("crease_indices", "crease_lengths", "corner_indices"):
            _convert(self, name, np.int32, None)
        for name in ("crease_sharpnesses", "corner_sharpnesses"):
            _convert(self, name, np.float32, None)


@dataclass(frozen=True, slots=True, eq=False)
class Subset:
    """Faces (indices, int32) with a material of their own; ``None`` leaves the mesh's."""

    faces: IntArray
    material: str | None

    def __post_init__(self) -> None:
        _convert(self, "faces", np.int32, None)


@dataclass(frozen=True, slots=True, eq=False)
class TransformKey:
    """Where an object is at `time` in [0, 1]: 0 when the shutter opens, 1 when it closes."""

    time: float
    world_from_object: Matrix

    def __post_init__(self) -> None:
        _convert(self, "world_from_object", np.float64, 4, 4)


@dataclass(frozen=True, slots=True, eq=False)
class InstancerKey:
    """Where the instances of an instancer are at `time`: as many as it has, in the same order."""

    time: float
    transforms: Matrix

    def __post_init__(self) -> None:
        _convert(self, "transforms", np.float64, None, 4, 4)


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
    hole_indices: IntArray = field(default_factory=_no_ints)
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
        _convert(self, "world_from_object", np.float64, 4, 4)
        _convert(self, "points", np.float32, None, 3)
        for name in ("face_vertex_counts", "face_vertex_indices", "hole_indices"):
            _convert(self, name, np.int32, None)
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
        _convert(self, "world_from_object", np.float64, 4, 4)


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
        _convert(self, "transforms", np.float64, None, 4, 4)
        for key in self.motion:
            if len(key.transforms) != len(self.transforms):
                raise ValueError(
                    f"motion has {len(key.transforms)} transforms at {key.time}; it must have "
                    f"{len(self.transforms)}"
                )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Volume:
    """A medium filled from fields: pairs of the name shaders ask for and the path of the field prim.

    Without a material, extinction is the field ``density`` (or the first) with a grey albedo.
    """

    fields: Sequence[tuple[str, str]]
    material: str | None = None
    world_from_object: Matrix = field(default_factory=identity)
    instancer: str | None = None
    visible: bool = True

    def __post_init__(self) -> None:
        _convert(self, "world_from_object", np.float64, 4, 4)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Field:
    """A grid: in a file (`path`, `grid`, `index`) or in memory (`values`, `origin`, `voxel_size`).

    Parameters
    ----------
    world_from_field : ndarray, shape (4, 4), float64
        Applied after the file's own transform.
    path : str or None
        The OpenVDB file; ``None`` if `values` is given.
    grid : str
        Name of the grid in the file.
    index : int or None
        Which of several grids of that name.
    values : ndarray, shape (nx, ny, nz), float32, or None
        Samples along x, y, z; zero outside.
    origin : tuple of 3 float
        Position of sample (0, 0, 0) in field space.
    voxel_size : float
        Distance between samples.
    """

    world_from_field: Matrix = field(default_factory=identity)
    path: str | None = None
    grid: str = ""
    index: int | None = None
    values: FloatArray | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    voxel_size: float = 1.0

    def __post_init__(self) -> None:
        _convert(self, "world_from_field", np.float64, 4, 4)
        if (self.path is None) == (self.values is None):
            raise ValueError("a field needs either path or values")
        if self.values is not None:
            _convert(self, "values", np.float32, None, None, None)


@dataclass(frozen=True, slots=True)
class Shaping:
    """Restricts the directions of a light (UsdLuxShapingAPI); the cone's half angle is in degrees.

    Towards its edge, light fades by smoothstep of the angle (UsdLux) or of its cosine (Blender's spots), or
    linearly in its tangent as behind a honeycomb, where a card keeps its power (Blender's spread).
    """

    focus: float = 0.0
    focus_tint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cone_angle: float = 90.0
    cone_softness: float = 0.0
    cone_profile: ConeProfile = "angle"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Light:
    """A light with UsdLux's parameters and units; colour temperature is already multiplied into `color`.

    `params` by kind: sphere {radius, as_point}; rect {width, height, texture}; disk {radius}; cylinder
    {length, radius, as_line}; distant {angle in degrees}; dome {texture}. `texture` is a file path and absent
    if there is none. Rays go on behind lights that are not `opaque`, having gained their radiance; camera
    rays pass those that are not `camera_visible`, and those at infinity leave the image black there.
    """

    kind: LightKind
    params: Mapping[str, float | bool | str] = field(default_factory=dict)
    world_from_light: Matrix = field(default_factory=identity)
    intensity: float = 1.0
    exposure: float = 0.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    normalize: bool = False
    diffuse: float = 1.0
    specular: float = 1.0
    shaping: Shaping = field(default_factory=Shaping)
    visible: bool = True
    camera_visible: bool = True
    opaque: bool = True

    def __post_init__(self) -> None:
        _convert(self, "world_from_light", np.float64, 4, 4)


@dataclass(frozen=True, slots=True)
class NodeRef:
    """The output of the node at `index`, which comes earlier in the list."""

    index: int


@dataclass(frozen=True, slots=True)
class Table:
    """A list of numbers, such as the colours of a ramp."""

    values: tuple[float, ...]


NodeInput: TypeAlias = float | tuple[float, float, float] | str | NodeRef


@dataclass(frozen=True, slots=True)
class Node:
    """A node of the shading graph: its kind's name and the inputs that are authored."""

    kind: str
    inputs: Mapping[str, NodeInput | Table] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Material:
    """A shading graph: nodes, inputs before their users, and the indices of its two terminals.

    ``surface=None`` means no surface at all: an invisible, index-matched boundary.
    """

    nodes: Sequence[Node] = ()
    surface: int | None = None
    volume: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CameraKey:
    """Where a camera is at `time` in [0, 1]: 0 when the shutter opens, 1 when it closes."""

    time: float
    world_from_camera: Matrix

    def __post_init__(self) -> None:
        _convert(self, "world_from_camera", np.float64, 4, 4)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Camera:
    """A camera looking along its local -z with +y up.

    `aperture` and `aperture_offset` have the unit of `focal_length` for perspective and are in stage units
    for orthographic; `lens_radius`, `focus_distance` and `clipping_range` are in stage units. A radius of 0
    is a pinhole. `motion` says where it is while the shutter is open, in the order of time; between two keys
    it goes straight and turns evenly.
    """

    world_from_camera: Matrix = field(default_factory=identity)
    motion: tuple[CameraKey, ...] = ()
    projection: Projection = "perspective"
    aperture: tuple[float, float] = (36.0, 24.0)
    aperture_offset: tuple[float, float] = (0.0, 0.0)
    focal_length: float = 50.0
    lens_radius: float = 0.0
    focus_distance: float = 1.0
    clipping_range: tuple[float, float] = (0.0, float("inf"))
    exposure_scale: float = 1.0

    def __post_init__(self) -> None:
        _convert(self, "world_from_camera", np.float64, 4, 4)


Prim: TypeAlias = Mesh | Shape | Instancer | Volume | Field | Light | Material | Camera

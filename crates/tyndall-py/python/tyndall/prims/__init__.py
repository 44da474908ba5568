"""The prims of a shot as a front end hands them to the render delegate.

Each class mirrors the struct of the same name in the crate ``tyndall-scene``, field by field. Array arguments
are converted once, here, to the contiguous dtype the core reads without copying again; a wrong shape raises
``ValueError`` naming the argument.

Conventions: stage units, never rescaled; linear Rec.709; matrices are float64 in *column-vector* convention,
so ``world_from_object @ [x, y, z, 1]`` (USD's ``Gf.Matrix4d`` and Blender's row storage differ: the front end
transposes where needed).
"""

from __future__ import annotations

from typing import TypeAlias

from .arrays import FloatArray, IntArray, Matrix, identity
from .camera import Camera, Projection
from .geometry import (
    INTERPOLATIONS,
    Instancer,
    Interpolation,
    Mesh,
    Primvar,
    Shape,
    ShapeKind,
    Subdivision,
    SubdivisionScheme,
    Subset,
)
from .light import ConeProfile, Light, LightKind, Shaping
from .material import Material, Node, NodeInput, NodeRef, Table
from .motion import InstancerKey, TransformKey
from .volume import Field, Volume

Prim: TypeAlias = Mesh | Shape | Instancer | Volume | Field | Light | Material | Camera

__all__ = [
    "INTERPOLATIONS",
    "Camera",
    "ConeProfile",
    "Field",
    "FloatArray",
    "Instancer",
    "InstancerKey",
    "IntArray",
    "Interpolation",
    "Light",
    "LightKind",
    "Material",
    "Matrix",
    "Mesh",
    "Node",
    "NodeInput",
    "NodeRef",
    "Prim",
    "Primvar",
    "Projection",
    "Shape",
    "ShapeKind",
    "Shaping",
    "Subdivision",
    "SubdivisionScheme",
    "Subset",
    "Table",
    "TransformKey",
    "Volume",
    "identity",
]

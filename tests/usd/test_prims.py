"""The dataclasses that cross to the core."""

from __future__ import annotations

import numpy as np
import pytest
from tyndall import prims
from tyndall.delegate import DirtyBits


def _mesh(**changes):
    return prims.Mesh(
        **{
            "points": np.zeros((3, 3)),
            "face_vertex_counts": [3],
            "face_vertex_indices": [0, 1, 2],
            **changes,
        }
    )


def test_arrays_are_converted_once_at_the_border():
    mesh = _mesh(points=np.zeros((3, 6), np.float64)[:, ::2])
    assert mesh.points.dtype == np.float32
    assert mesh.points.flags.c_contiguous
    assert mesh.hole_indices.shape == (0,)
    kept = np.zeros((5, 3), np.float32)
    assert _mesh(points=kept).points is kept, "what is right already is not copied"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": np.zeros((3, 2))}, r"points has shape \(3, 2\); it must be \(n, 3\)"),
        ({"world_from_object": np.eye(3)}, "world_from_object"),
        ({"face_vertex_counts": [[3]]}, "face_vertex_counts"),
        ({"normals": prims.Primvar("vertex", np.zeros((3, 2)))}, "normals"),
    ],
)
def test_wrong_shapes_are_refused_by_name(changes, message):
    with pytest.raises(ValueError, match=message):
        _mesh(**changes)


def test_primvars_have_one_to_four_components():
    assert prims.Primvar("vertex", np.zeros(4)).components == 1
    with pytest.raises(ValueError, match="values"):
        prims.Primvar("vertex", np.zeros((4, 5)))
    with pytest.raises(ValueError, match="faceVarying"):
        prims.Primvar("facevarying", np.zeros(4))


def test_fields_need_one_source():
    with pytest.raises(ValueError, match="either path or values"):
        prims.Field()
    with pytest.raises(ValueError, match="values"):
        prims.Field(values=np.zeros((2, 2)))


def test_instancers_take_stacks_of_matrices():
    assert prims.Instancer(transforms=[]).transforms.shape == (0, 4, 4)
    with pytest.raises(ValueError, match="transforms"):
        prims.Instancer(transforms=np.eye(4))


def test_dirty_bits_are_those_of_the_core():
    assert DirtyBits.TRANSFORM == 1
    assert DirtyBits.INSTANCES == 1 << 10
    assert sum(bit for bit in DirtyBits) == DirtyBits.ALL

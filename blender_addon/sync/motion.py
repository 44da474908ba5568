# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion while the shutter is open: Blender is brought to three times, and where things are then is kept."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from mathutils import Matrix, Quaternion
from tyndall.prims import InstancerKey, TransformKey

from .mesh import TO_MESH, mesh_of
from .xform import to_array

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import bpy

#: What is done about motion that is not blurred.
ACTION = "it is drawn as it is at the frame's own time; only transforms of surfaces and cameras are blurred"
#: Times of the shutter, 0 when it opens and 1 when it closes, that Blender is brought to: those of Cycles.
_TIMES = (0.0, 0.5, 1.0)
#: The core goes straight between keys: something that turns by this angle is off by 0.1 % of its radius.
_LARGEST_TURN = math.radians(5.0)
#: When the shutter opens, in lengths of its stay after the frame.
_OPENS = {"START": 0.0, "CENTER": -0.5, "END": -1.0}

#: What tells an instance from all others of a depsgraph, at any time.
Identity: TypeAlias = tuple[object, ...]


@dataclass(frozen=True)
class Way:
    """Where something is at `_TIMES`; in between it goes straight and turns evenly, as Cycles has it."""

    matrices: tuple[Matrix, ...]

    @property
    def pieces(self) -> int:
        """Straight lines that one half of the way needs."""
        turns = [a.to_quaternion().rotation_difference(b.to_quaternion()) for a, b in pairwise(self.matrices)]
        return max(1, math.ceil(max(abs(turn.angle) for turn in turns) / _LARGEST_TURN))

    def at(self, time: float) -> np.ndarray:
        """Return the matrix at `time`, shape (4, 4)."""
        half = 0 if time < _TIMES[1] else 1
        share = (time - _TIMES[half]) / (_TIMES[half + 1] - _TIMES[half])
        first, last = self.matrices[half : half + 2]
        if share in (0.0, 1.0):
            return to_array(last if share else first)
        (rotation, stretch), (rotation_after, stretch_after) = _polar(first), _polar(last)
        linear = rotation.slerp(rotation_after, share).to_matrix() @ stretch.lerp(stretch_after, share)
        return to_array(Matrix.Translation(first.translation.lerp(last.translation, share)) @ linear.to_4x4())

    def keys(self) -> tuple[TransformKey, ...]:
        """Return the motion of one prim."""
        return tuple(TransformKey(time, self.at(time)) for time in _times(self.pieces))


@dataclass(frozen=True)
class Motions:
    """What moves while the shutter is open; empty without motion blur."""

    ways: Mapping[Identity, Way] = field(default_factory=dict)
    camera: Way | None = None
    #: Whether the camera zooms.
    zooms: bool = False
    #: Names of objects whose shape changes.
    bent: frozenset[str] = frozenset()

    def of(self, instance: bpy.types.DepsgraphObjectInstance) -> Way | None:
        """Return how an instance moves; `None` if it stands still."""
        return self.ways.get(_identity(instance)) if self.ways else None


#: Of what has no shutter.
STILL = Motions()


def instancer_keys(placed: np.ndarray, ways: Mapping[int, Way]) -> tuple[InstancerKey, ...]:
    """Return the motion of instances, shape (n, 4, 4) at the frame, of which those with a way move."""
    if not ways:
        return ()
    keys = []
    for time in _times(max(way.pieces for way in ways.values())):
        transforms = placed.copy()
        for index, way in ways.items():
            transforms[index] = way.at(time)
        keys.append(InstancerKey(time, transforms))
    return tuple(keys)


def read_motions(depsgraph: bpy.types.Depsgraph, set_frame: Callable[[int, float], None]) -> Motions:
    """Bring Blender to when the shutter opens, is half way and closes, and back.

    Afterwards nothing is valid that was evaluated before.
    """
    scene = depsgraph.scene
    render = scene.render
    shutter = render.motion_blur_shutter
    if not render.use_motion_blur or shutter <= 0.0:
        return STILL
    frame, subframe = scene.frame_current, scene.frame_subframe
    opens = frame + subframe + _OPENS[render.motion_blur_position] * shutter
    seen = []
    try:
        for time in _TIMES:
            at = opens + time * shutter
            set_frame(math.floor(at), at - math.floor(at))
            seen.append(_Seen.of(depsgraph))
    finally:
        set_frame(frame, subframe)
    first, *others = seen
    return Motions(
        ways={
            key: Way((matrix, *(other.matrices[key] for other in others)))
            for key, matrix in first.matrices.items()
            if all(key in other.matrices for other in others)
            and any(other.matrices[key] != matrix for other in others)
        },
        camera=_way(tuple(each.camera for each in seen)),
        zooms=any(other.lens != first.lens for other in others),
        bent=frozenset(name for name, sum_ in first.shapes.items() if others[-1].shapes.get(name) != sum_),
    )


@dataclass
class _Seen:
    """The scene at one time: matrices in the world, and check sums of shapes that may change."""

    matrices: dict[Identity, Matrix] = field(default_factory=dict)
    shapes: dict[str, int] = field(default_factory=dict)
    camera: Matrix | None = None
    lens: tuple[float, ...] = ()

    @classmethod
    def of(cls, depsgraph: bpy.types.Depsgraph) -> _Seen:
        seen = cls()
        camera = depsgraph.scene_eval.camera
        if camera is not None:
            camera = camera.evaluated_get(depsgraph)
            data = camera.data
            seen.camera = camera.matrix_world.copy()
            seen.lens = (data.lens, data.ortho_scale, data.sensor_width, data.sensor_height)
        for instance in depsgraph.object_instances:
            seen.matrices[_identity(instance)] = instance.matrix_world.copy()
            thing = instance.object
            if thing.name_full not in seen.shapes and _may_bend(thing):
                seen.shapes[thing.name_full] = _check_sum(thing)
        return seen


def _identity(instance: bpy.types.DepsgraphObjectInstance) -> Identity:
    thing = instance.object
    if not instance.is_instance:
        return thing.name_full, thing.type
    return thing.name_full, thing.type, instance.parent.name_full, *instance.persistent_id


def _may_bend(thing: bpy.types.Object) -> bool:
    """Return whether the shape can depend on time; metaballs flow together with others."""
    if thing.type != "MESH" and thing.type not in TO_MESH:
        return False
    data = thing.original.data
    has_keys = getattr(data, "shape_keys", None) is not None
    is_animated = thing.type == "META" or getattr(data, "animation_data", None) is not None
    return has_keys or is_animated or bool(thing.modifiers)


def _check_sum(thing: bpy.types.Object) -> int:
    with mesh_of(thing) as mesh:
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
    return zlib.crc32(points)


def _way(matrices: tuple[Matrix | None, ...]) -> Way | None:
    if None in matrices or all(matrix == matrices[0] for matrix in matrices):
        return None
    return Way(matrices)


def _polar(matrix: Matrix) -> tuple[Quaternion, Matrix]:
    """Return the rotation of a matrix, and what it does before: scale and shear."""
    rotation = matrix.to_quaternion()
    return rotation, rotation.to_matrix().transposed() @ matrix.to_3x3()


def _times(pieces: int) -> list[float]:
    n = pieces * (len(_TIMES) - 1)
    return [i / n for i in range(n + 1)]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated scene at a render delegate: walked, compared with what is there, and sent where it differs.

Objects that share their data and materials are one prototype with many placements, however they came about:
linked duplicates, collections, particles, geometry nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import tyndall
from tyndall.index import PrimIndex
from tyndall.messages import Messages
from tyndall.prims import Instancer, Mesh, Prim, TransformKey, Volume

from .. import compat
from . import camera as cameras
from . import material as materials
from .images import ImageFiles, TemporaryFolder
from .light import read_light
from .mesh import TO_MESH, mesh_of, read_mesh
from .motion import ACTION, STILL, Motions, Way, instancer_keys
from .unsupported import report_light_linking, report_object, report_scene
from .volume import VolumeFiles, density_scale, read_fields
from .world import read_world
from .xform import to_array, to_arrays

if TYPE_CHECKING:
    from collections.abc import Callable

    import bpy
    from mathutils import Matrix

#: Types that make no picture.
_SILENT = ("EMPTY", "ARMATURE", "LATTICE", "CAMERA", "SPEAKER", "LIGHT_PROBE")


@dataclass
class _Group:
    """Objects that look the same."""

    path: str
    prims: dict[str, Prim]
    matrices: list[Matrix] = field(default_factory=list)
    #: By index: those that move while the shutter is open.
    ways: dict[int, Way] = field(default_factory=dict)


@dataclass
class _Cached:
    """A mesh read before, and what was said about it."""

    mesh: Mesh | None
    messages: Messages
    owners: set[int]


class SceneSync:
    """Keeps a delegate equal to an evaluated scene."""

    def __init__(self, when_painted: Callable[[], None] | None = None) -> None:
        """With `when_painted` skies are not waited for; it is called by another thread when one is ready."""
        self._when_painted = when_painted
        self.delegate = tyndall.RenderDelegate()
        self._index = PrimIndex(self.delegate)
        self._folder = TemporaryFolder()
        self._images = ImageFiles(self._folder)
        self._volumes = VolumeFiles(self._folder)
        self._meshes: dict[tuple[object, ...], _Cached] = {}

    def forget(self, changed: set[int]) -> None:
        """Have the geometry of these data-blocks and objects (by session uid) read anew."""
        self._meshes = {key: c for key, c in self._meshes.items() if not c.owners & changed}

    def forget_all(self) -> None:
        """Have all geometry read anew."""
        self._meshes.clear()

    def sync(self, depsgraph: bpy.types.Depsgraph, *, is_transparent: bool, motions: Motions = STILL) -> int:
        """Bring the delegate to the scene; return how many prims changed. The camera stays."""
        messages = Messages()
        reading = _Reading(depsgraph, self._images, self._volumes, self._meshes, messages, motions)
        prims = reading.read()
        prims.update(
            read_world(
                compat.world_of(depsgraph.scene_eval, depsgraph.view_layer_eval),
                frame=depsgraph.scene_eval.frame_current_final,
                is_transparent=is_transparent,
                images=self._images,
                messages=messages,
                when_painted=self._when_painted,
            )
        )
        self._meshes = reading.used
        camera = self._index.prims.get(cameras.PATH)
        if camera is not None:
            prims[cameras.PATH] = camera
        changed = self._index.replace_all(prims)
        messages.send(self.delegate)
        return changed

    def sync_camera(self, camera: tyndall.prims.Camera, messages: Messages) -> bool:
        """Set the camera that renders; return whether it changed."""
        changed = self._index.replace(cameras.PATH, camera)
        messages.send(self.delegate)
        return changed


class _Reading:
    """One walk."""

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        images: ImageFiles,
        volumes: VolumeFiles,
        meshes: dict[tuple[object, ...], _Cached],
        messages: Messages,
        motions: Motions,
    ) -> None:
        self.used: dict[tuple[object, ...], _Cached] = {}
        self._depsgraph = depsgraph
        self._override = depsgraph.view_layer_eval.material_override
        self._images = images
        self._volumes = volumes
        self._meshes = meshes
        self._messages = messages
        self._motions = motions
        self._groups: dict[tuple[object, ...], _Group | None] = {}
        self._found: dict[tuple[int, int, float], _Group] = {}
        self._prims: dict[str, Prim] = {materials.DEFAULT_PATH: materials.DEFAULT}
        self._looks: dict[tuple[int, float | None], tuple[str, frozenset[str]]] = {}
        self._paths: set[str] = set()

    def read(self) -> dict[str, Prim]:
        """Return all prims but camera and world."""
        report_scene(self._depsgraph.scene_eval, self._depsgraph.view_layer, self._messages)
        for instance in self._depsgraph.object_instances:
            if instance.show_self:
                self._add(instance)
        for group in self._groups.values():
            if group is not None:
                self._place(group)
        return self._prims

    def _add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        thing = instance.object
        kind = thing.type
        way = self._motions.of(instance)
        if kind == "LIGHT":
            path = self._unused(f"/{thing.name_full}")
            light = read_light(thing.data, to_array(instance.matrix_world), path, self._messages)
            report_light_linking(thing, path, self._messages)
            if way is not None:
                self._report_motion(path)
            if light is not None:
                self._prims[path] = replace(light, camera_visible=thing.visible_camera)
            return
        if kind in _SILENT or thing.data is None:
            return
        group = self._group_of(instance, thing, kind)
        if way is not None:
            group.ways[len(group.matrices)] = way
        group.matrices.append(instance.matrix_world.copy())

    def _group_of(
        self, instance: bpy.types.DepsgraphObjectInstance, thing: bpy.types.Object, kind: str
    ) -> _Group:
        """Return the group that an object belongs to; one for itself if it is not drawn."""
        # Scaled volumes differ in their material.
        scale = 1.0
        if kind == "VOLUME":
            scale = density_scale(thing.data, to_array(instance.matrix_world))
        source = instance.instance_object if instance.is_instance else thing
        # Objects differ in their materials and so on: asked only of the first of them.
        short = (source.as_pointer(), thing.data.as_pointer(), scale)
        if short not in self._found:
            self._found[short] = self._full_group(thing, kind, scale) or _Group("", {})
        return self._found[short]

    def _full_group(self, thing: bpy.types.Object, kind: str, scale: float) -> _Group | None:
        slots = tuple(s.material.name_full if s.material else "" for s in thing.material_slots)
        key = (thing.data.as_pointer(), kind, slots, scale)
        if kind in TO_MESH:
            key = (*key, thing.as_pointer())
        if key not in self._groups:
            self._groups[key] = self._read(thing, kind, scale)
            path = f"/{thing.name_full}"
            report_object(thing, path, self._depsgraph.view_layer, self._messages)
            if thing.name_full in self._motions.bent:
                self._messages.warning(path, "its shape changes while the shutter is open", ACTION)
        return self._groups[key]

    def _unused(self, path: str) -> str:
        """Return `path`, numbered if it is taken."""
        free, number = path, 1
        while free in self._paths:
            number += 1
            free = f"{path} #{number}"
        self._paths.add(free)
        return free

    def _read(self, thing: bpy.types.Object, kind: str, scale: float) -> _Group | None:
        path = self._unused(f"/{thing.name_full}")
        if _is_smoke_domain(thing):
            self._messages.error(
                path, "smoke domains are not supported", "it is not drawn; load its cache as a Volume object"
            )
            return None
        if kind == "MESH" or kind in TO_MESH:
            mesh = self._mesh(thing, path)
            return None if mesh is None else _Group(path, {path: mesh})
        if kind == "VOLUME":
            prims = self._volume(thing, path, scale)
            return _Group(path, prims) if prims else None
        self._messages.warning(path, f"objects of type {kind} are not supported", "it is not drawn")
        return None

    def _mesh(self, thing: bpy.types.Object, path: str) -> Mesh | None:
        looks = [self._look(slot.material) for slot in thing.material_slots] or [self._look(None)]
        wanted = frozenset().union(*(names for _, names in looks))
        slots = tuple(look for look, _ in looks)
        original = thing.original
        key = (compat.session_uid(original), thing.data.name_full, path, slots, wanted)
        cached = self._meshes.get(key)
        if cached is None:
            messages = Messages()
            with mesh_of(thing) as mesh:
                read = read_mesh(mesh, path, materials=slots, primvars=wanted, messages=messages)
            owners = {compat.session_uid(original)}
            if thing.data.original is not None:
                owners.add(compat.session_uid(thing.data.original))
            if original.data is not None:
                owners.add(compat.session_uid(original.data))
            cached = _Cached(read, messages, owners)
        self._messages.extend(cached.messages)
        self.used[key] = cached
        return cached.mesh

    def _volume(self, thing: bpy.types.Object, path: str, scale: float) -> dict[str, Prim]:
        volume = thing.data
        is_generated = not volume.filepath or any(m.show_render for m in thing.modifiers)
        file = self._volumes.file_of(volume, path, self._messages, is_generated=is_generated)
        if file is None:
            return {}
        fields = read_fields(volume, file, np.eye(4))
        slot = next((s for s in thing.material_slots if s.material), None)
        material = None if slot is None else self._look(slot.material, grid_scale=scale)[0]
        if material is None and scale != 1.0:
            self._messages.warning(path, "a scaled volume without a material", "its density is not scaled")
        prims: dict[str, Prim] = {f"{path}/{name}": grid for name, grid in fields.items()}
        named = [(name, f"{path}/{name}") for name in fields]
        prims[path] = Volume(fields=named, material=material)
        return prims

    def _look(
        self, material: bpy.types.Material | None, *, grid_scale: float | None = None
    ) -> tuple[str, frozenset[str]]:
        """Return the path of a material and the attributes that it reads; of grids, with a factor on them."""
        material = self._override or material
        if material is None:
            return materials.DEFAULT_PATH, frozenset()
        key = (compat.session_uid(material.original), grid_scale)
        if key not in self._looks:
            suffix = "" if grid_scale is None else f" of grids x {grid_scale:g}"
            path = f"/Materials/{material.name_full}{suffix}"
            look = materials.read_material(
                material,
                path,
                images=self._images,
                messages=self._messages,
                has_grids=grid_scale is not None,
                volume_scale=1.0 if grid_scale is None else grid_scale,
            )
            self._prims[path] = look.material
            self._looks[key] = (path, look.primvars)
        return self._looks[key]

    def _place(self, group: _Group) -> None:
        """Add the prims of a group: in place if it is one, else as prototypes of an instancer."""
        if len(group.matrices) == 1:
            world = to_array(group.matrices[0])
            keys = group.ways[0].keys() if group.ways else ()
            self._prims.update({path: _placed(prim, world, None, keys) for path, prim in group.prims.items()})
            if keys and isinstance(group.prims[group.path], Volume):
                self._report_motion(group.path)
            return
        instancer = f"{group.path}/instances"
        placed = to_arrays(group.matrices)
        self._prims[instancer] = Instancer(transforms=placed, motion=instancer_keys(placed, group.ways))
        identity = np.eye(4)
        self._prims.update({path: _placed(prim, identity, instancer) for path, prim in group.prims.items()})

    def _report_motion(self, path: str) -> None:
        self._messages.warning(path, "it moves while the shutter is open", ACTION)


def _is_smoke_domain(thing: bpy.types.Object) -> bool:
    """Return whether a mesh stands for baked smoke: drawn as a mesh it would be a box of even fog."""
    return any(
        m.type == "FLUID" and m.fluid_type == "DOMAIN" and m.domain_settings.domain_type == "GAS"
        for m in thing.modifiers
        if m.show_render
    )


def _placed(
    prim: Prim, world: np.ndarray, instancer: str | None, motion: tuple[TransformKey, ...] = ()
) -> Prim:
    if isinstance(prim, Mesh):
        return replace(prim, world_from_object=world, instancer=instancer, motion=motion)
    if isinstance(prim, Volume):
        return replace(prim, world_from_object=world, instancer=instancer)
    return replace(prim, world_from_field=world)  # type: ignore[call-arg]

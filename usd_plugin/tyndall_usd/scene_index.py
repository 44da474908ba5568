"""A stage at the render delegate: read, compared with what is there, and synced where it differs."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pxr import Sdf, UsdGeom, UsdShade
from tyndall.dirty import is_same
from tyndall.index import PrimIndex
from tyndall.messages import Messages
from tyndall.prims import (
    Camera,
    Field,
    Instancer,
    InstancerKey,
    Light,
    Mesh,
    Prim,
    Shape,
    TransformKey,
    Volume,
)

from tyndall_usd.assets import Assets
from tyndall_usd.materials import MaterialLibrary
from tyndall_usd.memory import Memory
from tyndall_usd.motion import report_unblurred
from tyndall_usd.read.camera import read_camera
from tyndall_usd.read.context import ReadContext
from tyndall_usd.read.light import read_light
from tyndall_usd.read.mesh import face_count, material_subsets, read_mesh, read_subset
from tyndall_usd.read.shape import read_shape, turn_of
from tyndall_usd.read.volume import read_field, read_volume
from tyndall_usd.read.xform import to_matrix, world_matrix
from tyndall_usd.skeleton import SkeletonBaker
from tyndall_usd.traversal import Traversal

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Collection, Iterator, Mapping

    from pxr import Gf, Usd
    from tyndall.index import Delegate
    from tyndall.prims import LightKind, Matrix

    from tyndall_usd.group import Drawable, Group
    from tyndall_usd.motion import Mover


HEADLIGHT = "/__tyndall/headlight"
DEFAULT_PURPOSES = ("default", "render")
#: Always read, since tangents for normal maps come from it.
_TEXTURE_COORDINATES = "st"
#: A light inside a prototype is synced once an instance; more than these are not.
_MAX_LIGHT_INSTANCES = 100_000


class SceneIndex:
    """Keeps a delegate equal to a stage at one time.

    Parameters
    ----------
    stage : Usd.Stage
    delegate : RenderDelegate
    purposes : collection of str
        What is drawn, by UsdGeomImageable's purpose.
    material_purpose : str
        Purpose of the material bindings; bindings without a purpose are the fallback.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        delegate: Delegate,
        *,
        purposes: Collection[str] = DEFAULT_PURPOSES,
        material_purpose: str = "full",
    ) -> None:
        self._stage = stage
        self._delegate = delegate
        self._purposes = purposes
        self._material_purpose = material_purpose
        self._assets = Assets()
        self._skeletons = SkeletonBaker(stage)
        self._memory = Memory(stage, self._skeletons.roots)
        self._index = PrimIndex(delegate)
        self._movers: dict[str, Mover] = {}
        self.messages = Messages()
        self.type_counts: Counter[str]

    @property
    def prims(self) -> Mapping[str, Prim]:
        """What is at the delegate, by path."""
        return self._index.prims

    def sync(self, time: Usd.TimeCode) -> int:
        """Bring the delegate to `time`; return how many prims changed.

        Cameras have the apertures of the stage: fit the one that is used to the image by `sync_camera`.
        """
        self.messages = Messages()
        self._skeletons.bake(time, self.messages)
        prims = _Reading(
            self._stage,
            time,
            self._purposes,
            self._material_purpose,
            self._assets,
            self.messages,
            self._memory,
        )
        self.type_counts = prims.traversal.type_counts
        self._movers = prims.movers
        changed = self._index.replace_all(prims.prims)
        self.messages.send(self._delegate)
        return changed

    def blur(self, interval: Gf.Interval, messages: Messages) -> None:
        """Let prims move as they do in `interval`, while the shutter is open; an empty one holds them still.

        Those that are not blurred are named. Times are those of the stage as it was synced last.
        """
        for path, mover in self._movers.items():
            keys = [] if interval.IsEmpty() else mover.keys(interval)
            prim = self.prims[path]
            if isinstance(prim, Instancer):
                moving = tuple(InstancerKey(time, matrices) for time, matrices in keys)
                self._index.replace(path, replace(prim, motion=moving))
            elif isinstance(prim, Mesh | Shape):
                placed = tuple(TransformKey(time, matrix) for time, matrix in keys)
                self._index.replace(path, replace(prim, motion=placed))
        if not interval.IsEmpty():
            shown = (Mesh, Shape, Instancer, Volume, Field, Light)
            drawn = [path for path, prim in self.prims.items() if isinstance(prim, shown)]
            report_unblurred(self._stage, drawn, interval, messages)

    def grids_at(self, time: Usd.TimeCode) -> list[tuple[str, str, int | None]]:
        """Return file, grid and index of the fields in use that are other ones at `time`."""
        ctx = ReadContext(time, Messages(), self._assets, np.eye(4))
        found = []
        for path, now in self.prims.items():
            if not isinstance(now, Field):
                continue
            # Fields of instances may have paths that no prim has.
            prim = self._stage.GetPrimAtPath(path) if Sdf.Path.IsValidPathString(path) else None
            then = read_field(prim, ctx, name=path, world_from_field=np.eye(4)) if prim else None
            if then is not None and not is_same(replace(now, world_from_field=then.world_from_field), then):
                found.append((str(then.path), then.grid, then.index))
        return found

    def sync_camera(self, path: str, camera: Camera, messages: Messages) -> None:
        """Replace the camera at `path` by `camera`, which was conformed to the image to be made."""
        self._index.replace(path, camera)
        self.messages.extend(messages)
        messages.send(self._delegate)

    def add_headlight(self, kind: LightKind, camera: Camera) -> None:
        """Light a stage that has no lights, from everywhere (dome) or from the camera (distant)."""
        if any(isinstance(prim, Light) for path, prim in self.prims.items() if path != HEADLIGHT):
            return
        params = {"angle": 0.0} if kind == "distant" else {}
        matrix = camera.world_from_camera if kind == "distant" else np.eye(4)
        # A normalized distant light of intensity pi gives a white card the radiance of its colour.
        intensity = math.pi if kind == "distant" else 1.0
        light = Light(kind=kind, params=params, world_from_light=matrix, intensity=intensity, normalize=True)
        self._index.replace(HEADLIGHT, light)


class _Reading:
    """One reading of the stage: `prims` by delegate path."""

    def __init__(
        self,
        stage: Usd.Stage,
        time: Usd.TimeCode,
        purposes: Collection[str],
        material_purpose: str,
        assets: Assets,
        messages: Messages,
        memory: Memory,
    ) -> None:
        self.prims: dict[str, Prim] = {}
        self.movers: dict[str, Mover] = {}
        self.traversal = Traversal(
            stage,
            time,
            purposes=purposes,
            material_purpose=material_purpose,
            assets=assets,
            messages=messages,
        )
        self._messages = messages
        self._material_purpose = material_purpose
        self._memory = memory
        self._library = MaterialLibrary(time, assets=assets, messages=messages, memory=memory)
        self._read_all(None, self.traversal.drawables)
        for camera in self.traversal.cameras:
            # Messages about a camera matter only if it is used: see `SceneIndex.sync_camera`.
            self.prims[str(camera.GetPath())] = read_camera(camera, time, Messages())
        for group in self.traversal.groups.values():
            transforms, parent = group.instances()
            self.prims[group.instancer_path] = Instancer(transforms=transforms, parent=parent)
            self._keep(group.instancer_path, group.mover())
            self._read_all(group, group.drawables)
        self.prims.update(self._library.materials)

    def _read_all(self, group: Group | None, drawables: list[Drawable]) -> None:
        lights = [d for d in drawables if d.family == "light"]
        others = [d for d in drawables if d.family != "light"]
        materials = self._bound([d.prim for d in others])
        for drawable, material in zip(others, materials, strict=True):
            with self._reporting(drawable):
                self._read_drawable(group, drawable, material)
        for drawable in lights:
            with self._reporting(drawable):
                self._read_light(group, drawable)

    @contextmanager
    def _reporting(self, drawable: Drawable) -> Iterator[None]:
        """Turn what a reader cannot use (attributes of a foreign type) into a message: the rest renders."""
        try:
            yield
        except (TypeError, ValueError) as error:
            self._messages.error(
                drawable.prim.GetPath(), f"cannot be read: {error}", "correct its attributes"
            )

    def _bound(self, prims: list[Usd.Prim]) -> list[UsdShade.Material]:
        """Return the materials bound to `prims`, computed together since they share ancestors."""
        if not prims:
            return []
        materials, _ = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims, self._material_purpose)
        return list(materials)

    def _read_drawable(self, group: Group | None, drawable: Drawable, material: UsdShade.Material) -> None:
        prim, path = drawable.prim, str(drawable.prim.GetPath()) + (group.suffix if group else "")
        ctx = self.traversal.context(
            drawable.matrix,
            instancer=None if group is None else group.instancer_path,
            inherited_primvars=drawable.inherited_primvars,
        )
        if drawable.family == "volume":
            self._read_volume(group, prim, path, ctx, material)
            return
        mover = self.traversal.mover(drawable, group)
        look = self._library.for_gprim(material, has_opacity=_has_opacity(prim))
        wanted = {_TEXTURE_COORDINATES} | self._library.primvars(look)
        if drawable.family == "shape":
            self.prims[path] = read_shape(prim, ctx, material=look, primvars=wanted)
            self._keep(path, mover and mover.after(turn_of(prim, ctx.time)))
            return
        mesh = self._mesh(prim, path, ctx, look, wanted)
        if mesh is not None:
            self.prims[path] = mesh
            self._keep(path, mover)

    def _keep(self, path: str, mover: Mover | None) -> None:
        if mover is not None:
            self.movers[path] = mover

    def _mesh(self, prim: Usd.Prim, path: str, ctx: ReadContext, look: str, wanted: set[str]) -> Mesh | None:
        """Return the mesh with its material subsets; what does not vary in time is read once."""
        parts = material_subsets(prim)
        looks = [self._library.for_gprim(material) for material in self._bound(parts)]
        wanted = wanted.union(*(self._library.primvars(look) for look in looks))

        def read(messages: Messages) -> Mesh | None:
            at = replace(ctx, messages=messages)
            n_faces = face_count(prim, ctx.time)
            subsets = [
                read_subset(part, at, n_faces=n_faces, material=look)
                for part, look in zip(parts, looks, strict=True)
            ]
            found = [subset for subset in subsets if subset is not None]
            return read_mesh(prim, at, material=look, subsets=found, primvars=wanted)

        inherited = [primvar.GetAttr() for primvar in ctx.inherited_primvars]
        handed_down = [attribute.GetPath() for attribute in inherited]
        key = (ctx.time.IsDefault(), look, looks, wanted, ctx.instancer, handed_down)
        sources = lambda: (prim, *parts, *(attribute.GetPrim() for attribute in inherited))  # noqa: E731
        mesh: Mesh | None = self._memory.recall(path, key, sources, ctx.messages, read)
        if mesh is None or np.array_equal(mesh.world_from_object, ctx.world_from_object):
            return mesh
        return replace(mesh, world_from_object=ctx.world_from_object)

    def _read_volume(
        self, group: Group | None, prim: Usd.Prim, path: str, ctx: ReadContext, material: UsdShade.Material
    ) -> None:
        def place_field(name: str, target: Usd.Prim) -> tuple[str, Matrix]:
            matrix = self.traversal.matrix_in_group(target, group)
            if matrix is not None:
                return str(target.GetPath()), to_matrix(matrix)
            return f"{path}.field:{name}", to_matrix(world_matrix(target, ctx.time))

        look = self._library.for_volume(material, volume_path=path)
        volume, fields = read_volume(prim, ctx, material=look, place_field=place_field)
        self.prims.update(fields)
        if volume is not None:
            self.prims[path] = volume

    def _read_light(self, group: Group | None, drawable: Drawable) -> None:
        path = str(drawable.prim.GetPath())
        placements = np.eye(4)[None] if group is None else group.placements()
        if len(placements) > _MAX_LIGHT_INSTANCES:
            self._messages.error(
                path, f"the light is instanced {len(placements)} times", f"only {_MAX_LIGHT_INSTANCES} shine"
            )
            placements = placements[:_MAX_LIGHT_INSTANCES]
        light = read_light(drawable.prim, self.traversal.context(drawable.matrix))
        if group is None:
            self.prims[path] = light
            return
        for i, placement in enumerate(placements):
            self.prims[f"{path}[{i}]"] = replace(light, world_from_light=placement @ light.world_from_light)


def _has_opacity(prim: Usd.Prim) -> bool:
    return bool(UsdGeom.Gprim(prim).GetDisplayOpacityAttr().HasAuthoredValue())

"""One walk over a stage: which gprims, volumes and lights are drawn, and by which placements.

Native instances and point instancers end in the same thing, a `Group`: prims that are stored once and drawn
at many places. A native prototype is read through the proxies of its first instance, so paths, inherited
bindings and primvars are those of the stage. A point instancer only adds placements to the group of each of
its prototype roots. Groups nest: the placements of a group are relative to the group (or the stage) in which
they were met.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pxr import Gf, Usd, UsdGeom, UsdShade

from tyndall_usd.group import Drawable, Group, Use, stacked
from tyndall_usd.motion import Mover
from tyndall_usd.read.context import ReadContext
from tyndall_usd.read.instancer import read_point_instancer, transforms_at, varies
from tyndall_usd.read.light import LIGHTS, UNSUPPORTED_LIGHTS, report_light_apis
from tyndall_usd.read.shape import SHAPES
from tyndall_usd.read.xform import to_matrix

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from pxr import Sdf
    from tyndall.messages import Messages
    from tyndall.prims import Matrix

    from tyndall_usd.assets import Assets
    from tyndall_usd.read.instancer import Mask

Family: TypeAlias = Literal["mesh", "shape", "volume", "light"]

FAMILIES: dict[str, Family] = {
    "Mesh": "mesh",
    "Volume": "volume",
    **dict.fromkeys(SHAPES, "shape"),
    **dict.fromkeys(LIGHTS, "light"),
}
#: Types that only structure the stage, or are read from elsewhere.
_SILENT = frozenset(
    {
        "",
        "Xform",
        "Scope",
        "Camera",
        "Material",
        "Shader",
        "NodeGraph",
        "GeomSubset",
        "OpenVDBAsset",
        "Field3DAsset",
        "SkelRoot",
        "Skeleton",
        "SkelAnimation",
        "BlendShape",
    }
)
_WITHIN_PROTOTYPE = Usd.TraverseInstanceProxies(
    Usd.PrimIsActive & Usd.PrimIsLoaded & Usd.PrimHasDefiningSpecifier
)
_EVERYWHERE = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
#: Beyond so many looks of one prototype by inherited primvars, instances share the first one.
_MAX_LOOKS = 64


@dataclass(slots=True)
class _Visit:
    """A prim to be visited and what it inherits."""

    prim: Usd.Prim
    matrix: Gf.Matrix4d
    varies: bool
    purpose: str
    primvars: list[Any]
    is_bound: bool


@dataclass(slots=True)
class _Instance:
    """A native instance met in a group."""

    visit: _Visit
    prototype: str


class Traversal:
    """The walk. After it, `drawables` and `cameras` are outside instances, `groups` in them."""

    def __init__(
        self,
        stage: Usd.Stage,
        time: Usd.TimeCode,
        *,
        purposes: Collection[str],
        material_purpose: str,
        assets: Assets,
        messages: Messages,
    ) -> None:
        self.stage = stage
        self.time = time
        self.messages = messages
        self.drawables: list[Drawable] = []
        self.cameras: list[Usd.Prim] = []
        self.groups: dict[object, Group] = {}
        self.type_counts: Counter[str] = Counter()
        self._purposes = frozenset(purposes)
        self._material_purpose = material_purpose
        self._assets = assets
        self._prototype_roots: set[Sdf.Path] = set()
        self._shader_primvars = {"displayColor", "displayOpacity"}
        self._look_ahead()
        self._group_paths: set[str] = set()
        self._looks: dict[str, dict[object, object]] = {}
        root = _Visit(
            stage.GetPseudoRoot(),
            Gf.Matrix4d(1.0),
            varies=False,
            purpose="default",
            primvars=[],
            is_bound=False,
        )
        self._walk(list(self._children(root, _EVERYWHERE)), None, self.drawables)

    def matrix_in_group(
        self, prim: Usd.Prim, group: Group | None, time: Usd.TimeCode | None = None
    ) -> Gf.Matrix4d | None:
        """Return the matrix of any prim relative to `group` at `time`; ``None`` if it lies outside."""
        stop = self.stage.GetPseudoRoot().GetPath() if group is None else group.anchor
        if not prim.GetPath().HasPrefix(stop):
            return None
        matrix = Gf.Matrix4d(1.0)
        while prim and prim.GetPath() != stop:
            local, resets = self._local(prim, time)
            matrix = matrix * local
            if resets:
                break
            prim = prim.GetParent()
        return matrix

    def mover(self, drawable: Drawable, group: Group | None) -> Mover | None:
        """Return where `drawable` is in its group at other times; ``None`` if it stands still there."""
        return self._mover(drawable.prim, group) if drawable.varies else None

    def _mover(self, prim: Usd.Prim, group: Group | None) -> Mover:
        return Mover(lambda time: to_matrix(self.matrix_in_group(prim, group, time)), [prim])

    def _look_ahead(self) -> None:
        """Find the roots of point-instanced prototypes, and the primvars that shaders read.

        Prototypes are not drawn beside their instances; instances of one prototype that hand down different
        primvars are different looks.
        """
        for prims in (self.stage.Traverse(), *(Usd.PrimRange(p) for p in self.stage.GetPrototypes())):
            for prim in prims:
                type_name = prim.GetTypeName()
                if type_name == "PointInstancer":
                    targets = UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets()
                    self._prototype_roots.update(targets)
                elif type_name == "Shader":
                    names = (prim.GetAttribute(f"inputs:{name}") for name in ("varname", "geomprop"))
                    self._shader_primvars.update(str(a.Get()) for a in names if a and a.HasValue())

    def _is_prototype_root(self, prim: Usd.Prim) -> bool:
        if prim.GetPath() in self._prototype_roots:
            return True
        return prim.IsInstanceProxy() and prim.GetPrimInPrototype().GetPath() in self._prototype_roots

    def _local(self, prim: Usd.Prim, time: Usd.TimeCode | None = None) -> tuple[Gf.Matrix4d, bool]:
        xformable = UsdGeom.Xformable(prim)
        if not xformable:
            return Gf.Matrix4d(1.0), False
        resets = bool(xformable.GetResetXformStack())
        return xformable.GetLocalTransformation(self.time if time is None else time), resets

    def _children(self, visit: _Visit, predicate: object) -> Iterator[_Visit]:
        for child in visit.prim.GetFilteredChildren(predicate):
            yield replace(visit, prim=child)

    def _walk(
        self,
        pending: list[_Visit],
        group: Group | None,
        drawables: list[Drawable],
        predicate: object = _EVERYWHERE,
        *,
        is_root_prototype: bool = False,
    ) -> None:
        """Visit `pending` and what is below; then the groups that were met for the first time."""
        instances: list[_Instance] = []
        new_groups: list[tuple[Group, _Visit]] = []
        pending = pending[::-1]
        skip_check = is_root_prototype
        while pending:
            visit = pending.pop()
            is_prototype_root = (
                not skip_check and self._prototype_roots and self._is_prototype_root(visit.prim)
            )
            skip_check = False
            if is_prototype_root or not self._enter(visit, group):
                continue
            prim = visit.prim
            type_name = str(prim.GetTypeName())
            self.type_counts[type_name] += 1
            if type_name == "PointInstancer":
                new_groups += self._place_prototypes(visit, group)
                continue
            if type_name == "Camera" and group is None:
                self.cameras.append(prim)
            self._draw(visit, type_name, drawables)
            if prim.IsInstance():
                instances.append(_Instance(visit, str(prim.GetPrototype().GetPath())))
            elif type_name not in ("Material", "NodeGraph"):
                pending += list(self._children(visit, predicate))[::-1]
        new_groups += self._place_instances(instances, group)
        for new_group, visit in new_groups:
            is_native = visit.prim.IsInstance() and new_group.anchor == visit.prim.GetPath()
            start = list(self._children(visit, _EVERYWHERE)) if is_native else [visit]
            self._walk(
                start,
                new_group,
                new_group.drawables,
                _EVERYWHERE if is_native else _WITHIN_PROTOTYPE,
                is_root_prototype=not is_native,
            )

    def _enter(self, visit: _Visit, group: Group | None) -> bool:
        """Update what `visit` inherits by its own opinions; return whether it is visible."""
        prim = visit.prim
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return True
        if imageable.GetVisibilityAttr().Get(self.time) == "invisible":
            return False
        purpose = imageable.GetPurposeAttr()
        if purpose.HasAuthoredValue():
            visit.purpose = str(purpose.Get())
        if UsdGeom.Xformable(prim):
            local, resets = self._local(prim)
            visit.matrix = local if resets else local * visit.matrix
            varies = UsdGeom.Xformable(prim).TransformMightBeTimeVarying()
            visit.varies = varies or (visit.varies and not resets)
            if resets and group is not None:
                self.messages.warning(
                    prim.GetPath(),
                    "resetXformStack inside a prototype",
                    "it is placed relative to the instance",
                )
        inherited = UsdGeom.PrimvarsAPI(prim).FindIncrementallyInheritablePrimvars(visit.primvars)
        if inherited:
            visit.primvars = inherited
        visit.is_bound = visit.is_bound or prim.HasAPI(UsdShade.MaterialBindingAPI)
        if prim.IsModel():
            self._report_draw_mode(prim)
        return True

    def _report_draw_mode(self, prim: Usd.Prim) -> None:
        attribute = prim.GetAttribute("model:drawMode")
        if attribute and attribute.HasAuthoredValue() and attribute.Get() not in ("default", "inherited"):
            self.messages.warning(
                prim.GetPath(),
                f"model:drawMode {attribute.Get()} is not supported",
                "the full model is drawn",
            )

    def _draw(self, visit: _Visit, type_name: str, drawables: list[Drawable]) -> None:
        family = FAMILIES.get(type_name)
        if family is None:
            self._report_unsupported(visit.prim, type_name)
            return
        if family != "light":
            if visit.purpose not in self._purposes:
                return
            report_light_apis(visit.prim, self.context(visit.matrix))
        drawables.append(Drawable(visit.prim, family, visit.matrix, visit.varies, visit.primvars))

    def _report_unsupported(self, prim: Usd.Prim, type_name: str) -> None:
        if type_name in _SILENT:
            return
        path = prim.GetPath()
        if type_name in UNSUPPORTED_LIGHTS:
            self.messages.warning(path, f"{type_name} is not supported", UNSUPPORTED_LIGHTS[type_name])
        elif prim.IsA(UsdGeom.Boundable) or "ParticleField" in type_name:
            self.messages.warning(
                path, f"prims of type {type_name} are not supported", "nothing is drawn; use a mesh"
            )
        elif not prim.GetPrimDefinition().GetPropertyNames():
            self.messages.info(path, f"the type {type_name} is not known", "nothing is drawn")

    def context(
        self,
        matrix: Gf.Matrix4d,
        *,
        instancer: str | None = None,
        inherited_primvars: list[Any] | None = None,
    ) -> ReadContext:
        """Return what readers need, for a prim placed by `matrix`."""
        return ReadContext(
            time=self.time,
            messages=self.messages,
            assets=self._assets,
            world_from_object=to_matrix(matrix),
            instancer=instancer,
            inherited_primvars=inherited_primvars or [],
        )

    def _place_prototypes(self, visit: _Visit, group: Group | None) -> list[tuple[Group, _Visit]]:
        """Add the placements of a point instancer to the groups of its prototypes; return the new groups."""
        new = []
        read = read_point_instancer(visit.prim, self.context(visit.matrix), matrix=visit.matrix)
        for root, transforms, chosen in read:
            is_drawn = visit.purpose in self._purposes
            key = ("point", root.GetPath(), is_drawn)
            target = self._group(
                key, root, anchor=root.GetPath().GetParentPath(), suffix="" if is_drawn else "+"
            )
            if group is not None and group.is_within(target):
                self.messages.error(
                    visit.prim.GetPath(), f"<{root.GetPath()}> instances itself", "it is drawn once"
                )
                continue
            if not target.uses:
                start = replace(visit, prim=root, matrix=Gf.Matrix4d(1.0), varies=False, is_bound=True)
                new.append((target, start))
            mover = None
            if visit.varies or varies(visit.prim):
                mover = self._instancer_mover(visit.prim, group, chosen)
            target.uses.setdefault(group, []).append(Use(transforms, mover))
        return new

    def _instancer_mover(self, prim: Usd.Prim, group: Group | None, chosen: Mask) -> Mover:
        def at(time: Usd.TimeCode) -> Matrix:
            return to_matrix(self.matrix_in_group(prim, group, time)) @ transforms_at(
                prim, time, self.time, chosen
            )

        return Mover(at, [prim])

    def _instances_mover(self, visits: list[_Visit], group: Group | None) -> Mover | None:
        """Return where native instances are at other times; ``None`` if they stand still."""
        moving = [visit.prim for visit in visits if visit.varies]
        if not moving:
            return None

        def at(time: Usd.TimeCode) -> Matrix:
            here = (self.matrix_in_group(v.prim, group, time) if v.varies else v.matrix for v in visits)
            return stacked([to_matrix(matrix) for matrix in here])

        return Mover(at, moving)

    def _place_instances(self, instances: list[_Instance], group: Group | None) -> list[tuple[Group, _Visit]]:
        """Add native instances to the groups of their prototypes and looks; return the new groups."""
        new: list[tuple[Group, _Visit]] = []
        visits: dict[Group, list[_Visit]] = {}
        bound = self._inherited_materials(instances)
        for instance, material in zip(instances, bound, strict=True):
            visit = instance.visit
            look = self._look(instance)
            key = ("native", instance.prototype, material, visit.purpose, look)
            target = self._group(key, visit.prim, anchor=visit.prim.GetPath())
            if not target.uses and target not in visits:
                start = replace(visit, matrix=Gf.Matrix4d(1.0), varies=False)
                new.append((target, start))
            visits.setdefault(target, []).append(visit)
        for target, placed in visits.items():
            matrices = stacked([to_matrix(visit.matrix) for visit in placed])
            mover = self._instances_mover(placed, group)
            target.uses.setdefault(group, []).append(Use(matrices, mover))
        return new

    def _group(self, key: object, prim: Usd.Prim, *, anchor: Sdf.Path, suffix: str = "") -> Group:
        """Return the group of `key`, made at its first use and named after `prim`."""
        group = self.groups.get(key)
        if group is None:
            path = str(prim.GetPath()) + suffix
            while path in self._group_paths:
                path += "+"
            self._group_paths.add(path)
            group = self.groups[key] = Group(path, anchor, suffix)
        return group

    def _inherited_materials(self, instances: list[_Instance]) -> list[str]:
        """Return the path of the material that each instance hands down, empty for none."""
        paths = [""] * len(instances)
        chosen = [i for i, instance in enumerate(instances) if instance.visit.is_bound]
        if chosen:
            prims = [instances[i].visit.prim for i in chosen]
            materials, _ = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims, self._material_purpose)
            for i, material in zip(chosen, materials, strict=True):
                paths[i] = str(material.GetPath()) if material else ""
        return paths

    def _look(self, instance: _Instance) -> object:
        """Return a key of the primvars that the instance hands down; the first one's beyond a limit."""
        values = tuple(
            (str(p.GetPrimvarName()), str(p.Get(self.time)))
            for p in instance.visit.primvars
            if str(p.GetPrimvarName()) in self._shader_primvars
        )
        looks = self._looks.setdefault(instance.prototype, {})
        if values not in looks and len(looks) >= _MAX_LOOKS:
            self.messages.warning(
                instance.visit.prim.GetPath(),
                f"more than {_MAX_LOOKS} sets of inherited primvars for one prototype",
                "instances beyond share the first set",
            )
            return next(iter(looks.values()))
        return looks.setdefault(values, values)

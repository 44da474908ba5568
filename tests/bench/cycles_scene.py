"""Builds a benchmark scene in Cycles (`bpy` 5.0) from its JSON description (`volume-scene/1`).

The same description that `mitsuba_scene.py` reads. Cycles' conventions are met here and nowhere else: its
frame (Z up), its lamps (watts, unseen by the camera, no bodies), its bounce limits, and the settings without
which its image would be biased. A process holds one scene, since `bpy` is one global state.
"""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from support import exr

# isort: split
# `bpy` brings these two, and they can be found only once it is there.
import bmesh
from mathutils import Matrix

Dict = dict[str, Any]

# (x, y, z) with Y up becomes (x, -z, y) with Z up: a rotation by a quarter turn about X.
Z_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)
# Index-matched boundaries along a path; they are no scattering events, so there should be no limit.
MAX_BOUNDARIES = 1024
# Cycles begins camera rays this far away (metres); they should begin at the camera, which may be in a medium.
NEAR_CLIP = 1e-6
# A sphere is a mesh of 20 * 4^(this - 1) flat triangles: normals are off by up to 0.7 degrees.
SPHERE_SUBDIVISIONS = 6
# Corners of a box are numbered by bits (x, y, z); sides wind so that their normals point outwards.
BOX_SIDES = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]


def load(path: Path, threads: int) -> None:
    """Make a description the scene of this process, to be rendered on the CPU with so many threads."""
    description = json.loads(path.read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _set_render(description["render"], threads)
    _Builder(description, path.parent).build()


def render(spp: int, seed: int) -> np.ndarray:
    """Return linear Rec.709 radiance (height, width, 3), row 0 on top; includes Cycles' sync of the scene."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed = spp, seed
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = f"{folder}/image.exr"
        bpy.ops.render.render(write_still=True)
        return exr.read_rgb(Path(scene.render.filepath))


def _set_render(wanted: Dict, threads: int) -> None:
    render = bpy.context.scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = wanted["width"], wanted["height"]
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", threads
    render.use_compositing = render.use_sequencer = False
    file = render.image_settings
    file.file_format, file.color_mode, file.color_depth, file.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
    _set_cycles(bpy.context.scene.cycles, wanted["max_scatter"])


def _set_cycles(cycles: Any, max_scatter: int) -> None:
    """Ask for the unbiased image: null scattering, not ray marching; nothing clamped, filtered or culled."""
    cycles.device = "CPU"
    cycles.volume_biased = False
    cycles.use_guiding = False
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_auto_tile = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.pixel_filter_type = "BOX"
    # The direct light of the last event is one more scattering than Cycles counts.
    for kind in ("max", "diffuse", "glossy", "transmission", "volume"):
        setattr(cycles, f"{kind}_bounces", max(max_scatter - 1, 0))
    cycles.transparent_max_bounces = MAX_BOUNDARIES


def _colour(value: float | list[float]) -> tuple[float, float, float, float]:
    red, green, blue = np.broadcast_to(np.asarray(value, float), 3).tolist()
    return red, green, blue, 1.0


def _strength(value: float | list[float]) -> tuple[float, tuple[float, float, float]]:
    """Split a colour of any size into a strength and a colour of at most one."""
    colour = np.broadcast_to(np.asarray(value, float), 3)
    strength = float(colour.max())
    return strength, tuple((colour / strength if strength > 0 else colour).tolist())


def _quad(shape: Dict) -> np.ndarray:
    origin, e1, e2 = (np.array(shape[key], float) for key in ("origin", "e1", "e2"))
    return np.stack([origin, origin + e1, origin + e1 + e2, origin + e2])


def _box(low: list[float], high: list[float]) -> np.ndarray:
    corners = [[(low, high)[corner >> axis & 1][axis] for axis in range(3)] for corner in range(8)]
    return np.array(corners, float)


def _mesh(name: str, points: np.ndarray, faces: Any) -> Any:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(points, float).tolist(), [], np.asarray(faces).tolist())
    return mesh


def _sphere_mesh(center: list[float], radius: float) -> Any:
    mesh, geometry = bpy.data.meshes.new("sphere"), bmesh.new()
    placed = Matrix.Translation(center)
    bmesh.ops.create_icosphere(geometry, subdivisions=SPHERE_SUBDIVISIONS, radius=radius, matrix=placed)
    geometry.to_mesh(mesh)
    geometry.free()
    return mesh


def _new_material(name: str) -> tuple[Any, Any, Any]:
    """Return a material, its tree and its output, with nothing else in it."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def _surface_material(name: str, kind: str, **inputs: Any) -> Any:
    """Return a material with one BSDF of the given node type and inputs."""
    material, tree, output = _new_material(name)
    bsdf = tree.nodes.new(kind)
    for key, value in inputs.items():
        bsdf.inputs[key].default_value = value
    tree.links.new(bsdf.outputs[0], output.inputs["Surface"])
    return material


def _one_sided_emitter(radiance: float | list[float]) -> Any:
    """Return a material that emits on the front and is black behind."""
    material, tree, output = _new_material("quad light")
    strength, colour = _strength(radiance)
    emission, mix = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeMixShader")
    emission.inputs["Color"].default_value = (*colour, 1.0)
    emission.inputs["Strength"].default_value = strength
    side, black = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    black.inputs["Color"].default_value = (0, 0, 0, 1)
    tree.links.new(side.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(black.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    material.cycles.emission_sampling = "FRONT"
    return material


class _Builder:
    def __init__(self, description: Dict, folder: Path) -> None:
        self.description, self.folder = description, folder
        # What Y-up data hangs on: the parent's inverse takes any matrix, `matrix_world` none with shear.
        self.root = bpy.data.objects.new("root", None)
        bpy.context.scene.collection.objects.link(self.root)
        self.materials = {name: self._material(name, m) for name, m in description["materials"].items()}

    def build(self) -> None:
        self._camera()
        for shape in self.description["shapes"]:
            self._shape(shape)
        for volume in self.description.get("volumes", []):
            self._volume(volume)
        bpy.context.scene.world = bpy.data.worlds.new("world")
        bpy.context.scene.world.node_tree.nodes.clear()  # black, unless there is an environment
        for light in self.description["lights"]:
            self._light(light)

    def _place(self, name: str, data: Any, matrix: np.ndarray | None = None) -> Any:
        """Put data in Y-up coordinates into the scene."""
        placed = bpy.data.objects.new(name, data)
        placed.parent = self.root
        placed.matrix_parent_inverse = Matrix((Z_UP @ (np.eye(4) if matrix is None else matrix)).tolist())
        bpy.context.scene.collection.objects.link(placed)
        return placed

    def _place_mesh(self, mesh: Any, material: Any, matrices: Any = (None,)) -> None:
        mesh.materials.append(material)
        for matrix in matrices:
            self._place(mesh.name, mesh, matrix)

    def _camera(self) -> None:
        wanted = self.description["camera"]
        position, target = (np.array(wanted[key], float) for key in ("position", "target"))
        backward = (position - target) / np.linalg.norm(position - target)
        right = np.cross(np.array(wanted.get("up", [0, 1, 0]), float), backward)
        right /= np.linalg.norm(right)
        matrix = np.eye(4)
        matrix[:3] = np.stack([right, np.cross(backward, right), backward, position], axis=1)
        camera = bpy.data.cameras.new("camera")
        camera.sensor_fit = "VERTICAL"
        camera.lens = camera.sensor_height / 2 / math.tan(math.radians(wanted["vfov"]) / 2)
        camera.clip_start, camera.clip_end = NEAR_CLIP, 1e6
        bpy.context.scene.camera = self._place("camera", camera, matrix)

    @staticmethod
    def _material(name: str, material: Dict) -> Any:
        match material["type"]:
            case "diffuse":
                return _surface_material(name, "ShaderNodeBsdfDiffuse", Color=_colour(material["color"]))
            case "glass":
                inputs = {"Color": _colour(1.0), "Roughness": 0.0, "IOR": material["ior"]}
                return _surface_material(name, "ShaderNodeBsdfGlass", **inputs)
            case other:
                raise ValueError(f"material type {other!r}; known: diffuse, glass")

    def _shape(self, shape: Dict) -> None:
        material = self.materials[shape["material"]]
        match shape["type"]:
            case "quad":
                self._place_mesh(_mesh("quad", _quad(shape), [[0, 1, 2, 3]]), material)
            case "box":
                self._place_mesh(_mesh("box", _box(shape["min"], shape["max"]), BOX_SIDES), material)
            case "sphere":
                self._place_mesh(_sphere_mesh(shape["center"], shape["radius"]), material)
            case "mesh":
                self._place_mesh(self._mesh_of(shape), material)
            case "instances":
                rows = np.array(shape["transforms"], float).reshape(-1, 3, 4)
                matrices = [np.vstack([matrix, [0, 0, 0, 1]]) for matrix in rows]
                self._place_mesh(self._mesh_of(shape), material, matrices)
            case other:
                raise ValueError(f"shape type {other!r}; known: quad, box, sphere, mesh, instances")

    def _mesh_of(self, shape: Dict) -> Any:
        data = self.description["meshes"][shape["mesh"]]
        return _mesh(shape["mesh"], data["points"], data["triangles"])

    def _volume(self, volume: Dict) -> None:
        shape = volume["shape"]
        medium = self._medium(volume)
        match shape["type"]:
            case "box":
                self._place_mesh(_mesh("medium", _box(shape["min"], shape["max"]), BOX_SIDES), medium)
            case "sphere":
                self._place_mesh(_sphere_mesh(shape["center"], shape["radius"]), medium)
            case "grid":
                self._place_grid(self.folder / volume["grid"]["vdb"], medium)
            case other:
                raise ValueError(f"volume shape {other!r}; known: box, sphere, grid")

    def _place_grid(self, file: Path, medium: Any) -> None:
        """Load a VDB; by default Cycles would store half floats and drop densities below 0.001."""
        grid = bpy.data.volumes.new("grid")
        grid.filepath = str(file.resolve())
        grid.render.precision, grid.render.clipping = "FULL", 0.0
        grid.materials.append(medium)
        self._place("grid", grid)

    def _medium(self, volume: Dict) -> Any:
        """Return a material with coefficients per metre, on grids times their density."""
        medium = self.description["media"][volume["medium"]]
        sigma_t, albedo = (np.array(_colour(medium[key])[:3]) for key in ("sigma_t", "albedo"))
        material, tree, output = _new_material(volume["medium"])
        node = tree.nodes.new("ShaderNodeVolumeCoefficients")
        node.phase = "HENYEY_GREENSTEIN"
        node.inputs["Anisotropy"].default_value = medium["g"]
        coefficients = {"Absorption": sigma_t * (1 - albedo), "Scatter": sigma_t * albedo}
        for kind, value in coefficients.items():
            target = node.inputs[f"{kind} Coefficients"]
            if volume["shape"]["type"] == "grid":
                self._scale_by_density(tree, value, target)
            else:
                target.default_value = value.tolist()
        tree.links.new(node.outputs[0], output.inputs["Volume"])
        return material

    @staticmethod
    def _scale_by_density(tree: Any, coefficients: np.ndarray, target: Any) -> None:
        density, scale = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeVectorMath")
        density.attribute_name = "density"
        scale.operation = "SCALE"
        scale.inputs["Vector"].default_value = coefficients.tolist()
        tree.links.new(density.outputs["Fac"], scale.inputs["Scale"])
        tree.links.new(scale.outputs[0], target)

    def _light(self, light: Dict) -> None:
        match light["type"]:
            case "quad":
                emitter = _one_sided_emitter(light["radiance"])
                self._place_mesh(_mesh("quad light", _quad(light), [[0, 1, 2, 3]]), emitter)
            case "sphere":
                # Power of a sphere: radiance times pi times its area.
                power = 4 * math.pi**2 * light["radius"] ** 2
                self._point_lamp(light["center"], light["radius"], power, light["radiance"])
                black = _surface_material("black", "ShaderNodeBsdfDiffuse", Color=_colour(0.0))
                self._place_mesh(_sphere_mesh(light["center"], 0.999 * light["radius"]), black)
            case "point":
                self._point_lamp(light["position"], 0.0, 4 * math.pi, light["intensity"])
            case "distant":
                self._sun(light)
            case "env":
                self._environment(light)
            case other:
                raise ValueError(f"light type {other!r}; known: quad, sphere, point, distant, env")

    def _point_lamp(self, position: list[float], radius: float, watts: float, colour: Any) -> None:
        """Place a lamp of `watts` times `colour`; Cycles' own would be unseen by the camera."""
        lamp = bpy.data.lights.new("lamp", "POINT")
        strength, lamp.color = _strength(colour)
        lamp.energy, lamp.shadow_soft_size, lamp.use_soft_falloff = watts * strength, radius, False
        matrix = np.eye(4)
        matrix[:3, 3] = position
        self._place("lamp", lamp, matrix).visible_camera = True

    def _sun(self, light: Dict) -> None:
        """Place a sun without size; its strength is the irradiance, it shines along its own -Z."""
        sun = bpy.data.lights.new("sun", "SUN")
        sun.energy, sun.color = _strength(light["irradiance"])
        sun.angle = 0.0
        backward = -np.array(light["direction"], float) / np.linalg.norm(light["direction"])
        right = np.cross(np.eye(3)[np.abs(backward).argmin()], backward)
        right /= np.linalg.norm(right)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([right, np.cross(backward, right), backward], axis=1)
        self._place("sun", sun, matrix)

    def _environment(self, light: Dict) -> None:
        tree = bpy.context.scene.world.node_tree
        background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
        tree.links.new(background.outputs[0], output.inputs["Surface"])
        if "image" not in light:
            strength, colour = _strength(light["radiance"])
            background.inputs["Color"].default_value = (*colour, 1.0)
            background.inputs["Strength"].default_value = strength
            return
        background.inputs["Strength"].default_value = light.get("scale", 1.0)
        sky, turn = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
        sky.image = bpy.data.images.load(str((self.folder / light["image"]).resolve()))
        sky.image.colorspace_settings.name = "Linear Rec.709"
        # The image's middle is our +Z, Blender's -Y; in Blender's own orientation that is a quarter turn off.
        turn.inputs["Rotation"].default_value = (0, 0, math.pi / 2)
        direction = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        tree.links.new(direction, turn.inputs["Vector"])
        tree.links.new(turn.outputs[0], sky.inputs["Vector"])
        tree.links.new(sky.outputs[0], background.inputs["Color"])

"""Builds a benchmark scene in Mitsuba 3 from its JSON description (`volume-scene/1`).

The description is renderer neutral: quads, boxes, spheres, meshes and instances with Lambert or glass; media
in boxes, spheres or grids; quad, sphere, point, distant and environment lights. Mitsuba's own conventions are
met here and nowhere else.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

Dict = dict[str, Any]


def load(path: Path) -> tuple[Any, Dict]:
    """Return the Mitsuba scene of a description and the description."""
    description = json.loads(path.read_text(encoding="utf-8"))
    return mi.load_dict(_Builder(description, path.parent).scene()), description


def rgb(value: float | list[float]) -> Dict:
    """Return a linear colour."""
    return {"type": "rgb", "value": [float(value)] * 3 if isinstance(value, (int, float)) else value}


def _transform(columns: np.ndarray) -> Any:
    return mi.ScalarTransform4f(columns.tolist())


def _onto(origin: np.ndarray, e1: np.ndarray, e2: np.ndarray) -> Any:
    """Map Mitsuba's rectangle [-1, 1]^2 (normal +z) onto the parallelogram, normal e1 x e2."""
    normal = np.cross(e1, e2)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1] = e1 / 2, e2 / 2
    matrix[:3, 2] = normal / np.linalg.norm(normal)
    matrix[:3, 3] = origin + (e1 + e2) / 2
    return _transform(matrix)


def _box(low: np.ndarray, high: np.ndarray) -> Any:
    matrix = np.diag([*(high - low) / 2, 1.0])
    matrix[:3, 3] = (low + high) / 2
    return _transform(matrix)


class _Builder:
    def __init__(self, description: Dict, folder: Path) -> None:
        self.description, self.folder = description, folder
        self.bsdfs = {name: self._bsdf(m) for name, m in description["materials"].items()}

    def scene(self) -> Dict:
        parts: Dict = {"type": "scene", "integrator": self._integrator(), "sensor": self._sensor()}
        for i, shape in enumerate(self.description["shapes"]):
            parts[f"shape{i}"] = self._shape(shape)
        for i, volume in enumerate(self.description.get("volumes", [])):
            parts[f"volume{i}"] = self._volume(volume)
        for i, light in enumerate(self.description["lights"]):
            parts[f"light{i}"] = self._light(light)
        return parts

    def _integrator(self) -> Dict:
        media = self.description.get("media", {}).values()
        coloured = any(len(set(np.atleast_1d(medium["sigma_t"]))) > 1 for medium in media)
        depth = self.description["render"]["max_scatter"] + 1
        return {"type": "volpathmis" if coloured else "volpath", "max_depth": depth}

    def _sensor(self) -> Dict:
        camera, render = self.description["camera"], self.description["render"]
        sensor: Dict = {
            "type": "perspective",
            "fov": camera["vfov"],
            "fov_axis": "y",
            "near_clip": 1e-3,
            "far_clip": 1e6,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=camera["position"], target=camera["target"], up=camera.get("up", [0, 1, 0])
            ),
            "sampler": {"type": "independent"},
            "film": {
                "type": "hdrfilm",
                "width": render["width"],
                "height": render["height"],
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
        }
        for volume in self.description.get("volumes", []):
            if volume.get("contains_camera"):
                sensor["medium"] = {**self._medium(volume), "id": self._medium_id(volume)}
        return sensor

    @staticmethod
    def _bsdf(material: Dict) -> Dict:
        match material["type"]:
            case "diffuse":
                return {
                    "type": "twosided",
                    "bsdf": {"type": "diffuse", "reflectance": rgb(material["color"])},
                }
            case "glass":
                return {"type": "dielectric", "int_ior": material["ior"], "ext_ior": 1.0}
            case other:
                raise ValueError(f"material type {other!r}; known: diffuse, glass")

    def _mesh(self, name: str, bsdf: Dict, placements: list[np.ndarray]) -> Any:
        """Return all placements as one mesh: with hundreds of instances Mitsuba compiles for minutes."""
        data = self.description["meshes"][name]
        points, triangles = np.array(data["points"], np.float64), np.array(data["triangles"], np.uint32)
        placed = np.concatenate([points @ m[:3, :3].T + m[:3, 3] for m in placements])
        copies = np.concatenate([triangles + i * len(points) for i in range(len(placements))])
        properties = mi.Properties()
        properties["mesh_bsdf"] = mi.load_dict(bsdf)
        mesh = mi.Mesh(name, len(placed), len(copies), has_vertex_normals=False, props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = placed.astype(np.float32).ravel()
        parameters["faces"] = copies.astype(np.uint32).ravel()
        parameters.update()
        return mesh

    def _shape(self, shape: Dict) -> Any:
        bsdf = self.bsdfs[shape["material"]]
        match shape["type"]:
            case "quad":
                sides = (np.array(shape[key], float) for key in ("origin", "e1", "e2"))
                return {"type": "rectangle", "to_world": _onto(*sides), "bsdf": bsdf}
            case "box":
                corners = (np.array(shape[key], float) for key in ("min", "max"))
                return {"type": "cube", "to_world": _box(*corners), "bsdf": bsdf}
            case "sphere":
                return {**self._sphere(shape), "bsdf": bsdf}
            case "mesh":
                return self._mesh(shape["mesh"], bsdf, [np.eye(4)])
            case "instances":
                rows = np.array(shape["transforms"], float).reshape(-1, 3, 4)
                return self._mesh(shape["mesh"], bsdf, list(rows))
            case other:
                raise ValueError(f"shape type {other!r}; known: quad, box, sphere, mesh, instances")

    @staticmethod
    def _sphere(shape: Dict) -> Dict:
        return {"type": "sphere", "center": shape["center"], "radius": shape["radius"]}

    def _medium_id(self, volume: Dict) -> str:
        return f"medium_{volume['medium']}"

    def _medium(self, volume: Dict) -> Dict:
        medium = self.description["media"][volume["medium"]]
        phase = {"type": "hg", "g": medium["g"]}
        sigma_t = np.atleast_1d(np.array(medium["sigma_t"], float))
        scale = float(sigma_t.max())  # an extinction above 1 is refused, a scale is not
        if volume["shape"]["type"] != "grid":
            extinction = (sigma_t / scale).tolist()
            return {
                "type": "homogeneous",
                "sigma_t": rgb(extinction if len(extinction) == 3 else extinction[0]),
                "albedo": rgb(medium["albedo"]),
                "scale": scale,
                "phase": phase,
            }
        grid = volume["grid"]
        data = self._grid_values(grid)
        extent = np.array(data.shape) * grid["voxel"]
        matrix = np.diag([*extent, 1.0])
        matrix[:3, 3] = grid["bmin"]
        return {
            "type": "heterogeneous",
            "sigma_t": {
                "type": "gridvolume",
                "grid": mi.VolumeGrid(np.ascontiguousarray(data.transpose(2, 1, 0)[..., None], np.float32)),
                "to_world": _transform(matrix),
                "raw": True,
            },
            "albedo": {"type": "constvolume", "value": rgb(medium["albedo"])},
            "scale": scale,
            "phase": phase,
        }

    def _grid_values(self, grid: Dict) -> np.ndarray:
        """Return the samples along x, y, z."""
        with np.load(self.folder / grid["npz"]) as file:
            return np.array(file[file.files[0]], np.float32)

    def _volume(self, volume: Dict) -> Dict:
        shape = volume["shape"]
        known = volume.get("contains_camera")
        medium = {"type": "ref", "id": self._medium_id(volume)} if known else self._medium(volume)
        inside: Dict = {"interior": medium, "bsdf": {"type": "null"}}
        match shape["type"]:
            case "box":
                low, high = (np.array(shape[key], float) for key in ("min", "max"))
                return {"type": "cube", "to_world": _box(low, high), **inside}
            case "sphere":
                return {**self._sphere(shape), **inside}
            case "grid":
                low = np.array(volume["grid"]["bmin"], float)
                extent = np.array(self._grid_values(volume["grid"]).shape) * volume["grid"]["voxel"]
                return {"type": "cube", "to_world": _box(low, low + extent), **inside}
            case other:
                raise ValueError(f"volume shape {other!r}; known: box, sphere, grid")

    def _light(self, light: Dict) -> Dict:
        match light["type"]:
            case "quad":
                sides = (np.array(light[key], float) for key in ("origin", "e1", "e2"))
                emitter = {"type": "area", "radiance": rgb(light["radiance"])}
                black = {"type": "diffuse", "reflectance": rgb(0.0)}
                return {"type": "rectangle", "to_world": _onto(*sides), "emitter": emitter, "bsdf": black}
            case "sphere":
                emitter = {"type": "area", "radiance": rgb(light["radiance"])}
                black = {"type": "diffuse", "reflectance": rgb(0.0)}
                return {**self._sphere(light), "emitter": emitter, "bsdf": black}
            case "point":
                return {"type": "point", "position": light["position"], "intensity": rgb(light["intensity"])}
            case "distant":
                irradiance = rgb(light["irradiance"])
                return {"type": "directional", "direction": light["direction"], "irradiance": irradiance}
            case "env" if "image" in light:
                return {"type": "envmap", "bitmap": self._sky(light), "scale": light.get("scale", 1.0)}
            case "env":
                return {"type": "constant", "radiance": rgb(light["radiance"])}
            case other:
                raise ValueError(f"light type {other!r}; known: quad, sphere, point, distant, env")

    def _sky(self, light: Dict) -> Any:
        """Resample a lat-long image with rows centred at (j + .5) / H to rows that include both poles."""
        image = np.array(mi.Bitmap(str(self.folder / light["image"])).convert(mi.Bitmap.PixelFormat.RGB))
        height = len(image)
        rows = np.linspace(0, 1, 4 * height + 1) * height - 0.5
        below = np.clip(np.floor(rows).astype(int), 0, height - 1)
        above = np.clip(below + 1, 0, height - 1)
        weight = np.clip(rows - below, 0, 1)[:, None, None]
        return mi.Bitmap((image[below] * (1 - weight) + image[above] * weight).astype(np.float32))

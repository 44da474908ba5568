"""Building small USD stages: a few calls describe a physical set-up with a known answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, UsdVol

if TYPE_CHECKING:
    from pathlib import Path

Vector = Sequence[float]
Color = float | Sequence[float]


def _color(value: Color) -> Gf.Vec3f:
    return Gf.Vec3f(*([float(value)] * 3 if isinstance(value, (int, float)) else map(float, value)))


def look_at(position: Vector, target: Vector, up: Vector = (0, 1, 0)) -> Gf.Matrix4d:
    """Return the row-vector matrix of a camera or light at `position` with -z towards `target`."""
    position_, target_ = np.asarray(position, float), np.asarray(target, float)
    back = position_ - target_
    back /= np.linalg.norm(back)
    up_ = np.asarray(up, float)
    if np.linalg.norm(np.cross(up_, back)) < 1e-6:
        up_ = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    right = np.cross(up_, back)
    right /= np.linalg.norm(right)
    rows = [[*right, 0], [*np.cross(back, right), 0], [*back, 0], [*position_, 1]]
    return Gf.Matrix4d([[float(x) for x in row] for row in rows])


def max_scatter(path: Path) -> int:
    """Return how often light may scatter in a stage, as the makers of the shared scenes wrote down."""
    stage = Usd.Stage.Open(str(path))
    return int(stage.GetPrimAtPath("/Render/Settings").GetAttribute("volumeScene:maxScatter").Get())


class StageBuilder:
    """A stage under construction; each method adds one thing and returns its prim path."""

    def __init__(self, width: int = 8, height: int = 8, *, up_axis: str = "Y") -> None:
        self.stage = Usd.Stage.CreateInMemory()
        UsdGeom.SetStageUpAxis(self.stage, up_axis)
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        self.stage.SetDefaultPrim(UsdGeom.Xform.Define(self.stage, "/World").GetPrim())
        self.width, self.height = width, height
        self._count = 0

    def save(self, path: Path) -> Path:
        """Write the stage and return `path`."""
        self.stage.GetRootLayer().Export(str(path))
        return path

    def _path(self, kind: str) -> str:
        self._count += 1
        return f"/World/{kind}{self._count}"

    def _bind(self, prim: Usd.Prim, material: str | None) -> None:
        if material is not None:
            bound = UsdShade.Material(self.stage.GetPrimAtPath(material))
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(bound)

    def camera(
        self,
        position: Vector,
        target: Vector,
        *,
        vfov: float = 40.0,
        up: Vector = (0, 1, 0),
        orthographic_height: float | None = None,
        clip: tuple[float, float] | None = None,
    ) -> None:
        """Add the camera and render settings that use it; `vfov` in degrees over the image height."""
        camera = UsdGeom.Camera.Define(self.stage, "/World/Camera")
        camera.MakeMatrixXform().Set(look_at(position, target, up))
        distance = math.dist(position, target)
        camera.CreateClippingRangeAttr(Gf.Vec2f(*(clip or (distance * 1e-6, distance * 1e6))))
        aspect = self.width / self.height
        if orthographic_height is None:
            focal = 50.0
            aperture = 2 * focal * math.tan(math.radians(vfov) / 2)
            camera.CreateFocalLengthAttr(focal)
        else:
            camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
            aperture = orthographic_height * 10  # apertures are tenths of a stage unit
        camera.CreateVerticalApertureAttr(aperture)
        camera.CreateHorizontalApertureAttr(aperture * aspect)
        camera.CreateFStopAttr(0.0)
        settings = UsdRender.Settings.Define(self.stage, "/Render/Settings")
        settings.CreateResolutionAttr(Gf.Vec2i(self.width, self.height))
        settings.CreateCameraRel().SetTargets([camera.GetPath()])
        self.stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")

    # Materials

    def _shader(self, material: str, name: str, identifier: str) -> UsdShade.Shader:
        shader = UsdShade.Shader.Define(self.stage, f"{material}/{name}")
        shader.CreateIdAttr(identifier)
        return shader

    def lambert(self, color: Color, emission: Color = 0.0) -> str:
        """Add a two-sided Lambert surface of this albedo, emitting so much radiance."""
        path = self._path("Lambert")
        material = UsdShade.Material.Define(self.stage, path)
        surface = self._shader(path, "preview", "UsdPreviewSurface")
        for name, kind, value in (
            ("diffuseColor", Sdf.ValueTypeNames.Color3f, _color(color)),
            ("emissiveColor", Sdf.ValueTypeNames.Color3f, _color(emission)),
            ("useSpecularWorkflow", Sdf.ValueTypeNames.Int, 1),
            ("specularColor", Sdf.ValueTypeNames.Color3f, _color(0)),
            ("ior", Sdf.ValueTypeNames.Float, 1.0),
            ("roughness", Sdf.ValueTypeNames.Float, 1.0),
        ):
            surface.CreateInput(name, kind).Set(value)
        output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(output)
        return path

    def glass(self, ior: float = 1.5) -> str:
        """Add a smooth colourless dielectric."""
        path = self._path("Glass")
        material = UsdShade.Material.Define(self.stage, path)
        bsdf = self._shader(path, "bsdf", "ND_dielectric_bsdf")
        bsdf.CreateInput("ior", Sdf.ValueTypeNames.Float).Set(ior)
        bsdf.CreateInput("roughness", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(0, 0))
        bsdf.CreateInput("scatter_mode", Sdf.ValueTypeNames.String).Set("RT")
        surface = self._shader(path, "surface", "ND_surface")
        bsdf_out = bsdf.CreateOutput("out", Sdf.ValueTypeNames.Token)
        surface.CreateInput("bsdf", Sdf.ValueTypeNames.Token).ConnectToSource(bsdf_out)
        output = surface.CreateOutput("out", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput("mtlx").ConnectToSource(output)
        return path

    def medium(
        self,
        sigma_t: Color,
        albedo: Color,
        g: float = 0.0,
        *,
        emission: Color | None = None,
        field: str | None = None,
    ) -> str:
        """Add a medium, per stage unit; extinction and emission times a density field if `field` is given."""
        path = self._path("Medium")
        material = UsdShade.Material.Define(self.stage, path)
        extinction, share = np.array(_color(sigma_t), float), np.array(_color(albedo), float)
        vdf = self._shader(path, "vdf", "ND_anisotropic_vdf")
        density = None
        if field is not None:
            reader = self._shader(path, "density", "ND_geompropvalue_float")
            reader.CreateInput("geomprop", Sdf.ValueTypeNames.String).Set(field)
            reader.CreateInput("default", Sdf.ValueTypeNames.Float).Set(0.0)
            density = reader.CreateOutput("out", Sdf.ValueTypeNames.Float)
        for name, value in (("absorption", extinction * (1 - share)), ("scattering", extinction * share)):
            coefficient = vdf.CreateInput(name, Sdf.ValueTypeNames.Float3)
            self._set_scaled(path, coefficient, name, value, density)
        vdf.CreateInput("anisotropy", Sdf.ValueTypeNames.Float).Set(g)
        volume = self._shader(path, "volume", "ND_volume")
        vdf_out = vdf.CreateOutput("out", Sdf.ValueTypeNames.Token)
        volume.CreateInput("vdf", Sdf.ValueTypeNames.Token).ConnectToSource(vdf_out)
        if emission is not None:
            edf = self._shader(path, "edf", "ND_uniform_edf")
            color = edf.CreateInput("color", Sdf.ValueTypeNames.Color3f)
            self._set_scaled(path, color, "emission", np.array(_color(emission), float), density)
            edf_out = edf.CreateOutput("out", Sdf.ValueTypeNames.Token)
            volume.CreateInput("edf", Sdf.ValueTypeNames.Token).ConnectToSource(edf_out)
        output = volume.CreateOutput("out", Sdf.ValueTypeNames.Token)
        material.CreateVolumeOutput().ConnectToSource(output)
        material.CreateVolumeOutput("mtlx").ConnectToSource(output)
        return path

    def _set_scaled(
        self,
        material: str,
        target: UsdShade.Input,
        name: str,
        value: np.ndarray,
        density: UsdShade.Output | None,
    ) -> None:
        constant = Gf.Vec3f(*map(float, value))
        if density is None:
            target.Set(constant)
            return
        kind = target.GetTypeName()
        suffix = "color3FA" if kind == Sdf.ValueTypeNames.Color3f else "vector3FA"
        product = self._shader(material, name, f"ND_multiply_{suffix}")
        product.CreateInput("in1", kind).Set(constant)
        product.CreateInput("in2", Sdf.ValueTypeNames.Float).ConnectToSource(density)
        target.ConnectToSource(product.CreateOutput("out", kind))

    # Geometry

    def box(self, low: Vector, high: Vector, material: str | None) -> str:
        """Add an axis-aligned box."""
        cube = UsdGeom.Cube.Define(self.stage, self._path("Box"))
        cube.CreateSizeAttr(1.0)
        low_, high_ = np.asarray(low, float), np.asarray(high, float)
        size, center = high_ - low_, (low_ + high_) / 2
        matrix = Gf.Matrix4d(1).SetScale(Gf.Vec3d(*size)) * Gf.Matrix4d(1).SetTranslate(Gf.Vec3d(*center))
        cube.AddTransformOp().Set(matrix)
        self._bind(cube.GetPrim(), material)
        return str(cube.GetPath())

    def sphere(self, center: Vector, radius: float, material: str | None) -> str:
        """Add a sphere."""
        sphere = UsdGeom.Sphere.Define(self.stage, self._path("Sphere"))
        sphere.CreateRadiusAttr(radius)
        sphere.AddTranslateOp().Set(Gf.Vec3d(*center))
        self._bind(sphere.GetPrim(), material)
        return str(sphere.GetPath())

    def quad(self, origin: Vector, e1: Vector, e2: Vector, material: str | None) -> str:
        """Add a parallelogram, normal e1 x e2."""
        o, a, b = (np.asarray(v, float) for v in (origin, e1, e2))
        return self.mesh([o, o + a, o + a + b, o + b], [4], [0, 1, 2, 3], material)

    def mesh(
        self,
        points: Sequence[Vector],
        counts: Sequence[int],
        indices: Sequence[int],
        material: str | None,
    ) -> str:
        """Add a polygon mesh."""
        mesh = UsdGeom.Mesh.Define(self.stage, self._path("Mesh"))
        mesh.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
        mesh.CreateFaceVertexCountsAttr(list(counts))
        mesh.CreateFaceVertexIndicesAttr(list(indices))
        mesh.CreateSubdivisionSchemeAttr("none")
        self._bind(mesh.GetPrim(), material)
        return str(mesh.GetPath())

    def volume(
        self, vdb: Path | str, material: str, *, field: str = "density", grid: str | None = None
    ) -> str:
        """Add a volume filled from a grid of an OpenVDB file."""
        volume = UsdVol.Volume.Define(self.stage, self._path("Volume"))
        asset = UsdVol.OpenVDBAsset.Define(self.stage, f"{volume.GetPath()}/{field}")
        asset.CreateFilePathAttr(Sdf.AssetPath(str(vdb)))
        asset.CreateFieldNameAttr(grid or field)
        volume.CreateFieldRelationship(field, asset.GetPath())
        self._bind(volume.GetPrim(), material)
        return str(volume.GetPath())

    # Lights

    def _light(
        self, light: UsdLux.LightAPI, intensity: float, color: Color, *, normalize: bool, exposure: float
    ) -> str:
        light.CreateIntensityAttr(float(intensity))
        light.CreateColorAttr(_color(color))
        light.CreateExposureAttr(exposure)
        light.CreateNormalizeAttr(normalize)
        return str(light.GetPath())

    def dome(self, radiance: Color = 1.0, texture: Path | None = None) -> str:
        """Add light from everywhere."""
        dome = UsdLux.DomeLight.Define(self.stage, self._path("Dome"))
        if texture is not None:
            dome.CreateTextureFileAttr(Sdf.AssetPath(str(texture)))
            dome.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
        return self._light(dome, 1.0, radiance, normalize=False, exposure=0.0)

    def distant(
        self,
        direction: Vector,
        intensity: float,
        *,
        angle: float = 0.0,
        normalize: bool = True,
        color: Color = 1.0,
        exposure: float = 0.0,
    ) -> str:
        """Add parallel light travelling along `direction`."""
        light = UsdLux.DistantLight.Define(self.stage, self._path("Distant"))
        light.AddTransformOp().Set(look_at((0, 0, 0), direction))
        light.CreateAngleAttr(angle)
        return self._light(light, intensity, color, normalize=normalize, exposure=exposure)

    def point(self, position: Vector, intensity: float) -> str:
        """Add a point light of this radiant intensity in W/sr."""
        light = UsdLux.SphereLight.Define(self.stage, self._path("Point"))
        light.AddTranslateOp().Set(Gf.Vec3d(*position))
        light.CreateTreatAsPointAttr(True)
        return self._light(light, 4 * intensity, 1.0, normalize=True, exposure=0.0)

    def sphere_light(
        self,
        center: Vector,
        radius: float,
        intensity: float,
        *,
        normalize: bool = False,
        color: Color = 1.0,
        exposure: float = 0.0,
    ) -> str:
        """Add a spherical light."""
        light = UsdLux.SphereLight.Define(self.stage, self._path("SphereLight"))
        light.AddTranslateOp().Set(Gf.Vec3d(*center))
        light.CreateRadiusAttr(radius)
        return self._light(light, intensity, color, normalize=normalize, exposure=exposure)

    def rect_light(
        self,
        position: Vector,
        target: Vector,
        width: float,
        height: float,
        intensity: float,
        *,
        normalize: bool = False,
        scale: float = 1.0,
        color: Color = 1.0,
        exposure: float = 0.0,
    ) -> str:
        """Add a rectangle facing `target`; `scale` goes into its transform."""
        light = UsdLux.RectLight.Define(self.stage, self._path("RectLight"))
        light.AddTransformOp().Set(Gf.Matrix4d(1).SetScale(scale) * look_at(position, target))
        light.CreateWidthAttr(width)
        light.CreateHeightAttr(height)
        return self._light(light, intensity, color, normalize=normalize, exposure=exposure)

    def disk_light(
        self,
        position: Vector,
        target: Vector,
        radius: float,
        intensity: float,
        *,
        normalize: bool = False,
    ) -> str:
        """Add a disk facing `target`."""
        light = UsdLux.DiskLight.Define(self.stage, self._path("DiskLight"))
        light.AddTransformOp().Set(look_at(position, target))
        light.CreateRadiusAttr(radius)
        return self._light(light, intensity, 1.0, normalize=normalize, exposure=0.0)

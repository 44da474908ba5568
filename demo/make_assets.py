"""Makes the demo: a cloud as .vdb, and a USD stage with it, a ground, a few objects, a low sun and a sky.

Usage: ``make_assets.py --out FOLDER --images FOLDER``; the stage's render products name the two images.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import clouds
import numpy as np
import tyndall
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, UsdVol

RESOLUTION = (640, 360)
MAX_BOUNCES = 24
# The cloud: a small one near by rather than a large one far away; extinction in 1/m at density 1.
VOXELS = (176, 104, 136)
VOXEL = 0.05
CLOUD_CENTER = (0.2, 3.55, -0.5)
EXTINCTION = 7.0
ALBEDO = 0.995
ANISOTROPY = 0.6


def material(stage: Usd.Stage, name: str, **inputs: tuple[Sdf.ValueTypeName, object]) -> UsdShade.Material:
    """Add a UsdPreviewSurface material."""
    path = f"/Demo/Looks/{name}"
    look = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/preview")
    shader.CreateIdAttr("UsdPreviewSurface")
    for key, (kind, value) in inputs.items():
        shader.CreateInput(key, kind).Set(value)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    look.CreateSurfaceOutput().ConnectToSource(surface)
    return look


def color(*rgb: float) -> tuple[Sdf.ValueTypeName, Gf.Vec3f]:
    """Return a colour input."""
    return Sdf.ValueTypeNames.Color3f, Gf.Vec3f(*rgb)


def number(value: float) -> tuple[Sdf.ValueTypeName, float]:
    """Return a float input."""
    return Sdf.ValueTypeNames.Float, value


def cloud_material(stage: Usd.Stage) -> UsdShade.Material:
    """Add the medium of the cloud: MaterialX's ND_volume, coefficients times the field `density`."""
    path = "/Demo/Looks/cloud"
    look = UsdShade.Material.Define(stage, path)

    def shader(name: str, identifier: str) -> UsdShade.Shader:
        node = UsdShade.Shader.Define(stage, f"{path}/{name}")
        node.CreateIdAttr(identifier)
        return node

    reader = shader("density", "ND_geompropvalue_float")
    reader.CreateInput("geomprop", Sdf.ValueTypeNames.String).Set("density")
    density = reader.CreateOutput("out", Sdf.ValueTypeNames.Float)
    vdf = shader("vdf", "ND_anisotropic_vdf")
    vdf.CreateInput("anisotropy", Sdf.ValueTypeNames.Float).Set(ANISOTROPY)
    for name, share in (("absorption", 1 - ALBEDO), ("scattering", ALBEDO)):
        product = shader(name, "ND_multiply_vector3FA")
        product.CreateInput("in1", Sdf.ValueTypeNames.Float3).Set(Gf.Vec3f(EXTINCTION * share))
        product.CreateInput("in2", Sdf.ValueTypeNames.Float).ConnectToSource(density)
        scaled = product.CreateOutput("out", Sdf.ValueTypeNames.Float3)
        vdf.CreateInput(name, Sdf.ValueTypeNames.Float3).ConnectToSource(scaled)
    volume = shader("volume", "ND_volume")
    vdf_out = vdf.CreateOutput("out", Sdf.ValueTypeNames.Token)
    volume.CreateInput("vdf", Sdf.ValueTypeNames.Token).ConnectToSource(vdf_out)
    out = volume.CreateOutput("out", Sdf.ValueTypeNames.Token)
    look.CreateVolumeOutput().ConnectToSource(out)
    look.CreateVolumeOutput("mtlx").ConnectToSource(out)
    return look


def bind(prim: Usd.Prim, look: UsdShade.Material) -> None:
    """Bind a material."""
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(look)


def add_cloud(stage: Usd.Stage, folder: Path) -> None:
    """Write the grid and add the volume that shows it."""
    values = clouds.cumulus(VOXELS, VOXEL, seed=11)
    corner = np.array(CLOUD_CENTER) - np.array(VOXELS) * VOXEL / 2
    x, y, z = (float(c) for c in corner + VOXEL / 2)
    tyndall.write_vdb(str(folder / "cloud.vdb"), "density", values, VOXEL, (x, y, z))
    volume = UsdVol.Volume.Define(stage, "/Demo/Cloud")
    field = UsdVol.OpenVDBAsset.Define(stage, "/Demo/Cloud/density")
    field.CreateFilePathAttr(Sdf.AssetPath("./cloud.vdb"))
    field.CreateFieldNameAttr("density")
    volume.CreateFieldRelationship("density", field.GetPath())
    bind(volume.GetPrim(), cloud_material(stage))


def add_objects(stage: Usd.Stage) -> None:
    """Add the ground and what stands on it."""
    ground = UsdGeom.Mesh.Define(stage, "/Demo/Ground")
    half = 400.0
    ground.CreatePointsAttr([(-half, 0, half), (half, 0, half), (half, 0, -half), (-half, 0, -half)])
    ground.CreateFaceVertexCountsAttr([4])
    ground.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    ground.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    bind(
        ground.GetPrim(),
        material(stage, "ground", diffuseColor=color(0.30, 0.27, 0.17), roughness=number(0.9)),
    )

    gold = material(
        stage, "gold", diffuseColor=color(1.0, 0.71, 0.29), metallic=number(1.0), roughness=number(0.3)
    )
    clay = material(stage, "clay", diffuseColor=color(0.62, 0.16, 0.09), roughness=number(0.6))
    chalk = material(stage, "chalk", diffuseColor=color(0.78, 0.77, 0.74), roughness=number(0.8))
    glass = material(
        stage,
        "glass",
        diffuseColor=color(1.0, 1.0, 1.0),
        opacity=number(0.0),
        roughness=number(0.0),
        ior=number(1.5),
    )
    for name, center, radius, look in (
        ("Gold", (2.35, 0.62, 3.3), 0.62, gold),
        ("Glass", (1.05, 0.40, 4.35), 0.40, glass),
        ("Pebble", (-0.55, 0.17, 4.7), 0.17, clay),
    ):
        sphere = UsdGeom.Sphere.Define(stage, f"/Demo/{name}")
        sphere.CreateRadiusAttr(radius)
        sphere.AddTranslateOp().Set(Gf.Vec3d(*center))
        bind(sphere.GetPrim(), look)
    for i, (x, z, height, turn, look) in enumerate(
        ((-3.3, 2.3, 1.9, 24, chalk), (-2.55, 3.1, 1.15, -12, chalk), (-3.75, 3.4, 0.6, 40, clay))
    ):
        cube = UsdGeom.Cube.Define(stage, f"/Demo/Block{i}")
        cube.CreateSizeAttr(1.0)
        cube.AddTranslateOp().Set(Gf.Vec3d(x, height / 2, z))
        cube.AddRotateYOp().Set(float(turn))
        cube.AddScaleOp().Set(Gf.Vec3f(0.55, height, 0.55))
        bind(cube.GetPrim(), look)


def add_lights(stage: Usd.Stage) -> None:
    """Add a low warm sun and a clear sky, bluer overhead."""
    sun = UsdLux.DistantLight.Define(stage, "/Demo/Sun")
    sun.CreateAngleAttr(0.53)
    sun.CreateNormalizeAttr(True)
    sun.CreateIntensityAttr(4.4)
    sun.CreateColorAttr(Gf.Vec3f(1.0, 0.80, 0.56))
    sun.AddRotateYOp().Set(-68.0)
    sun.AddRotateXOp().Set(-32.0)
    sky = UsdLux.DomeLight.Define(stage, "/Demo/Sky")
    sky.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
    sky.CreateTextureFileAttr(Sdf.AssetPath("./sky.hdr"))


def write_sky(path: Path, width: int = 256, height: int = 128) -> None:
    """Write a clear sky as Radiance HDR, pale at the horizon."""
    elevation = (0.5 - (np.arange(height) + 0.5) / height) * math.pi
    up = np.maximum(np.sin(elevation), 0.0)[:, None, None]
    zenith, horizon = np.array([0.07, 0.17, 0.42]), np.array([0.42, 0.48, 0.54])
    sky = zenith + (horizon - zenith) * np.exp(-4.0 * up)
    image = np.broadcast_to(sky, (height, width, 3)).astype(np.float32)
    write_radiance(path, image)


def write_radiance(path: Path, image: np.ndarray) -> None:
    """Write float32 RGB as an uncompressed Radiance file (shared exponent, 8 bits a channel)."""
    largest = np.maximum(image.max(axis=-1), 1e-30)
    mantissa, exponent = np.frexp(largest)
    scaled = image * (mantissa * 256.0 / largest)[..., None]
    rgbe = np.concatenate([scaled, (exponent + 128)[..., None]], axis=-1)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {image.shape[0]} +X {image.shape[1]}\n"
    path.write_bytes(head.encode() + np.clip(rgbe, 0, 255).astype(np.uint8).tobytes())


def add_camera(stage: Usd.Stage, images: Path) -> None:
    """Add the camera, and render settings with the two images as products."""
    camera = UsdGeom.Camera.Define(stage, "/Demo/Camera")
    position, target = Gf.Vec3d(0.0, 1.15, 11.5), Gf.Vec3d(0.0, 2.55, 0.0)
    view = Gf.Matrix4d().SetLookAt(position, target, Gf.Vec3d(0, 1, 0))
    camera.AddTransformOp().Set(view.GetInverse())
    camera.CreateFocalLengthAttr(35.0)
    camera.CreateHorizontalApertureAttr(36.0)
    camera.CreateVerticalApertureAttr(36.0 * RESOLUTION[1] / RESOLUTION[0])
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01, 10000.0))

    settings = UsdRender.Settings.Define(stage, "/Render/Settings")
    settings.CreateResolutionAttr(Gf.Vec2i(*RESOLUTION))
    settings.CreateCameraRel().SetTargets([camera.GetPath()])
    settings.GetPrim().CreateAttribute("tyndall:maxBounces", Sdf.ValueTypeNames.Int).Set(MAX_BOUNCES)
    stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")
    variables = []
    for name in ("rgba", "albedo", "normal", "volume", "transmittance"):
        variable = UsdRender.Var.Define(stage, f"/Render/Vars/{name}")
        variable.CreateSourceNameAttr(name)
        variables.append(variable.GetPath())
    products = []
    for suffix, wanted in (("exr", variables), ("png", variables[:1])):
        product = UsdRender.Product.Define(stage, f"/Render/{suffix}")
        product.CreateProductNameAttr((images / f"demo.{suffix}").as_posix())
        product.CreateOrderedVarsRel().SetTargets(wanted)
        products.append(product.GetPath())
    settings.CreateProductsRel().SetTargets(products)


def main() -> None:
    """Write everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the stage and its files")
    parser.add_argument("--images", type=Path, required=True, help="folder of the images to render")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    stage = Usd.Stage.CreateNew(str(arguments.out / "demo.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Demo").GetPrim())
    add_cloud(stage, arguments.out)
    add_objects(stage)
    add_lights(stage)
    write_sky(arguments.out / "sky.hdr")
    add_camera(stage, arguments.images)
    stage.GetRootLayer().Save()


if __name__ == "__main__":
    main()

"""What glows: Planck's law, fire behind smoke and beside it, and phase functions in a furnace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.fields import fields, own_medium
from support.oracles import judge
from support.render import Shot, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

VOXEL = 0.05
DEPTH = 16  # voxels

# Linear Rec.709 of luminance 1, by quadrature at 1 nm over the observer's table from 360 to 830 nm.
PLANCK = {
    1500.0: (3.249860, 0.432158, 0.0),
    2500.0: (2.068003, 0.769392, 0.139522),
    6500.0: (1.043385, 0.983573, 1.034975),
}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Stefan-Boltzmann over pi, in MW m^-2 sr^-1 K^-4.
RADIANCE = 5.670374419e-14 / np.pi


def slab(folder: Path, name: str, z: float, value: float = 1.0) -> Path:
    """Write a grid of `DEPTH` voxels from `z` on; its integral along the axis is value * thickness."""
    values = np.full((24, 24, DEPTH), value, np.float32)
    path = folder / f"{name}.vdb"
    tyndall.write_vdb(str(path), name, values, VOXEL, (-12 * VOXEL, -12 * VOXEL, z))
    return path


THICKNESS = DEPTH * VOXEL


def along_the_axis() -> StageBuilder:
    stage = StageBuilder(4, 4)
    stage.camera((0, 0, 6), (0, 0, 0), orthographic_height=0.3)
    return stage


@pytest.mark.parametrize("kelvin", PLANCK)
def test_hot_gas_has_the_light_of_its_temperature(tmp_path: Path, kelvin: float) -> None:
    stage = along_the_axis()
    medium = own_medium(
        stage, density=0.7, albedo=(0, 0, 0), temperature=kelvin, blackbodyIntensity=(3, 3, 3)
    )
    stage.box((-1, -1, -1), (1, 1, 1), medium)
    image = Shot(stage, tmp_path).render(spp=1, max_bounces=4)["rgba"][..., :3]
    radiance = 3 * RADIANCE * kelvin**4 * np.array(PLANCK[kelvin])
    expected = radiance * (1 - np.exp(-1.4)) / 0.7
    np.testing.assert_allclose(image.mean((0, 1)), expected, rtol=1e-3, atol=1e-4 * expected.max())


@pytest.mark.parametrize(("smoke_z", "passes"), [(1.0, True), (-2.5, False)], ids=["behind", "in_front"])
@pytest.mark.parametrize("sigma", [0.3, 4.0])
def test_fire_beside_smoke(tmp_path: Path, smoke_z: float, *, passes: bool, sigma: float) -> None:
    """Fire where there is no smoke is seen, through the smoke that is before it."""
    stage = along_the_axis()
    medium = own_medium(
        stage, density=(sigma, "density"), albedo=(0.5, 0.5, 0.5), emission=((2.0, 1.0, 0.25), "flame")
    )
    fields(stage, medium, density=slab(tmp_path, "density", smoke_z), flame=slab(tmp_path, "flame", 0.0))
    images = Shot(stage, tmp_path).seeds(8, spp=256, max_bounces=0)
    through = np.exp(-sigma * THICKNESS) if passes else 1.0
    judge(images, np.array([2.0, 1.0, 0.25]) * THICKNESS * through)


def test_fire_in_its_smoke(tmp_path: Path) -> None:
    """Temperature and density of the same place, from grids of their own; the luminance is sigma T^4 / pi."""
    stage = along_the_axis()
    sigma, kelvin = 2.0, 1500.0
    medium = own_medium(
        stage, density=(sigma, "density"), albedo=(0, 0, 0), temperature=(kelvin, "temperature")
    )
    fields(
        stage,
        medium,
        density=slab(tmp_path, "density", 0.0),
        temperature=slab(tmp_path, "temperature", 0.0),
    )
    images = Shot(stage, tmp_path).seeds(8, spp=256, max_bounces=0)
    # Quadrature along the axis, where both grids rise and fall over one voxel.
    z = (np.arange(400_000) + 0.5) / 400_000 * (DEPTH + 1)
    value = np.clip(np.minimum(z, DEPTH + 1 - z), 0, 1)
    dz = VOXEL * (DEPTH + 1) / len(z)
    seen = np.exp(-sigma * dz * (np.cumsum(value) - 0.5 * value)) * dz
    expected = (RADIANCE * (kelvin * value) ** 4 * seen).sum()
    luminance = np.repeat((images @ LUMINANCE)[..., None], 3, axis=-1)
    judge(luminance, expected)


PHASES = {
    "two_lobes": {"anisotropy": 0.8, "anisotropy2": -0.4, "lobeMix": 0.3},
    "rayleigh": {"phase": "rayleigh"},
    "draine": {"phase": "draine", "anisotropy": 0.6, "alpha": 30.0},
    "droplets": {"phase": "droplets", "dropletDiameter": 20.0},
}


@pytest.mark.parametrize("phase", PHASES.values(), ids=PHASES)
def test_phase_functions_keep_all_light(tmp_path: Path, phase: dict[str, Any]) -> None:
    stage = StageBuilder(16, 12)
    stage.camera((0, 0, 4), (0, 0, 0), vfov=32)
    stage.sphere((0, 0, 0), 1.0, own_medium(stage, density=5.0, albedo=(1, 1, 1), **phase))
    stage.dome(1.0)
    judge(Shot(stage, tmp_path).seeds(8, spp=64, max_bounces=4096), 1.0)

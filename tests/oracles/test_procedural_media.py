"""Media whose coefficients are functions of the position."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from pxr import Sdf, UsdShade
from support.oracles import judge
from support.render import Shot
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

T = Sdf.ValueTypeNames


def wedge(stage: StageBuilder, space: str, **inputs: object) -> str:
    """Add a medium whose density is twice the position's z; return its material."""
    material = UsdShade.Material.Define(stage.stage, "/Wedge")

    def node(name: str, identifier: str) -> UsdShade.Shader:
        shader = UsdShade.Shader.Define(stage.stage, f"/Wedge/{name}")
        shader.CreateIdAttr(identifier)
        return shader

    position, z, density = (
        node("position", "ND_position_vector3"),
        node("z", "ND_extract_vector3"),
        node("density", "ND_multiply_float"),
    )
    position.CreateInput("space", T.String).Set(space)
    z.CreateInput("in", T.Vector3f).ConnectToSource(position.CreateOutput("out", T.Vector3f))
    z.CreateInput("index", T.Int).Set(2)
    density.CreateInput("in1", T.Float).ConnectToSource(z.CreateOutput("out", T.Float))
    density.CreateInput("in2", T.Float).Set(2.0)
    volume = node("volume", "tyndall:volume")
    volume.CreateInput("density", T.Float).ConnectToSource(density.CreateOutput("out", T.Float))
    for name, value in inputs.items():
        volume.CreateInput(name, T.Color3f).Set(value)
    material.CreateVolumeOutput().ConnectToSource(volume.CreateOutput("out", T.Token))
    return "/Wedge"


@pytest.mark.parametrize("far", [0.0, 1e5])
def test_transmittance_of_a_wedge(tmp_path: Path, far: float) -> None:
    """Density 2 z over z from 0 to 1: an optical depth of 1, wherever the stage's origin is."""
    stage = StageBuilder()
    stage.camera((far, 0, 3), (far, 0, 0), vfov=0.02)
    stage.box((far - 1, -1, 0), (far + 1, 1, 1), wedge(stage, "world", albedo=(0, 0, 0)))
    stage.dome(1.0)
    judge(Shot(stage, tmp_path).seeds(4, spp=1024, max_bounces=0), math.exp(-1.0), relative_error=0.01)


def test_white_wedge_in_a_furnace(tmp_path: Path) -> None:
    """What only scatters cannot be seen in even light."""
    stage = StageBuilder()
    stage.camera((0, 0, 3), (0, 0, 0), vfov=60)
    stage.box((-1, -1, 0), (1, 1, 1), wedge(stage, "world", albedo=(1, 1, 1)))
    stage.dome(0.7)
    image = Shot(stage, tmp_path).render(spp=64, max_bounces=1000)["rgba"]
    np.testing.assert_allclose(image[..., :3].mean(axis=(0, 1)), 0.7, rtol=0.01)


def test_the_same_bits_on_one_and_two_threads(tmp_path: Path) -> None:
    """Sampling the program is part of that promise."""
    images = []
    for _ in range(2):
        stage = StageBuilder()
        stage.camera((0, 0, 3), (0, 0, 0), vfov=40)
        stage.box((-1, -1, -1), (1, 1, 1), wedge(stage, "object", albedo=(0.8, 0.5, 0.2)))
        stage.dome(1.0)
        images.append(Shot(stage, tmp_path).render(spp=8, max_bounces=8, threads=len(images) + 1)["rgba"])
    np.testing.assert_array_equal(*images)
    assert np.ptp(images[0][..., 0]) > 0.01

"""Cryptomattes in files, decoded by the specification (1.2) with a hash that is not ours."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import mmh3
import numpy as np
from support import exr
from support.render import Shot, tyndall
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt


def decode(path: Path, name: str) -> dict[str, npt.NDArray[np.float64]]:
    """Return the coverage of every name of the manifest, shape (height, width)."""
    prefix = f"cryptomatte/{bits(name):08x}"[: len("cryptomatte/") + 7]
    header: dict[str, Any] = exr.read_header(path)
    assert header[f"{prefix}/name"] == name
    assert header[f"{prefix}/hash"] == "MurmurHash3_32"
    assert header[f"{prefix}/conversion"] == "uint32_to_float32"
    layers = exr.read_layers(path)
    pairs = np.concatenate([layers[f"{name}{i:02d}"] for i in range(3)], axis=-1)
    ids, coverage = pairs[..., 0::2].view(np.uint32), pairs[..., 1::2]
    assert (np.diff(coverage, axis=-1) <= 0).all(), "most first"
    manifest = json.loads(header[f"{prefix}/manifest"])
    for known, digits in manifest.items():
        assert digits == f"{bits(known):08x}"
    found = {known: np.where(ids == bits(known), coverage, 0.0).sum(axis=-1) for known in manifest}
    everything = sum(found.values())
    np.testing.assert_allclose(everything, coverage.sum(axis=-1), atol=1e-6)
    return found


def bits(name: str) -> int:
    """Return the id of a name as the bits of a float."""
    value = mmh3.hash(name, 0, signed=False)
    return value ^ 1 << 23 if (value >> 23 & 255) in (0, 255) else value


def test_edges_fog_and_background(tmp_path: Path) -> None:
    """Two walls that meet within a column of pixels, half of the picture behind fog, sky above."""
    stage = StageBuilder(9, 8)
    stage.camera((0, 0, 5), (0, 0, 0), vfov=53.13)
    left, right = (stage.quad((x, -9, 0), (9, 0, 0), (0, 9, 0), stage.lambert(0.5)) for x in (-9, 0))
    fog = stage.box((-9, -9, 1), (0, 0, 2), stage.medium(0.5, 0.5))
    stage.dome(1.0)
    shot = Shot(stage, tmp_path)
    path = tmp_path / "out.exr"
    aovs = ["crypto_object", "crypto_material", "transmittance"]
    film = shot.session(spp=1024, max_bounces=1, aovs=aovs).render()
    film.write(path)
    objects, materials = decode(path, "CryptoObject"), decode(path, "CryptoMaterial")
    left, right, fog = (str(name).lstrip("/") for name in (left, right, fog))
    assert fog not in objects or (objects[fog] == 0).all()
    for wall in (left, right):
        assert (objects[wall][:4] == 0).all(), "the sky"
    np.testing.assert_array_equal(objects[right][4:, 5:], 1.0)
    np.testing.assert_allclose(objects[right][4:, 4], 0.5, atol=0.03)
    # Fog takes its share away from what is behind it.
    through = film.aov("transmittance")[4:, :4, 0]
    np.testing.assert_allclose(objects[left][4:, :4], through, atol=0.06)
    assert abs(float((objects[left][4:, :4] - through).mean())) < 0.01
    assert len(materials) >= 2
    np.testing.assert_allclose(sum(materials.values()), sum(objects.values()), atol=1e-6)


def test_parts_of_the_samples_add_up(tmp_path: Path) -> None:
    """The same bits in one render and in two parts, through a file."""
    stage = StageBuilder(8, 8)
    stage.camera((0, 0, 5), (0, 0, 0), vfov=40)
    for x in range(-2, 3):
        stage.sphere((0.6 * x, 0, 0), 0.4, stage.lambert(0.5))
    stage.dome(1.0)
    shot = Shot(stage, tmp_path)
    settings = {**shot.settings, "samples": 64, "maxBounces": 2, "aovs": ["crypto_object"]}
    whole, first, second = (
        tyndall.Session(shot.scene, settings, sample_range=part).render()
        for part in (None, (0, 32), (32, 64))
    )
    second.write_state(tmp_path / "second", "")
    read, _ = type(second).read_state(tmp_path / "second")
    joined = first.joined(read)
    np.testing.assert_array_equal(joined.aov("crypto_object"), whole.aov("crypto_object"))
    assert joined.cryptomatte_metadata() == whole.cryptomatte_metadata() == read.cryptomatte_metadata()
    assert whole.aov("crypto_object")[..., 1].max() > 0.5

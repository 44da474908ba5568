"""A cumulus cloud as a density grid: overlapping puffs, eaten away at the edge by layered noise.

Nothing is random but the fixed seed: the same cloud every time.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Grid = npt.NDArray[np.float32]


def _smooth(t: Grid) -> Grid:
    """Perlin's quintic: first and second derivative vanish at the lattice."""
    return t * t * t * (t * (t * 6 - 15) + 10)


def gradient_noise(shape: tuple[int, int, int], cell: float, rng: np.random.Generator) -> Grid:
    """Return Perlin noise (K. Perlin, "Improving noise", 2002, doi:10.1145/566654.566636) in about [-1, 1].

    `cell` is the lattice spacing in samples.
    """
    axes = [np.arange(n, dtype=np.float32) / cell for n in shape]
    lattice = [int(np.ceil(n / cell)) + 2 for n in shape]
    gradients = rng.normal(size=(*lattice, 3)).astype(np.float32)
    gradients /= np.linalg.norm(gradients, axis=-1, keepdims=True)
    index = [np.floor(a).astype(int) for a in axes]
    part = [(a - i).astype(np.float32) for a, i in zip(axes, index, strict=True)]
    fade = [_smooth(p) for p in part]
    noise = np.zeros(shape, np.float32)
    for corner in np.ndindex(2, 2, 2):
        at = np.ix_(*(i + c for i, c in zip(index, corner, strict=True)))
        gradient = gradients[at]
        offsets = np.meshgrid(*(p - c for p, c in zip(part, corner, strict=True)), indexing="ij", sparse=True)
        value = sum(gradient[..., axis] * offsets[axis] for axis in range(3))
        weights = [f if c else 1 - f for f, c in zip(fade, corner, strict=True)]
        noise += value * weights[0][:, None, None] * weights[1][None, :, None] * weights[2][None, None, :]
    return noise * np.float32(1.6)


def billows(shape: tuple[int, int, int], cell: float, octaves: int, rng: np.random.Generator) -> Grid:
    """Return rounded bumps in about [0, 1]: a sum of 1 - |noise|, each octave half as large."""
    total, weight = np.zeros(shape, np.float32), 0.0
    for octave in range(octaves):
        share = 0.55**octave
        total += share * (1 - np.abs(gradient_noise(shape, cell / 2**octave, rng)))
        weight += share
    return total / np.float32(weight)


def cumulus(shape: tuple[int, int, int], voxel: float, seed: int) -> Grid:
    """Return the density of a cumulus, 0 to 1, along x, y (up), z, its flat base near the bottom.

    Parameters
    ----------
    voxel : float
        Distance between samples, in metres.
    """
    rng = np.random.default_rng(seed)
    size = np.array(shape) * voxel
    axes = [(np.arange(n, dtype=np.float32) + 0.5) * np.float32(voxel) for n in shape]
    x, y, z = np.meshgrid(axes[0] - size[0] / 2, axes[1], axes[2] - size[2] / 2, indexing="ij", sparse=True)

    # Signed distance to the union of puffs: wide and low at the base, narrower towers in the middle.
    distance = np.full(shape, np.inf, np.float32)
    for _ in range(46):
        rise = rng.random() ** 1.3
        spread = (1 - 0.8 * rise) * 0.36
        angle, reach = rng.uniform(0, 2 * np.pi), np.sqrt(rng.random())
        radius = size[1] * rng.uniform(0.12, 0.21) * (1 - 0.25 * rise)
        center_x = size[0] * spread * reach * np.cos(angle)
        center_z = size[2] * spread * reach * np.sin(angle)
        center_y = size[1] * (0.17 + 0.58 * rise)
        puff = np.sqrt((x - center_x) ** 2 + ((y - center_y) * 1.1) ** 2 + (z - center_z) ** 2) - radius
        distance = np.minimum(distance, puff.astype(np.float32))

    # Noise pushes the surface in and out; a narrow ramp makes a crisp edge that still is no wall.
    scale = size[1]
    bumps = billows(shape, 0.24 * scale / voxel, 5, rng)
    surface = distance + np.float32(0.20 * scale) * (np.float32(0.80) - bumps)
    base = np.float32(0.09 * scale) - y + np.float32(0.03 * scale) * (bumps - np.float32(0.5))
    surface = np.maximum(surface, base.astype(np.float32))
    density = np.clip(-surface / np.float32(0.035 * scale), 0, 1)
    density *= np.clip(0.55 + 0.6 * y / np.float32(scale), 0, 1)

    # The outermost samples are empty, so that the grid's edge never shows.
    for axis in range(3):
        edge: list[slice | list[int]] = [slice(None)] * 3
        edge[axis] = [0, -1]
        density[tuple(edge)] = 0
    return np.ascontiguousarray(density, np.float32)

"""Judging noisy images: every verdict is in standard errors, none is a tolerance somebody liked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

Images = npt.NDArray[np.float64]

# Sums of float32 pixels: a constant image may be off by a few units in the last place without any noise to
# excuse it.
ROUNDING = 16 * float(np.finfo(np.float32).eps)
# The epsilon of relative squared errors; keeps black pixels from ruling the mean.
RELATIVE_EPSILON = 0.01
# Share of pixels left out of relative squared errors: those that are noisiest.
TRIMMED_SHARE = 0.001


@dataclass(frozen=True, slots=True)
class Estimate:
    """The mean of independent renders, per channel."""

    mean: npt.NDArray[np.float64]
    error: npt.NDArray[np.float64]

    def z(self, expected: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the deviation from `expected` in standard errors, per channel.

        Rounding of float32 is added to the error in quadrature, so that renders without noise can be judged
        too.
        """
        expected = np.asarray(expected, np.float64)
        rounding = ROUNDING * np.maximum(np.abs(expected), np.abs(self.mean))
        error = np.hypot(self.error, rounding)
        return (self.mean - expected) / np.maximum(error, np.finfo(np.float64).tiny)

    def relative_error(self) -> float:
        """Return the largest standard error of a channel relative to its mean."""
        return float(np.max(self.error / np.maximum(np.abs(self.mean), np.finfo(np.float64).tiny)))


def estimate(images: npt.ArrayLike) -> Estimate:
    """Return the mean over seeds and pixels with its standard error.

    Parameters
    ----------
    images : array, shape (seeds, height, width, channels)
        Independent renders of one scene.

    The error comes from the variance over seeds *within* each pixel, so pixels need not agree with one
    another; with hundreds of pixels it is known well enough to use the normal distribution. Pixels must be
    independent of each other: `pixel_independence` tests that.
    """
    images = np.asarray(images, np.float64)
    seeds, height, width, _ = images.shape
    variance_of_pixel_mean = images.var(axis=0, ddof=1) / seeds
    error = np.sqrt(variance_of_pixel_mean.sum(axis=(0, 1))) / (height * width)
    return Estimate(mean=images.mean(axis=(0, 1, 2)), error=error)


def pixel_independence(images: npt.ArrayLike) -> float:
    """Return the p-value of image means scattering this much over seeds if pixels are independent."""
    images = np.asarray(images, np.float64)
    seeds, height, width, channels = images.shape
    within = images.var(axis=0, ddof=1).sum(axis=(0, 1)) / (height * width) ** 2
    between = images.mean(axis=(1, 2)).var(axis=0, ddof=1)
    noisy = within > 0
    if not noisy.any():
        return 1.0
    p = stats.chi2.sf((seeds - 1) * between[noisy] / within[noisy], seeds - 1)
    return float(min(1.0, p.min() * channels))


@dataclass(frozen=True, slots=True)
class SquaredError:
    """A relative squared error with the noise of the renders taken out, and its own standard error."""

    value: float
    error: float


def squared_difference(images: npt.ArrayLike, reference: npt.ArrayLike) -> SquaredError:
    """Return the relative squared difference to a reference, free of the noise of `images`.

    With independent renders x_s of a pixel and the reference r, the products (x_s - r)(x_t - r), s != t, have
    the expectation (E[x] - r)^2: noise of one render never meets itself. Divided by r^2 + 0.01 and averaged
    over pixels and channels. The 0.1 % noisiest pixels (by variance over seeds, which does not look at the
    sign of the difference) are left out. What remains is bias plus the error of the reference itself.
    """
    images = np.asarray(images, np.float64)
    reference = np.asarray(reference, np.float64)
    seeds = len(images)
    difference = images - reference
    total = difference.sum(axis=0)
    products = (total**2 - (difference**2).sum(axis=0)) / (seeds * (seeds - 1))
    scale = reference**2 + RELATIVE_EPSILON
    per_pixel = (products / scale).mean(axis=-1).ravel()
    noise = (images.var(axis=0, ddof=1) / scale).mean(axis=-1).ravel()
    kept = np.argsort(noise, kind="stable")[: len(noise) - int(len(noise) * TRIMMED_SHARE)]
    values = per_pixel[kept]
    return SquaredError(float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))))


def relative_mse(image: npt.ArrayLike, reference: npt.ArrayLike, reference_error: float = 0.0) -> float:
    """Return the relative mean squared error of one render, worst 0.1 % of pixels dropped."""
    image = np.asarray(image, np.float64)
    reference = np.asarray(reference, np.float64)
    per_pixel = ((image - reference) ** 2 / (reference**2 + RELATIVE_EPSILON)).mean(axis=-1).ravel()
    kept = np.sort(per_pixel)[: len(per_pixel) - int(len(per_pixel) * TRIMMED_SHARE)]
    return float(kept.mean()) - reference_error


def reference_mean_error(reference: npt.ArrayLike, relative_squared_error: float) -> npt.NDArray[np.float64]:
    """Return the standard error of a reference's channel means, from its stated relative squared error.

    The stated figure is the mean over pixels of var_i / (r_i^2 + 0.01). If noise goes with brightness as that
    normalisation assumes, var_i = stated * (r_i^2 + 0.01), and for independent pixels the mean over N pixels
    has the variance sum(var_i) / N^2.
    """
    reference = np.asarray(reference, np.float64)
    pixels = reference.shape[0] * reference.shape[1]
    variance = relative_squared_error * (reference**2 + RELATIVE_EPSILON)
    return np.sqrt(variance.sum(axis=(0, 1))) / pixels

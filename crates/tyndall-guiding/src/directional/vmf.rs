//! The von Mises–Fisher lobe.
//!
//! p(ω) = κ/(2π(1-e^{-2κ})) e^{κ(μ·ω-1)}; κ = 0 is the uniform sphere.
//! Sources: Fisher 1953, "Dispersion on a Sphere"; sampling after Jakob 2012, "Numerically stable sampling of the von
//! Mises-Fisher distribution on S²". All forms here are stable for κ in [0, 3.2e5], the latter a cone of 0.1 degrees.

use super::lanes::Lanes;
use glam::{Vec2, Vec3A};
use std::f32::consts::TAU;
use tyndall_math::{Frame, INV_4PI};

/// The sharpest lobe; beyond it f32 directions cannot tell the lobe from a mirror.
pub const MAX_CONCENTRATION: f32 = 3.2e5;
/// Below this κ a lobe is uniform to f32 precision.
const UNIFORM_BELOW: f32 = 1e-6;

/// A lobe around `mean` of concentration `kappa`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VmfLobe {
    mean: Vec3A,
    kappa: f32,
    /// κ/(2π(1-e^{-2κ})): the density at the peak.
    peak: f32,
}

impl VmfLobe {
    /// A lobe around the unit vector `mean`; `kappa` is clamped to [0, [`MAX_CONCENTRATION`]], NaN becomes 0.
    pub fn new(mean: Vec3A, kappa: f32) -> Self {
        let kappa = if kappa.is_nan() { 0.0 } else { kappa.clamp(0.0, MAX_CONCENTRATION) };
        Self { mean, kappa, peak: peak_density(kappa) }
    }

    /// The mean direction μ.
    #[inline]
    pub fn mean(&self) -> Vec3A {
        self.mean
    }

    /// The concentration κ.
    #[inline]
    pub fn kappa(&self) -> f32 {
        self.kappa
    }

    /// κ/(2π(1-e^{-2κ})): the normaliser, which is the density at the mean direction.
    #[inline]
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// Density at the unit vector `direction`, per steradian.
    #[inline]
    pub fn pdf(&self, direction: Vec3A) -> f32 {
        self.peak * (-self.kappa * one_minus_cos(self.mean, direction)).exp()
    }

    /// The direction of the point `u` in [0, 1)².
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3A {
        // h = 1 - cosθ: given directly because cosθ cancels in narrow lobes.
        let h = if self.kappa < UNIFORM_BELOW {
            2.0 * u.x
        } else {
            -(u.x * (-2.0 * self.kappa).exp_m1()).ln_1p() / self.kappa
        };
        let h = h.clamp(0.0, 2.0);
        let sin_theta = (h * (2.0 - h)).sqrt();
        let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
        let local = Vec3A::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - h);
        Frame::from_normal(self.mean).world_from_local(local)
    }

    /// The lobe proportional to the product of two, and the integral of that product over the sphere.
    pub fn product(&self, other: &Self) -> (Self, f32) {
        let sum = self.mean * self.kappa + other.mean * other.kappa;
        let length = sum.length();
        // Shorter sums are uniform lobes, and too short to be divided by.
        let mean = if length > 1e-12 { sum / length } else { self.mean };
        let lobe = Self::new(mean, length);
        // κ₁ + κ₂ - |κ₁μ₁ + κ₂μ₂| without the cancellation.
        let total = self.kappa + other.kappa;
        let loss = if total > 0.0 {
            2.0 * self.kappa * other.kappa * one_minus_cos(self.mean, other.mean) / (total + length)
        } else {
            0.0
        };
        // The peak is that of the unclamped concentration: the integral is exact even if the lobe is not.
        (lobe, self.peak * other.peak / peak_density(length) * (-loss).exp())
    }
}

/// 1 - a·b of unit vectors, precise for close ones.
#[inline]
fn one_minus_cos(a: Vec3A, b: Vec3A) -> f32 {
    0.5 * (a - b).length_squared()
}

/// κ/(2π(1-e^{-2κ})) for κ ≥ 0.
#[inline]
fn peak_density(kappa: f32) -> f32 {
    peak_densities(Lanes::splat(kappa)).0[0]
}

/// [`peak_density`] of eight lobes.
#[inline(always)]
pub(super) fn peak_densities(kappa: Lanes) -> Lanes {
    // The closed form cancels for small κ; the next term of the series is 1.4e-7 of the first at 0.2.
    let square = kappa * kappa;
    let series = (kappa + square * (square * (-1.0 / 45.0) + 1.0 / 3.0) + 1.0) * INV_4PI;
    let rest = Lanes::splat(1.0) - (kappa * -2.0).exp_nonpositive();
    kappa.if_above(0.2, kappa / (rest * TAU), series)
}

/// Mean of μ·ω over the lobe of concentration `kappa` ≥ 0: coth κ - 1/κ.
pub fn mean_cosine(kappa: f32) -> f32 {
    mean_cosine_f64(f64::from(kappa.max(0.0))) as f32
}

/// [`mean_cosine`] of eight lobes, to 1e-5.
#[inline(always)]
pub(super) fn mean_cosines(kappa: Lanes) -> Lanes {
    let one = Lanes::splat(1.0);
    let e = (kappa * -2.0).exp_nonpositive();
    kappa.if_above(0.1, (one + e) / (one - e) - one / kappa, kappa * (1.0 / 3.0))
}

/// The κ whose mean cosine is `r`: the inverse of [`mean_cosine`], in [0, [`MAX_CONCENTRATION`]]. Values outside [0, 1)
/// are clamped, NaN gives 0.
pub fn concentration_from_mean_cosine(r: f32) -> f32 {
    let r = f64::from(r.max(0.0));
    let max = f64::from(MAX_CONCENTRATION);
    if r >= 1.0 - 1.0 / max {
        return MAX_CONCENTRATION;
    }
    // Three steps of Newton's reach f32 precision everywhere.
    let mut kappa = f64::from(nearly_concentration(r as f32));
    for _ in 0..3 {
        let a = mean_cosine_f64(kappa);
        let slope = if kappa < 1e-3 { 1.0 / 3.0 } else { 1.0 - a * a - 2.0 * a / kappa };
        kappa = (kappa - (a - r) / slope).clamp(0.0, max);
    }
    kappa as f32
}

/// [`concentration_from_mean_cosine`] to 5 %, for r in [0, 1) (Banerjee et al. 2005).
#[inline]
pub(super) fn nearly_concentration(r: f32) -> f32 {
    r * (3.0 - r * r) / (1.0 - r * r)
}

fn mean_cosine_f64(kappa: f64) -> f64 {
    if kappa < 0.1 {
        // The next term is 2e-12 of the first here.
        let k2 = kappa * kappa;
        kappa * (1.0 / 3.0 - k2 * (1.0 / 45.0 - k2 * (2.0 / 945.0 - k2 / 4725.0)))
    } else {
        1.0 / kappa.tanh() - 1.0 / kappa
    }
}

#[cfg(test)]
#[path = "vmf_tests.rs"]
mod tests;

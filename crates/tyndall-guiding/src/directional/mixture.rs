//! A mixture of up to 32 von Mises–Fisher lobes, stored as structure of arrays.

use super::VmfLobe;
use glam::{Vec2, Vec3A};
use std::f32::consts::TAU;
use tyndall_math::INV_4PI;

/// Lobes a mixture can hold.
pub const MAX_LOBES: usize = 32;
/// Concentration of the lobes of a new mixture: sixteen of them overlap at half their height.
const INITIAL_KAPPA: f32 = 5.0;

/// A sampled direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionAndPdf {
    /// Unit vector.
    pub direction: Vec3A,
    /// The mixture's density there, per steradian.
    pub pdf: f32,
}

/// Σ π_k v_k(ω), with Σ π_k = 1. An empty mixture is the uniform sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct VmfMixture {
    len: usize,
    weight: [f32; MAX_LOBES],
    kappa: [f32; MAX_LOBES],
    /// Density of each lobe at its own mean.
    peak: [f32; MAX_LOBES],
    mean_x: [f32; MAX_LOBES],
    mean_y: [f32; MAX_LOBES],
    mean_z: [f32; MAX_LOBES],
}

impl VmfMixture {
    /// `n` (at most [`MAX_LOBES`]) equal broad lobes spread evenly over the sphere, on a Fibonacci spiral.
    pub fn spread(n: usize) -> Self {
        let n = n.min(MAX_LOBES);
        let golden = TAU * 0.618_034;
        let lobe = |i: usize| {
            let z = 1.0 - (2 * i + 1) as f32 / n as f32;
            let r = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = (golden * i as f32).sin_cos();
            (1.0, VmfLobe::new(Vec3A::new(r * cos, r * sin, z), INITIAL_KAPPA))
        };
        Self::from_lobes((0..n).map(lobe))
    }

    /// The mixture of these weights and lobes, at most [`MAX_LOBES`] of them. Weights are normalised; lobes of a weight
    /// that is not finite and positive are left out.
    pub fn from_lobes(lobes: impl IntoIterator<Item = (f32, VmfLobe)>) -> Self {
        let zeros = [0.0; MAX_LOBES];
        let mut mixture = Self {
            len: 0,
            weight: zeros,
            kappa: zeros,
            peak: zeros,
            mean_x: zeros,
            mean_y: zeros,
            mean_z: zeros,
        };
        for (weight, lobe) in lobes.into_iter().filter(|(w, _)| w.is_finite() && *w > 0.0).take(MAX_LOBES) {
            let k = mixture.len;
            mixture.weight[k] = weight;
            (mixture.kappa[k], mixture.peak[k]) = (lobe.kappa(), lobe.peak());
            [mixture.mean_x[k], mixture.mean_y[k], mixture.mean_z[k]] = lobe.mean().to_array();
            mixture.len += 1;
        }
        let total: f64 = mixture.weight.iter().map(|&w| f64::from(w)).sum();
        mixture.weight.iter_mut().for_each(|w| *w = (f64::from(*w) / total.max(f64::MIN_POSITIVE)) as f32);
        mixture
    }

    /// Number of lobes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether this is the uniform sphere.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Weight and shape of lobe `k`.
    ///
    /// # Panics
    /// If there is no such lobe.
    pub fn lobe(&self, k: usize) -> (f32, VmfLobe) {
        assert!(k < self.len, "lobe {k} of {}", self.len);
        let mean = Vec3A::new(self.mean_x[k], self.mean_y[k], self.mean_z[k]);
        (self.weight[k], VmfLobe::new(mean, self.kappa[k]))
    }

    /// All lobes with their weights.
    pub fn lobes(&self) -> impl Iterator<Item = (f32, VmfLobe)> + '_ {
        (0..self.len).map(|k| self.lobe(k))
    }

    /// Density at the unit vector `direction`, per steradian.
    #[inline]
    pub fn pdf(&self, direction: Vec3A) -> f32 {
        if self.is_empty() {
            return INV_4PI;
        }
        (0..self.len).map(|k| self.weight[k] * self.peak[k] * self.exponent(k, direction).exp()).sum()
    }

    /// ln of each lobe's weighted peak, for [`Self::log_terms`]; minus infinity past the last lobe.
    pub(super) fn log_peaks(&self) -> [f32; MAX_LOBES] {
        let mut logs = [f32::NEG_INFINITY; MAX_LOBES];
        for (k, log) in logs[..self.len].iter_mut().enumerate() {
            *log = (self.weight[k] * self.peak[k]).ln();
        }
        logs
    }

    /// ln(π_k v_k(ω)) of every lobe.
    pub(super) fn log_terms(&self, log_peaks: &[f32; MAX_LOBES], direction: Vec3A) -> [f32; MAX_LOBES] {
        let mut terms = *log_peaks;
        terms[..self.len].iter_mut().enumerate().for_each(|(k, t)| *t += self.exponent(k, direction));
        terms
    }

    /// κ(μ·ω - 1) of lobe `k`, as half the squared distance, which does not cancel in narrow lobes.
    #[inline]
    fn exponent(&self, k: usize, direction: Vec3A) -> f32 {
        let (dx, dy) = (direction.x - self.mean_x[k], direction.y - self.mean_y[k]);
        let dz = direction.z - self.mean_z[k];
        -0.5 * self.kappa[k] * (dx * dx + dy * dy + dz * dz)
    }

    /// The direction of the point `u` in [0, 1)²; `u.x` also chooses the lobe.
    pub fn sample(&self, u: Vec2) -> DirectionAndPdf {
        let direction = match self.choose(u.x) {
            Some((k, u_x)) => self.lobe(k).1.sample(Vec2::new(u_x, u.y)),
            None => tyndall_math::sampling::uniform_sphere(u),
        };
        DirectionAndPdf { direction, pdf: self.pdf(direction) }
    }

    /// The lobe `u` falls on and where in it, in [0, 1).
    fn choose(&self, u: f32) -> Option<(usize, f32)> {
        let last = self.len.checked_sub(1)?;
        let mut begin = 0.0;
        for k in 0..last {
            let end = begin + self.weight[k];
            if u < end {
                return Some((k, rescale(u - begin, self.weight[k])));
            }
            begin = end;
        }
        Some((last, rescale((u - begin).max(0.0), 1.0 - begin)))
    }
}

/// `offset / width`, below 1 despite rounding.
fn rescale(offset: f32, width: f32) -> f32 {
    (offset / width.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0 - f32::EPSILON / 2.0)
}

#[cfg(test)]
#[path = "mixture_tests.rs"]
mod tests;

//! A mixture of up to eight von Mises–Fisher lobes, stored as structure of arrays.

use super::VmfLobe;
use super::lanes::{Lanes, MAX_LOBES, PerLobe, groups_of};
use super::vmf::peak_densities;
use glam::{Vec2, Vec3A};
use std::f32::consts::TAU;
use tyndall_math::INV_4PI;

/// Concentration of the lobes of a new mixture: seven of them and a uniform one are uniform to within a factor of two.
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
    pub(super) weight: PerLobe,
    pub(super) kappa: PerLobe,
    pub(super) mean: [PerLobe; 3],
    /// π_k times the density of lobe k at its own mean; 0 past the last lobe.
    pub(super) weighted_peak: PerLobe,
}

/// Eight lobes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Group {
    pub(crate) weight: Lanes,
    pub(crate) kappa: Lanes,
    pub(crate) mean: [Lanes; 3],
    /// π_k times the density of the lobe at its own mean.
    pub(crate) weighted_peak: Lanes,
}

impl Group {
    /// Lobes of other shapes and weights.
    #[inline(always)]
    pub(crate) fn new(weight: Lanes, kappa: Lanes, mean: [Lanes; 3]) -> Self {
        Self { weight, kappa, mean, weighted_peak: weight * peak_densities(kappa) }
    }

    /// π_k v_k(ω).
    #[inline(always)]
    fn terms(&self, direction: Vec3A) -> Lanes {
        self.weighted_peak * self.exponents(direction).exp_nonpositive()
    }

    /// κ(μ·ω - 1).
    #[inline(always)]
    pub(super) fn exponents(&self, direction: Vec3A) -> Lanes {
        self.one_minus_cos(direction) * self.kappa * -1.0
    }

    /// 1 - μ·ω, as half the squared distance, which does not cancel in narrow lobes.
    #[inline(always)]
    pub(super) fn one_minus_cos(&self, direction: Vec3A) -> Lanes {
        let [x, y, z] = self.mean;
        let dx = x - Lanes::splat(direction.x);
        let dy = y - Lanes::splat(direction.y);
        let dz = z - Lanes::splat(direction.z);
        (dx * dx + dy * dy + dz * dz) * 0.5
    }
}

impl VmfMixture {
    /// `n` (at most [`MAX_LOBES`]) equal broad lobes spread evenly over the sphere, on a Fibonacci spiral.
    pub fn spread(n: usize) -> Self {
        Self::from_lobes(spread_lobes(n.min(MAX_LOBES)))
    }

    /// A uniform lobe, which stays uniform in every fit, and `n` - 1 broad ones. The uniform lobe makes every direction
    /// possible and takes up stray samples, which would otherwise widen lobes.
    pub(crate) fn with_background(n: usize) -> Self {
        let uniform = (1.0, VmfLobe::new(Vec3A::Z, 0.0));
        Self::from_lobes(std::iter::once(uniform).chain(spread_lobes(n.clamp(1, MAX_LOBES) - 1)))
    }

    /// The mixture of these weights and lobes, at most [`MAX_LOBES`] of them. Weights are normalised; lobes of a weight
    /// that is not finite and positive are left out.
    pub fn from_lobes(lobes: impl IntoIterator<Item = (f32, VmfLobe)>) -> Self {
        let mut mixture = Self {
            len: 0,
            weight: PerLobe::ZERO,
            kappa: PerLobe::ZERO,
            mean: [PerLobe::ZERO; 3],
            weighted_peak: PerLobe::ZERO,
        };
        for (weight, lobe) in lobes.into_iter().filter(|(w, _)| w.is_finite() && *w > 0.0).take(MAX_LOBES) {
            let k = mixture.len;
            mixture.weight[k] = weight;
            mixture.kappa[k] = lobe.kappa();
            mixture.mean.iter_mut().zip(lobe.mean().to_array()).for_each(|(m, v)| m[k] = v);
            mixture.len += 1;
        }
        mixture.finish();
        mixture
    }

    /// The mixture of the lobes that `change` makes of these, and the sum of its weights before they are normalised.
    /// `change` may not make a weight negative, a concentration unbounded or a mean other than a unit vector.
    ///
    /// If that sum is no positive finite number, the lobes stay as they were, and the sum is 0.
    #[inline(always)]
    pub(crate) fn map_groups(&self, mut change: impl FnMut(usize, Group) -> Group) -> (Self, f32) {
        let mut changed = self.clone();
        for g in 0..groups_of(self.len) {
            let group = change(g, self.group(g));
            (changed.weight.0[g], changed.kappa.0[g]) = (group.weight, group.kappa);
            changed.mean.iter_mut().zip(group.mean).for_each(|(all, new)| all.0[g] = new);
        }
        let total = changed.finish();
        if total.is_finite() && total > f64::from(f32::MIN_POSITIVE) {
            (changed, total as f32)
        } else {
            (self.clone(), 0.0)
        }
    }

    #[inline(always)]
    pub(super) fn group(&self, g: usize) -> Group {
        Group {
            weight: self.weight.0[g],
            kappa: self.kappa.0[g],
            mean: [self.mean[0].0[g], self.mean[1].0[g], self.mean[2].0[g]],
            weighted_peak: self.weighted_peak.0[g],
        }
    }

    /// Normalises the weights, computes the peaks and returns what the weights summed to.
    #[inline]
    fn finish(&mut self) -> f64 {
        let groups = &self.weight.0[..groups_of(self.len)];
        let total: f64 = groups.iter().flat_map(|group| group.0).map(f64::from).sum();
        let scale = normalising(total);
        for g in 0..groups_of(self.len) {
            self.weight.0[g] = self.weight.0[g] * scale;
        }
        self.set_peaks();
        total
    }

    #[inline]
    fn set_peaks(&mut self) {
        for g in 0..groups_of(self.len) {
            self.weighted_peak.0[g] = self.weight.0[g] * peak_densities(self.kappa.0[g]);
        }
    }

    /// What [`Self::from_rows`] restores bit for bit: weights, concentrations, and the components of the means.
    pub(crate) fn rows(&self) -> [&PerLobe; 5] {
        let [x, y, z] = &self.mean;
        [&self.weight, &self.kappa, x, y, z]
    }

    /// The mixture of `len` lobes with these [`Self::rows`], whose weights already sum to 1.
    pub(crate) fn from_rows(len: usize, [weight, kappa, x, y, z]: [PerLobe; 5]) -> Self {
        let mut mixture =
            Self { len: len.min(MAX_LOBES), weight, kappa, mean: [x, y, z], weighted_peak: PerLobe::ZERO };
        mixture.set_peaks();
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
        let [x, y, z] = self.mean.each_ref().map(|m| m[k]);
        (self.weight[k], VmfLobe::new(Vec3A::new(x, y, z), self.kappa[k]))
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
        (0..groups_of(self.len)).fold(Lanes::splat(0.0), |sum, g| sum + self.group(g).terms(direction)).sum()
    }

    /// The share π_k v_k(ω) / Σ π_j v_j(ω) of each lobe in the density, and that density. All shares are 0 where the
    /// density is.
    #[inline]
    pub(crate) fn shares(&self, direction: Vec3A) -> (PerLobe, f32) {
        let mut shares = PerLobe::ZERO;
        let mut sums = Lanes::splat(0.0);
        for g in 0..groups_of(self.len) {
            shares.0[g] = self.group(g).terms(direction);
            sums = sums + shares.0[g];
        }
        let pdf = sums.sum();
        shares.scale(1.0 / pdf.max(f32::MIN_POSITIVE));
        (shares, pdf)
    }

    /// The direction of the point `u` in [0, 1)²; `u.x` also chooses the lobe.
    #[inline]
    pub fn sample(&self, u: Vec2) -> DirectionAndPdf {
        let direction = match self.choose(u.x) {
            Some((k, u_x)) => self.lobe(k).1.sample(Vec2::new(u_x, u.y)),
            None => tyndall_math::sampling::uniform_sphere(u),
        };
        DirectionAndPdf { direction, pdf: self.pdf(direction) }
    }

    /// The lobe `u` falls on and where in it, in [0, 1).
    #[inline]
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

/// Makes weights sum to 1, as those of mixtures do.
pub(crate) fn normalise<'a>(weights: impl ExactSizeIterator<Item = &'a mut f32>) {
    let weights: Vec<_> = weights.collect();
    let scale = normalising(weights.iter().map(|weight| f64::from(**weight)).sum());
    weights.into_iter().for_each(|weight| *weight *= scale);
}

/// What normalises weights of this sum.
#[inline]
fn normalising(total: f64) -> f32 {
    (1.0 / total.max(f64::from(f32::MIN_POSITIVE))) as f32
}

/// Broad lobes evenly over the sphere.
fn spread_lobes(n: usize) -> impl Iterator<Item = (f32, VmfLobe)> {
    let golden = TAU * 0.618_034;
    (0..n).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f32 / n as f32;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (golden * i as f32).sin_cos();
        (1.0, VmfLobe::new(Vec3A::new(r * cos, r * sin, z), INITIAL_KAPPA))
    })
}

/// `offset / width`, below 1 despite rounding.
fn rescale(offset: f32, width: f32) -> f32 {
    (offset / width.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0 - f32::EPSILON / 2.0)
}

#[cfg(test)]
#[path = "mixture_tests.rs"]
mod tests;

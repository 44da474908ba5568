//! The sums that a mixture is fitted from, and the maximisation step.
//!
//! Priors keep lobes without samples alive and broad (maximum a posteriori): each lobe's weight gets 0.01
//! pseudo-samples, its mean cosine 0.02 pseudo-samples of value 0. The latter are held against the lobe's *effective*
//! number of samples (Σw)²/Σw² (Kish 1965), so that a single outlier makes a lobe of eight degrees however large it is.
//! The published strength is 0.2, against all samples; against effective ones it hides small lights for many passes
//! (`examples/guided_balls.rs`: twice the variance).

use super::assign::Assigner;
use super::lanes::{Lanes, PerLobe};
use super::mixture::VmfMixture;
use super::sums::LobeSums;
use super::vmf::{VmfLobe, concentration_from_mean_cosine};
use glam::Vec3A;

/// Pseudo-samples of each lobe's weight.
pub(super) const WEIGHT_PRIOR: f32 = 0.01;
/// Pseudo-samples of mean cosine 0 in each lobe.
pub(super) const MEAN_COSINE_PRIOR: f32 = 0.02;
/// The least weight of a uniform lobe, so that no direction is impossible.
pub(super) const BACKGROUND_WEIGHT: f32 = 0.01;
/// Samples per partial sum: f32 sums stay precise, and the order is fixed whatever the threads.
const CHUNK: usize = 4096;
/// Weights that count, so that their squares can be summed in f32.
const WEIGHT_RANGE: (f32, f32) = (1e-18, 1e14);

// The sums of each lobe: Σγw, Σγw², Σγw·ω, Σγw/distance.
const WEIGHT: usize = 0;
const SQUARE: usize = 1;
const MEAN: [usize; 3] = [2, 3, 4];
const INVERSE_DISTANCE: usize = 5;

/// A direction from which light came, and how much: radiance over the density it was sampled with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionSample {
    /// Unit vector.
    pub direction: Vec3A,
    /// At least 1e-18, cut at 1e14; samples of less weight are ignored.
    pub weight: f32,
    /// 1 / distance to where the light came from; 0 for infinitely far.
    pub inverse_distance: f32,
}

impl DirectionSample {
    pub(crate) fn is_usable(&self) -> bool {
        self.weight.is_finite() && self.weight >= WEIGHT_RANGE.0 && self.direction.is_finite()
    }
}

/// What expectation leaves of the samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SufficientStatistics {
    sums: LobeSums<{ Self::ROWS }>,
    /// Σ weight · ln pdf.
    log_likelihood: f32,
    total_weight: f32,
    n: f32,
}

impl SufficientStatistics {
    /// Sums of each lobe.
    pub(crate) const ROWS: usize = 6;

    /// Expectation: assigns each sample softly to the lobes of `mixture`. Samples without a usable weight or direction
    /// are skipped.
    pub fn from_samples(mixture: &VmfMixture, samples: &[DirectionSample]) -> Self {
        let assigner = Assigner::new(mixture);
        let mut total = Self::default();
        for chunk in samples.chunks(CHUNK) {
            let mut sums = Self::default();
            chunk.iter().filter(|s| s.is_usable()).for_each(|s| sums.add(&assigner, s));
            total.merge(&sums);
        }
        total
    }

    #[inline]
    fn add(&mut self, assigner: &Assigner<'_>, sample: &DirectionSample) {
        let Some(assignment) = assigner.assign(sample.direction) else { return };
        let (w, d) = (sample.weight.min(WEIGHT_RANGE.1), sample.direction);
        let values = [w, w * w, w * d.x, w * d.y, w * d.z, w * sample.inverse_distance];
        self.sums.add(&assignment.shares, assigner.n_groups(), &values);
        self.log_likelihood += w * assignment.log_pdf;
        self.total_weight += w;
        self.n += 1.0;
    }

    /// Counts `n` samples that saw no light: they make the mean darker, not the mixture.
    pub(crate) fn count_dark(&mut self, n: usize) {
        self.n += n as f32;
    }

    /// Adds the samples of `other`, assigned to the same lobes.
    pub fn merge(&mut self, other: &Self) {
        self.sums.merge(&other.sums);
        self.add_totals(other);
    }

    /// Adds only the sums over all lobes.
    pub(crate) fn add_totals(&mut self, other: &Self) {
        self.log_likelihood += other.log_likelihood;
        self.total_weight += other.total_weight;
        self.n += other.n;
    }

    /// Weakens what was learned to `factor` in [0, 1] of its samples.
    pub fn decay(&mut self, factor: f32) {
        let factor = if factor.is_nan() { 0.0 } else { factor.clamp(0.0, 1.0) };
        self.sums.scale(factor);
        self.log_likelihood *= factor;
        self.total_weight *= factor;
        self.n *= factor;
    }

    /// What [`Self::from_parts`] restores: the sums of each lobe, and those over all.
    pub(crate) fn parts(&self) -> (&[PerLobe; Self::ROWS], [f32; 3]) {
        (&self.sums.0, [self.log_likelihood, self.total_weight, self.n])
    }

    pub(crate) fn from_parts(sums: [PerLobe; Self::ROWS], totals: [f32; 3]) -> Self {
        let [log_likelihood, total_weight, n] = totals;
        Self { sums: LobeSums(sums), log_likelihood, total_weight, n }
    }

    /// Number of samples (a weight after decay).
    pub fn n_samples(&self) -> f32 {
        self.n
    }

    /// Σ weight / n: the estimate of the light from all directions, ∫ L dω.
    pub(crate) fn mean_weight(&self) -> f32 {
        if self.n > 0.0 { self.total_weight / self.n } else { 0.0 }
    }

    /// Σw and Σw² over all samples.
    pub(crate) fn weights(&self) -> [f64; 2] {
        [f64::from(self.total_weight), self.sums.0[SQUARE].total()]
    }

    /// Share of lobe `k` in the weight of all samples.
    pub(crate) fn share(&self, k: usize) -> f32 {
        if self.total_weight > 0.0 { self.sums.0[WEIGHT][k] / self.total_weight } else { 0.0 }
    }

    /// Mean of lobe `k`'s samples: a vector no longer than 1, which is zero without samples.
    pub(crate) fn mean_direction(&self, k: usize) -> Vec3A {
        let weight = self.sums.0[WEIGHT][k];
        let sum = Vec3A::from(MEAN.map(|i| self.sums.0[i][k]));
        if weight > 0.0 { (sum / weight).clamp_length_max(1.0) } else { Vec3A::ZERO }
    }

    /// Effective number of samples of lobe `k`.
    pub(crate) fn effective_count(&self, k: usize) -> f32 {
        effective_count(self.sums.0[WEIGHT][k].into(), self.sums.0[SQUARE][k].into())
    }

    /// Σ weight·ln pdf / Σ weight under the mixture the samples were assigned by; 0 without samples.
    pub fn mean_log_likelihood(&self) -> f32 {
        if self.total_weight > 0.0 { self.log_likelihood / self.total_weight } else { 0.0 }
    }

    /// Maximisation: the mixture these sums and the priors ask for. `mixture` is the one the samples were assigned by
    /// and is returned unchanged if there are none, or if their weights were too large to be summed. Lobes of
    /// concentration 0 stay uniform.
    pub fn maximise(&self, mixture: &VmfMixture) -> VmfMixture {
        let n = self.n;
        let [sum, squares] = self.weights();
        if effective_count(sum, squares) == 0.0 {
            return mixture.clone();
        }
        // Weights count relative to their sum, so that radiance has no unit and priors are in samples.
        let total = n + mixture.len() as f32 * WEIGHT_PRIOR;
        let lobe = |(k, (_, old)): (usize, (f32, VmfLobe))| {
            let weight = (self.share(k) * n + WEIGHT_PRIOR) / total;
            if old.kappa() == 0.0 {
                (weight.max(BACKGROUND_WEIGHT), old)
            } else {
                (weight, self.maximise_lobe(k, &old))
            }
        };
        VmfMixture::from_lobes(mixture.lobes().enumerate().map(lobe))
    }

    fn maximise_lobe(&self, k: usize, old: &VmfLobe) -> VmfLobe {
        let (mean, n) = (self.mean_direction(k), self.effective_count(k));
        let mean_cosine = mean.length() * n / (n + MEAN_COSINE_PRIOR);
        // A lobe must not become uniform, and stay that, by chance.
        let kappa = concentration_from_mean_cosine(mean_cosine).max(1e-3);
        VmfLobe::new(mean.try_normalize().unwrap_or(old.mean()), kappa)
    }

    /// Harmonic mean of the distances seen in each lobe, inverted; 0 for infinitely far or not seen.
    pub(crate) fn inverse_distances(&self) -> PerLobe {
        let mut inverse = PerLobe::ZERO;
        for (g, group) in inverse.0.iter_mut().enumerate() {
            let mean = self.sums.0[INVERSE_DISTANCE].0[g] / self.sums.0[WEIGHT].0[g];
            *group = Lanes(mean.0.map(|mean| if mean.is_finite() { mean } else { 0.0 }));
        }
        inverse
    }

    /// Gives half of lobe `from` to the new lobe `to`, each as if its samples lay around its own new lobe.
    pub(crate) fn split(&mut self, from: usize, to: usize) {
        self.sums.halve(from, to);
    }

    /// Re-aims the directional sum of lobe `k` as if all its samples lay around `lobe`.
    pub(crate) fn aim(&mut self, k: usize, lobe: &VmfLobe) {
        let resultant = lobe.mean() * (super::mean_cosine(lobe.kappa()) * self.sums.0[WEIGHT][k]);
        MEAN.iter().zip(resultant.to_array()).for_each(|(&i, v)| self.sums.0[i][k] = v);
    }
}

/// (Σw)²/Σw²; 0 if there is none, or if the sums overflowed, else at least 1: what was seen is not forgotten by decay.
fn effective_count(weight: f64, squares: f64) -> f32 {
    let n = (weight * weight / squares) as f32;
    if n.is_finite() && n > 0.0 { n.max(1.0) } else { 0.0 }
}

//! Weighted expectation maximisation with priors.
//!
//! Source: Vorba et al. 2014, "On-line Learning of Parametric Mixture Models for Light Transport Simulation", ACM TOG
//! 33(4), in the form of Herholz et al. 2019 for von Mises–Fisher lobes: the sums below are all that is kept of the
//! samples, so a fit can go on with later ones.
//!
//! Priors keep lobes without samples alive and broad: each lobe's weight gets 0.01 pseudo-samples, its mean cosine
//! 0.2 pseudo-samples of value 0.

use super::mixture::{MAX_LOBES, VmfMixture};
use super::vmf::{VmfLobe, concentration_from_mean_cosine};
use glam::Vec3A;

/// Pseudo-samples of each lobe's weight.
const WEIGHT_PRIOR: f32 = 0.01;
/// Pseudo-samples of mean cosine 0 in each lobe.
const MEAN_COSINE_PRIOR: f32 = 0.2;
/// Growth of the mean log-likelihood, relative to it or to one nat, below which a fit has converged.
const TOLERANCE: f32 = 0.005;
const MAX_ITERATIONS: usize = 100;
/// Samples per partial sum: f32 sums stay precise, and the order is fixed whatever the threads.
const CHUNK: usize = 4096;

/// A direction from which light came, and how much: radiance over the density it was sampled with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionSample {
    /// Unit vector.
    pub direction: Vec3A,
    /// Positive; samples whose weight is not are ignored.
    pub weight: f32,
}

impl DirectionSample {
    fn is_usable(&self) -> bool {
        self.weight.is_finite() && self.weight > 0.0 && self.direction.is_finite()
    }
}

/// What expectation leaves of the samples: per lobe Σγ·weight and Σγ·weight·ω.
#[derive(Debug, Clone, PartialEq)]
pub struct SufficientStatistics {
    weight: [f32; MAX_LOBES],
    direction: [Vec3A; MAX_LOBES],
    /// Σ weight · ln pdf.
    log_likelihood: f32,
    total_weight: f32,
    n: f32,
}

impl Default for SufficientStatistics {
    fn default() -> Self {
        let (weight, direction) = ([0.0; MAX_LOBES], [Vec3A::ZERO; MAX_LOBES]);
        Self { weight, direction, log_likelihood: 0.0, total_weight: 0.0, n: 0.0 }
    }
}

impl SufficientStatistics {
    /// Expectation: assigns each sample softly to the lobes of `mixture`. Samples without a usable weight or direction
    /// are skipped.
    pub fn from_samples(mixture: &VmfMixture, samples: &[DirectionSample]) -> Self {
        let log_peaks = mixture.log_peaks();
        let mut total = Self::default();
        for chunk in samples.chunks(CHUNK) {
            let mut sums = Self::default();
            chunk.iter().filter(|s| s.is_usable()).for_each(|s| sums.add(mixture, &log_peaks, s));
            total.merge(&sums);
        }
        total
    }

    fn add(&mut self, mixture: &VmfMixture, log_peaks: &[f32; MAX_LOBES], sample: &DirectionSample) {
        // Relative to the largest term: a sample far from every lobe still belongs to the nearest.
        let terms = mixture.log_terms(log_peaks, sample.direction);
        let largest = terms.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if !largest.is_finite() {
            return;
        }
        let scaled = terms.map(|t| (t - largest).exp());
        let sum: f32 = scaled.iter().sum();
        for (k, gamma) in scaled[..mixture.len()].iter().enumerate() {
            let share = sample.weight * (gamma / sum);
            self.weight[k] += share;
            self.direction[k] += sample.direction * share;
        }
        self.log_likelihood += sample.weight * (largest + sum.ln());
        self.total_weight += sample.weight;
        self.n += 1.0;
    }

    /// Adds the samples of `other`, assigned to the same lobes.
    pub fn merge(&mut self, other: &Self) {
        for k in 0..MAX_LOBES {
            self.weight[k] += other.weight[k];
            self.direction[k] += other.direction[k];
        }
        self.log_likelihood += other.log_likelihood;
        self.total_weight += other.total_weight;
        self.n += other.n;
    }

    /// Weakens what was learned to `factor` in [0, 1] of its samples.
    pub fn decay(&mut self, factor: f32) {
        let factor = if factor.is_nan() { 0.0 } else { factor.clamp(0.0, 1.0) };
        self.weight.iter_mut().for_each(|w| *w *= factor);
        self.direction.iter_mut().for_each(|d| *d *= factor);
        self.log_likelihood *= factor;
        self.total_weight *= factor;
        self.n *= factor;
    }

    /// Number of samples (a weight after decay).
    pub fn n_samples(&self) -> f32 {
        self.n
    }

    /// Σ weight·ln pdf / Σ weight under the mixture the samples were assigned by; 0 without samples.
    pub fn mean_log_likelihood(&self) -> f32 {
        if self.total_weight > 0.0 { self.log_likelihood / self.total_weight } else { 0.0 }
    }

    /// Maximisation: the mixture these sums and the priors ask for. `mixture` is the one the samples were assigned by
    /// and is returned unchanged if there are none, or if their weights were too large to be summed.
    pub fn maximise(&self, mixture: &VmfMixture) -> VmfMixture {
        // Weights count relative to their mean, so that radiance has no unit and priors are in samples.
        let scale = self.n / self.total_weight;
        if !(scale.is_finite() && scale > 0.0 && self.n > 0.0) {
            return mixture.clone();
        }
        let n_lobes = mixture.len() as f32;
        let lobe = |(k, (_, old)): (usize, (f32, VmfLobe))| {
            let (count, sum) = (self.weight[k] * scale, self.direction[k] * scale);
            let length = sum.length();
            let mean = if length.is_finite() && length > 1e-20 { sum / length } else { old.mean() };
            let kappa = concentration_from_mean_cosine(length / (count + MEAN_COSINE_PRIOR));
            let weight = (count + WEIGHT_PRIOR) / (self.n + n_lobes * WEIGHT_PRIOR);
            (weight, VmfLobe::new(mean, kappa))
        };
        VmfMixture::from_lobes(mixture.lobes().enumerate().map(lobe))
    }
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitReport {
    /// Steps made, at most 100.
    pub n_iterations: usize,
    /// Mean of ln pdf over the samples, by weight, before the last step.
    pub mean_log_likelihood: f32,
    /// Whether the last step gained less than half a per cent; false if the iterations ran out before.
    pub converged: bool,
}

/// Fits `mixture` to `samples`, starting from its present lobes.
pub fn fit(mixture: &mut VmfMixture, samples: &[DirectionSample]) -> FitReport {
    let mut before = f32::NEG_INFINITY;
    for n_iterations in 1..=MAX_ITERATIONS {
        let statistics = SufficientStatistics::from_samples(mixture, samples);
        *mixture = statistics.maximise(mixture);
        let now = statistics.mean_log_likelihood();
        let converged = now - before < TOLERANCE * now.abs().max(1.0) && n_iterations > 1;
        if converged || statistics.n_samples() == 0.0 {
            return FitReport { n_iterations, mean_log_likelihood: now, converged: true };
        }
        before = now;
    }
    FitReport { n_iterations: MAX_ITERATIONS, mean_log_likelihood: before, converged: false }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;

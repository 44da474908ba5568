//! Weighted expectation maximisation.
//!
//! Source: Vorba et al. 2014, "On-line Learning of Parametric Mixture Models for Light Transport Simulation", ACM TOG
//! 33(4), in the form of Herholz et al. 2019 for von Mises–Fisher lobes: [`SufficientStatistics`] are all that is kept of
//! the samples, so a fit can go on with later ones.

use super::mixture::VmfMixture;
use super::statistics::{DirectionSample, SufficientStatistics};

/// Growth of the mean log-likelihood, relative to it or to one nat, below which a fit has converged.
const TOLERANCE: f32 = 0.005;
const MAX_ITERATIONS: usize = 100;

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
    let nothing = SufficientStatistics::default();
    fit_incrementally(mixture, &nothing, samples, MAX_ITERATIONS).1
}

/// Fits `mixture` to `samples` and to the `earlier` ones whose sums were kept, assigned to the same lobes. Returns the sums
/// of the new samples as of the last assignment.
pub(crate) fn fit_incrementally(
    mixture: &mut VmfMixture,
    earlier: &SufficientStatistics,
    samples: &[DirectionSample],
    max_iterations: usize,
) -> (SufficientStatistics, FitReport) {
    let mut before = f32::NEG_INFINITY;
    let mut n_iterations = 0;
    loop {
        n_iterations += 1;
        let statistics = SufficientStatistics::from_samples(mixture, samples);
        let mut all = statistics.clone();
        all.merge(earlier);
        *mixture = all.maximise(mixture);
        let now = statistics.mean_log_likelihood();
        let converged = statistics.n_samples() == 0.0
            || (now - before < TOLERANCE * now.abs().max(1.0) && n_iterations > 1);
        if converged || n_iterations >= max_iterations {
            return (statistics, FitReport { n_iterations, mean_log_likelihood: now, converged });
        }
        before = now;
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;

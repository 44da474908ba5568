//! Expectation: which lobe a direction belongs to.

use super::lanes::{Lanes, PerLobe, groups_of};
use super::mixture::VmfMixture;
use glam::Vec3A;

/// Assigns directions softly to the lobes of a mixture, also where all densities are too small for f32.
pub(crate) struct Assigner<'a> {
    mixture: &'a VmfMixture,
    /// ln(π_k v_k(μ_k)); minus infinity past the last lobe.
    log_peaks: PerLobe,
    n_groups: usize,
}

/// Each lobe's share γ_k of a direction.
pub(crate) struct Assignment {
    pub(crate) shares: PerLobe,
    pub(crate) log_pdf: f32,
}

impl<'a> Assigner<'a> {
    pub(crate) fn new(mixture: &'a VmfMixture) -> Self {
        let mut log_peaks = PerLobe::splat(f32::NEG_INFINITY);
        for k in 0..mixture.len() {
            log_peaks[k] = mixture.weighted_peak[k].ln();
        }
        Self { mixture, log_peaks, n_groups: groups_of(mixture.len()) }
    }

    /// Groups of lobes that can have a share.
    #[inline]
    pub(crate) fn n_groups(&self) -> usize {
        self.n_groups
    }

    /// The shares at a unit vector; `None` if no lobe has one.
    #[inline]
    pub(crate) fn assign(&self, direction: Vec3A) -> Option<Assignment> {
        // Relative to the largest term: a sample far from every lobe still belongs to the nearest.
        let mut shares = PerLobe::ZERO;
        let mut largest = Lanes::splat(f32::NEG_INFINITY);
        for g in 0..self.n_groups {
            shares.0[g] = self.log_peaks.0[g] + self.mixture.group(g).exponents(direction);
            largest = shares.0[g].max(largest);
        }
        let largest = largest.0.into_iter().fold(f32::NEG_INFINITY, |a, b| if b > a { b } else { a });
        if !largest.is_finite() {
            return None;
        }
        let mut sums = Lanes::splat(0.0);
        for group in &mut shares.0[..self.n_groups] {
            *group = (*group - Lanes::splat(largest)).exp_nonpositive();
            sums = sums + *group;
        }
        let sum = sums.sum();
        shares.scale(1.0 / sum);
        Some(Assignment { shares, log_pdf: largest + sum.ln() })
    }
}

//! Several phase functions at one point, weighted by scattering coefficient.

use super::{Phase, PhaseSample};
use arrayvec::ArrayVec;
use glam::{Vec2, Vec3A};

/// How many different phase functions a mixture holds. A collision among more picks one of them at random, in
/// proportion to its scattering, which is unbiased (see [`crate::Segment::scatter`]).
pub const MAX_LOBES: usize = 4;

/// A convex combination of at most [`MAX_LOBES`] phase functions; equal ones are merged.
#[derive(Debug, Clone)]
pub struct PhaseMix {
    lobes: ArrayVec<(f32, Phase), MAX_LOBES>,
}

impl PhaseMix {
    /// A single phase function.
    #[inline]
    pub fn single(phase: Phase) -> Self {
        let mut lobes = ArrayVec::new();
        lobes.push((1.0, phase));
        Self { lobes }
    }

    /// A mixture with the given non-negative weights, normalised here.
    ///
    /// `None` if there is no positive weight or if more than [`MAX_LOBES`] different functions remain after merging.
    pub fn new(weighted: impl IntoIterator<Item = (f32, Phase)>) -> Option<Self> {
        let mut lobes = ArrayVec::<(f32, Phase), MAX_LOBES>::new();
        for (weight, phase) in weighted.into_iter().filter(|(weight, _)| *weight > 0.0) {
            match lobes.iter_mut().find(|(_, known)| *known == phase) {
                Some((sum, _)) => *sum += weight,
                None => lobes.try_push((weight, phase)).ok()?,
            }
        }
        let total: f32 = lobes.iter().map(|(weight, _)| weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        for (weight, _) in &mut lobes {
            *weight /= total;
        }
        Some(Self { lobes })
    }

    /// The weights, which sum to one, and their phase functions.
    #[inline]
    pub fn lobes(&self) -> &[(f32, Phase)] {
        &self.lobes
    }

    /// Density per steradian at the cosine between the directions of travel.
    #[inline]
    pub fn eval(&self, cos_theta: f32) -> f32 {
        self.lobes.iter().map(|(weight, phase)| weight * phase.eval(cos_theta)).sum()
    }

    /// Density per steradian for two unit directions of travel.
    #[inline]
    pub fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
        self.lobes.iter().map(|(weight, phase)| weight * phase.eval_between(before, after)).sum()
    }

    /// Density of [`PhaseMix::sample`]: the mixture itself.
    #[inline]
    pub fn pdf(&self, cos_theta: f32) -> f32 {
        self.eval(cos_theta)
    }

    /// Mean cosine between the directions before and after.
    #[inline]
    pub fn mean_cosine(&self) -> f32 {
        self.lobes.iter().map(|(weight, phase)| weight * phase.mean_cosine()).sum()
    }

    /// Draws a direction of travel after scattering; `travel` is the unit direction before, `u` in [0, 1)^2.
    #[inline]
    pub fn sample(&self, travel: Vec3A, u: Vec2) -> PhaseSample {
        if let [(_, phase)] = self.lobes[..] {
            return phase.sample(travel, u);
        }
        // Choose a lobe with u.x and stretch the rest of u.x over the unit interval again.
        let (mut rest, last) = (u.x, self.lobes.len() - 1);
        let mut chosen = last;
        for (i, (weight, _)) in self.lobes.iter().enumerate() {
            if rest < *weight || i == last {
                (chosen, rest) = (i, rest / weight);
                break;
            }
            rest -= weight;
        }
        let direction = self.lobes[chosen].1.sample(travel, Vec2::new(rest.min(0.999_999_94), u.y)).direction;
        let value = self.eval_between(travel, direction);
        PhaseSample { direction, value, pdf: value }
    }
}

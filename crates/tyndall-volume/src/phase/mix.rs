//! Several phase functions at one point, weighted by scattering coefficient.

use super::{HenyeyGreenstein, Isotropic, Phase, PhaseSample};
use arrayvec::ArrayVec;
use glam::{Vec2, Vec3A};

/// How many different phase functions a mixture holds. A collision among more picks one medium at random, in
/// proportion to its scattering, which is unbiased (see [`crate::Segment::scatter`]).
pub const MAX_LOBES: usize = 4;

/// What fills the places that are not used; equal mixtures are equal bit by bit.
const UNUSED: (f32, Phase) = (0.0, Phase::Isotropic(Isotropic));
/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - 0.5 * f32::EPSILON;

/// A convex combination of at most [`MAX_LOBES`] phase functions; equal ones are merged. Copied, never allocated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseMix {
    lobes: [(f32, Phase); MAX_LOBES],
    len: u32,
}

impl From<Phase> for PhaseMix {
    #[inline]
    fn from(phase: Phase) -> Self {
        Self::single(phase)
    }
}

impl PhaseMix {
    /// A single phase function.
    #[inline]
    pub const fn single(phase: Phase) -> Self {
        Self { lobes: [(1.0, phase), UNUSED, UNUSED, UNUSED], len: 1 }
    }

    /// Two functions, `second` with the part `mix` of the light, limited to [0, 1]; NaN reads as 0.
    pub fn of_two(first: Phase, second: Phase, mix: f32) -> Self {
        let mix = if mix.is_nan() { 0.0 } else { mix.clamp(0.0, 1.0) };
        Self::new([(1.0 - mix, first), (mix, second)]).unwrap_or(Self::single(first))
    }

    /// Two Henyey-Greenstein lobes with mean cosines `g` and `g2`, the second with the part `mix` of the light: a
    /// forward peak and a weaker backward one, as clouds and smoke have.
    pub fn two_lobes(g: f32, g2: f32, mix: f32) -> Self {
        Self::of_two(HenyeyGreenstein { g }.into(), HenyeyGreenstein { g: g2 }.into(), mix)
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
        let mut mix = Self { lobes: [UNUSED; MAX_LOBES], len: lobes.len() as u32 };
        for (place, (weight, phase)) in mix.lobes.iter_mut().zip(lobes) {
            *place = (weight / total, phase);
        }
        Some(mix)
    }

    /// The weights, which sum to one, and their phase functions.
    #[inline]
    pub fn lobes(&self) -> &[(f32, Phase)] {
        &self.lobes[..self.len as usize]
    }

    /// Density per steradian at the cosine between the directions of travel.
    #[inline]
    pub fn eval(&self, cos_theta: f32) -> f32 {
        self.lobes().iter().map(|(weight, phase)| weight * phase.eval(cos_theta)).sum()
    }

    /// Density per steradian for two unit directions of travel.
    #[inline]
    pub fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
        self.lobes().iter().map(|(weight, phase)| weight * phase.eval_between(before, after)).sum()
    }

    /// Density of [`PhaseMix::sample`]: the mixture itself.
    #[inline]
    pub fn pdf(&self, cos_theta: f32) -> f32 {
        self.eval(cos_theta)
    }

    /// Mean cosine between the directions before and after.
    #[inline]
    pub fn mean_cosine(&self) -> f32 {
        self.lobes().iter().map(|(weight, phase)| weight * phase.mean_cosine()).sum()
    }

    /// Draws a direction of travel after scattering; `travel` is the unit direction before, `u` in [0, 1)^2.
    #[inline]
    pub fn sample(&self, travel: Vec3A, u: Vec2) -> PhaseSample {
        if self.len == 1 {
            return self.lobes[0].1.sample(travel, u);
        }
        // Choose a lobe with u.x and stretch the rest of u.x over the unit interval again.
        let (mut rest, last) = (u.x, self.len as usize - 1);
        let mut chosen = last;
        for (i, (weight, _)) in self.lobes().iter().enumerate() {
            if rest < *weight || i == last {
                (chosen, rest) = (i, rest / weight);
                break;
            }
            rest -= weight;
        }
        let direction = self.lobes[chosen].1.sample(travel, Vec2::new(rest.min(BELOW_ONE), u.y)).direction;
        let value = self.eval_between(travel, direction);
        PhaseSample { direction, value, pdf: value }
    }
}

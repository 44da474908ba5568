//! The closed set of phase functions, and their mixture where media overlap.
//!
//! A phase function is a density over directions (per steradian) of where light travels after a scattering event.
//! Angles are measured between the directions of *travel* before and after, so `cos_theta = 1` is straight on and a
//! positive mean cosine `g` is forward scattering. Values equal the sampling density: the weight of a sample is 1.

pub mod henyey_greenstein;
mod isotropic;
mod mix;

pub use mix::{MAX_LOBES, PhaseMix};

use glam::{Vec2, Vec3A};
use tyndall_math::Frame;

/// A direction drawn from a phase function.
#[derive(Debug, Clone, Copy)]
pub struct PhaseSample {
    /// Unit direction of travel after scattering.
    pub direction: Vec3A,
    /// Phase function of that direction, per steradian.
    pub value: f32,
    /// Density with which it was drawn, per steradian; equal to `value`.
    pub pdf: f32,
}

/// One parameter of a phase function, for panels and help texts.
#[derive(Debug, Clone, Copy)]
pub struct PhaseParam {
    /// Name in scene descriptions.
    pub name: &'static str,
    /// Value when absent.
    pub default: f32,
    /// Accepted range; values outside are clamped.
    pub range: [f32; 2],
    /// One sentence.
    pub doc: &'static str,
}

/// What lists need to know about a kind.
#[derive(Debug, Clone, Copy)]
pub struct PhaseKind {
    /// Name in scene descriptions.
    pub name: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Its parameters.
    pub params: &'static [PhaseParam],
}

/// A phase function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// The same in all directions.
    Isotropic,
    /// Henyey–Greenstein with mean cosine `g`, clamped to ±0.99999; NaN reads as 0.
    HenyeyGreenstein {
        /// Mean cosine between the directions before and after.
        g: f32,
    },
}

impl Phase {
    /// Every kind.
    pub const KINDS: &'static [PhaseKind] = &[isotropic::KIND, henyey_greenstein::KIND];

    /// Density per steradian at the cosine between the directions of travel before and after.
    #[inline]
    pub fn eval(&self, cos_theta: f32) -> f32 {
        self.eval_one_minus_cos(1.0 - cos_theta)
    }

    /// Density per steradian for two unit directions of travel.
    ///
    /// More exact than [`Phase::eval`] for very forward or backward lobes, which are narrower than the rounding of a
    /// cosine near ±1.
    #[inline]
    pub fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
        match *self {
            Phase::Isotropic => isotropic::eval(),
            Phase::HenyeyGreenstein { g } => henyey_greenstein::eval_between(g, before, after),
        }
    }

    /// Draws a direction; `travel` is the unit direction of travel before, `u` in [0, 1)^2.
    #[inline]
    pub fn sample(&self, travel: Vec3A, u: Vec2) -> PhaseSample {
        let (local, value) = match *self {
            Phase::Isotropic => (tyndall_math::sampling::uniform_sphere(u), isotropic::eval()),
            Phase::HenyeyGreenstein { g } => henyey_greenstein::sample(g, u),
        };
        PhaseSample { direction: Frame::from_normal(travel).world_from_local(local), value, pdf: value }
    }

    /// Mean cosine between the directions before and after.
    #[inline]
    pub fn mean_cosine(&self) -> f32 {
        match *self {
            Phase::Isotropic => 0.0,
            Phase::HenyeyGreenstein { g } => henyey_greenstein::clamped(g),
        }
    }

    #[inline]
    fn eval_one_minus_cos(&self, one_minus_cos: f32) -> f32 {
        match *self {
            Phase::Isotropic => isotropic::eval(),
            Phase::HenyeyGreenstein { g } => henyey_greenstein::eval(g, one_minus_cos),
        }
    }
}

#[cfg(test)]
mod tests;

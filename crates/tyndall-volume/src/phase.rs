//! The closed set of phase functions, and their mixtures: of one medium, or where media overlap.
//!
//! A phase function is a density over directions (per steradian) of where light travels after a scattering event.
//! Angles are measured between the directions of *travel* before and after, so `cos_theta = 1` is straight on and a
//! positive mean cosine `g` is forward scattering. Values equal the sampling density: the weight of a sample is 1.
//!
//! Inside, angles are c = 1 - cos(theta): exact in forward peaks, where a cosine has no digits left.

mod draine;
mod droplets;
mod henyey_greenstein;
mod isotropic;
mod mix;
mod rayleigh;

pub use draine::Draine;
pub use droplets::{DropletFit, MAX_DROPLET_DIAMETER};
pub use henyey_greenstein::{G_MAX, HenyeyGreenstein};
pub use isotropic::Isotropic;
pub use mix::{MAX_LOBES, PhaseMix};
pub use rayleigh::Rayleigh;

use glam::{Vec2, Vec3A};
use std::f32::consts::TAU;
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

/// An angle drawn from a phase function.
#[derive(Debug, Clone, Copy)]
struct AngleSample {
    /// 1 - cos of the angle between the directions of travel; 1 + cos if `is_backward`.
    c: f32,
    /// The angle is measured from the way back: lobes there are as exact as forward ones.
    is_backward: bool,
    /// Density of the direction, per steradian.
    value: f32,
}

/// What a phase function answers.
trait PhaseFunction: Copy + PartialEq {
    /// Name and parameters.
    const KIND: PhaseKind;

    /// Density per steradian at 1 - cos(theta).
    fn eval(&self, one_minus_cos: f32) -> f32;

    /// Density per steradian for two unit directions of travel.
    #[inline]
    fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
        // |a - b|^2 / 2 = 1 - cos without cancellation.
        self.eval(0.5 * (before - after).length_squared())
    }

    /// Draws an angle; `u` in [0, 1).
    fn sample(&self, u: f32) -> AngleSample;

    /// Mean cosine between the directions before and after.
    fn mean_cosine(&self) -> f32;
}

macro_rules! closed_set {
    ($($(#[$doc:meta])* $kind:ident),+ $(,)?) => {
        /// A phase function.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Phase { $($(#[$doc])* $kind($kind)),+ }

        impl Phase {
            /// Every kind.
            pub const KINDS: &'static [PhaseKind] = &[$($kind::KIND),+];

            #[inline]
            fn eval_one_minus_cos(&self, one_minus_cos: f32) -> f32 {
                match self { $(Self::$kind(it) => it.eval(one_minus_cos)),+ }
            }

            /// Density per steradian for two unit directions of travel.
            ///
            /// More exact than [`Phase::eval`] for very forward or backward lobes, which are narrower than the rounding
            /// of a cosine near ±1.
            #[inline]
            pub fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
                match self { $(Self::$kind(it) => it.eval_between(before, after)),+ }
            }

            #[inline]
            fn sample_angle(&self, u: f32) -> AngleSample {
                match self { $(Self::$kind(it) => it.sample(u)),+ }
            }

            /// Mean cosine between the directions before and after.
            #[inline]
            pub fn mean_cosine(&self) -> f32 {
                match self { $(Self::$kind(it) => it.mean_cosine()),+ }
            }
        }
        $(impl From<$kind> for Phase {
            #[inline]
            fn from(it: $kind) -> Self { Self::$kind(it) }
        })+
    };
}

closed_set!(
    /// The same in all directions.
    Isotropic,
    /// One lobe, forward or backward.
    HenyeyGreenstein,
    /// Particles much smaller than the wavelength.
    Rayleigh,
    /// A lobe with a second one opposite to it.
    Draine,
);

impl Phase {
    /// [`HenyeyGreenstein`] with mean cosine `g`.
    #[inline]
    pub const fn henyey_greenstein(g: f32) -> Self {
        Self::HenyeyGreenstein(HenyeyGreenstein { g })
    }

    /// Density per steradian at the cosine between the directions of travel before and after.
    #[inline]
    pub fn eval(&self, cos_theta: f32) -> f32 {
        self.eval_one_minus_cos(1.0 - cos_theta)
    }

    /// Draws a direction; `travel` is the unit direction of travel before, `u` in [0, 1)^2.
    #[inline]
    pub fn sample(&self, travel: Vec3A, u: Vec2) -> PhaseSample {
        let AngleSample { c, is_backward, value } = self.sample_angle(u.x);
        let sin_theta = (c * (2.0 - c)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
        let cos_theta = if is_backward { c - 1.0 } else { 1.0 - c };
        let local = Vec3A::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
        PhaseSample { direction: Frame::from_normal(travel).world_from_local(local), value, pdf: value }
    }
}

#[cfg(test)]
mod tests;

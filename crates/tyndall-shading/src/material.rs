//! How surfaces scatter: the closed set of lobes, and the [`Bsdf`] a hit has.
//!
//! A new lobe is one file with one `impl Scatter` and one name in the `closed_set!` line below.

mod bsdf;
mod conductor;
mod dielectric;
mod diffuse;
mod directional_albedo;
mod frame;
mod fresnel;
mod microfacet;
mod preview_surface;

#[cfg(test)]
mod tests;

pub use bsdf::{Bsdf, MAX_LOBES};
pub use conductor::Conductor;
pub use dielectric::{Dielectric, ScatterMode};
pub use diffuse::Diffuse;
pub use frame::ShadingFrame;
pub use microfacet::Roughness;
pub use preview_surface::{OpacityMode, PreviewParams, PreviewSurface};

use frame::LocalFrame;
use glam::Vec3A;
use tyndall_math::Rgb;

/// A direction drawn by [`Bsdf::sample`].
#[derive(Debug, Clone, Copy)]
pub struct BsdfSample {
    /// `wi`: unit, away from the surface.
    pub direction: Vec3A,
    /// BSDF times |cos theta_i| over `pdf` (and over the chance of the lobe, for delta lobes).
    pub weight: Rgb,
    /// Density per steradian of all non-delta lobes together; meaningless for delta lobes.
    pub pdf: f32,
    /// The lobe scatters into a single direction.
    pub is_delta: bool,
    /// `direction` lies on the other side of the surface.
    pub is_transmission: bool,
    /// Roughness of the lobe in [0, 1]: 0 for delta lobes, 1 for diffuse ones.
    pub roughness: f32,
    /// Refractive index on the side of `direction` over that on the side of `wo`. `weight` contains `1 / eta^2`, which
    /// Russian roulette should not take for absorption.
    pub eta: f32,
}

/// The non-delta part of a BSDF for one pair of directions.
#[derive(Debug, Clone, Copy, Default)]
pub struct BsdfValue {
    /// BSDF times |cos theta_i| of diffuse lobes.
    pub diffuse: Rgb,
    /// BSDF times |cos theta_i| of glossy lobes.
    pub glossy: Rgb,
    /// Density per steradian with which the direction is sampled.
    pub pdf: f32,
}

impl BsdfValue {
    /// All lobes.
    #[inline]
    pub fn total(&self) -> Rgb {
        self.diffuse + self.glossy
    }
}

/// What a lobe answers, in the local space of a [`LocalFrame`]: z is the normal on the side of `wo`.
trait Scatter {
    /// Whether the lobe, or the part of it that `u` selects, is drawn: `wi` and the rest of the sample.
    fn sample(&self, local: &LocalFrame, wo: Vec3A, u: [f32; 3]) -> Option<LobeSample>;

    /// Value and density for `wi` on either side.
    fn evaluate(&self, local: &LocalFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue;

    /// Whether `evaluate` is zero everywhere.
    fn is_delta_only(&self) -> bool;

    /// How widely the lobe scatters.
    fn spread(&self) -> Spread;

    /// A guess of the reflected and transmitted fraction: chooses between lobes and fills the albedo AOV.
    fn albedo(&self, local: &LocalFrame, wo: Vec3A) -> Rgb;
}

/// How widely something scatters: whether it may follow where light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Spread {
    /// Into a narrow cone, or not at all.
    Narrow,
    /// Over the side it is lit from.
    Reflection,
    /// Over both sides.
    BothSides,
}

/// A direction drawn by one lobe, in its local space.
struct LobeSample {
    wi: Vec3A,
    /// For delta lobes: value over the chance of the lobe. Not used otherwise.
    delta_weight: Option<Rgb>,
    roughness: f32,
    eta: f32,
}

macro_rules! closed_set {
    ($($kind:ident),+ $(,)?) => {
        /// One way of scattering.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Lobe {
            $(#[allow(missing_docs, reason = "the type of the same name is documented")] $kind($kind)),+
        }

        impl Lobe {
            fn sample(&self, local: &LocalFrame, wo: Vec3A, u: [f32; 3]) -> Option<LobeSample> {
                match self { $(Self::$kind(it) => it.sample(local, wo, u)),+ }
            }

            fn evaluate(&self, local: &LocalFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue {
                match self { $(Self::$kind(it) => it.evaluate(local, wo, wi)),+ }
            }

            fn is_delta_only(&self) -> bool {
                match self { $(Self::$kind(it) => it.is_delta_only()),+ }
            }

            fn spread(&self) -> Spread {
                match self { $(Self::$kind(it) => it.spread()),+ }
            }

            fn albedo(&self, local: &LocalFrame, wo: Vec3A) -> Rgb {
                match self { $(Self::$kind(it) => it.albedo(local, wo)),+ }
            }
        }
        $(impl From<$kind> for Lobe { fn from(it: $kind) -> Self { Self::$kind(it) } })+
    };
}

closed_set!(Diffuse, Dielectric, Conductor, PreviewSurface);

/// A colour with every channel in [0, 1]; NaN is 0.
#[inline]
pub(crate) fn unit_color(c: Rgb) -> Rgb {
    Rgb::new(unit(c.x), unit(c.y), unit(c.z))
}

/// A number in [0, 1]; NaN is 0.
#[inline]
pub(crate) fn unit(x: f32) -> f32 {
    limited(x, 1.0)
}

/// A number in [0, `max`]; NaN is 0.
#[inline]
pub(crate) fn limited(x: f32, max: f32) -> f32 {
    if x > 0.0 { x.min(max) } else { 0.0 }
}

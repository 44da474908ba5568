//! Henyey & Greenstein 1941, "Diffuse radiation in the galaxy", doi:10.1086/144246.
//!
//! p(cos) = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)). Written here in c = 1 - cos for |g|, with the lobe mirrored
//! for g < 0: 1 + g^2 - 2 g cos = (1 - g)^2 + 2 g c. Neither evaluation nor sampling divides by g or subtracts nearly
//! equal numbers, so g = 1e-9 and |g| = 0.99999 are as exact as g = 0.5.

use super::{AngleSample, PhaseFunction, PhaseKind, PhaseParam};
use glam::Vec3A;
use tyndall_math::INV_4PI;

/// Largest |g|: beyond it a lobe is narrower than f32 directions resolve.
pub const G_MAX: f32 = 0.99999;

/// The parameter of every kind with a lobe.
pub(super) const G: PhaseParam = PhaseParam {
    name: "g",
    default: 0.0,
    range: [-G_MAX, G_MAX],
    doc: "Mean cosine: 0 isotropic, towards 1 forward, towards -1 backward.",
};

/// One lobe with mean cosine `g`, clamped to ±[`G_MAX`]; NaN reads as 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HenyeyGreenstein {
    /// Mean cosine between the directions before and after.
    pub g: f32,
}

impl PhaseFunction for HenyeyGreenstein {
    const KIND: PhaseKind = PhaseKind {
        name: "henyey_greenstein",
        doc: "One forward or backward lobe of given mean cosine.",
        params: &[G],
    };

    #[inline]
    fn eval(&self, one_minus_cos: f32) -> f32 {
        let g = clamped(self.g);
        lobe(g.abs(), if g < 0.0 { 2.0 - one_minus_cos } else { one_minus_cos })
    }

    #[inline]
    fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
        let g = clamped(self.g);
        lobe(g.abs(), from_peak(g, before, after))
    }

    #[inline]
    fn sample(&self, u: f32) -> AngleSample {
        let g = clamped(self.g);
        let c = quantile(g.abs(), u);
        AngleSample { c, is_backward: g < 0.0, value: lobe(g.abs(), c) }
    }

    #[inline]
    fn mean_cosine(&self) -> f32 {
        clamped(self.g)
    }
}

/// `g` as used: clamped to ±[`G_MAX`], NaN as 0.
#[inline]
pub(super) fn clamped(g: f32) -> f32 {
    if g.is_nan() { 0.0 } else { g.clamp(-G_MAX, G_MAX) }
}

/// 1 - cos of the angle to the lobe's peak, which is `before` mirrored for g < 0; exact in the peak.
#[inline]
pub(super) fn from_peak(g: f32, before: Vec3A, after: Vec3A) -> f32 {
    // 1 - cos = |a - b|^2 / 2 has no cancellation; the mirrored lobe wants 1 + cos = |a + b|^2 / 2.
    let chord = if g < 0.0 { before + after } else { before - after };
    0.5 * chord.length_squared()
}

/// The forward lobe, 0 <= g < 1, c = 1 - cos.
#[inline]
pub(super) fn lobe(g: f32, c: f32) -> f32 {
    let d = (1.0 - g) * (1.0 - g) + 2.0 * g * c.max(0.0);
    INV_4PI * (1.0 - g) * (1.0 + g) / (d * d.sqrt())
}

/// The c = 1 - cos below which the forward lobe, 0 <= g < 1, holds the part `u` of its light.
///
/// Inverting the distribution function: c = 2 u (1-g)^2 (1 + g - g u) / D^2, D = (1 - g) + 2 g (1 - u).
#[inline]
pub(super) fn quantile(g: f32, u: f32) -> f32 {
    let narrow = (1.0 - g) / ((1.0 - g) + 2.0 * g * (1.0 - u));
    (2.0 * u * narrow * narrow * (1.0 + g - g * u)).min(2.0)
}

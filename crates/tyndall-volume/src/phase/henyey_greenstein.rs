//! Henyey & Greenstein 1941, "Diffuse radiation in the galaxy", doi:10.1086/144246.
//!
//! p(cos) = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)). Written here in c = 1 - cos for |g|, with the lobe mirrored
//! for g < 0: 1 + g^2 - 2 g cos = (1 - g)^2 + 2 g c. Neither evaluation nor sampling divides by g or subtracts nearly
//! equal numbers, so g = 1e-9 and |g| = 0.99999 are as exact as g = 0.5.

use super::{PhaseKind, PhaseParam};
use glam::{Vec2, Vec3A};
use std::f32::consts::TAU;
use tyndall_math::INV_4PI;

/// Largest |g|: beyond it a lobe is narrower than f32 directions resolve.
pub const G_MAX: f32 = 0.99999;

pub(super) const KIND: PhaseKind = PhaseKind {
    name: "henyey_greenstein",
    doc: "One forward or backward lobe of given mean cosine.",
    params: &[PhaseParam {
        name: "g",
        default: 0.0,
        range: [-G_MAX, G_MAX],
        doc: "Mean cosine: 0 isotropic, towards 1 forward, towards -1 backward.",
    }],
};

/// `g` as used: clamped to ±[`G_MAX`], NaN as 0.
#[inline]
pub fn clamped(g: f32) -> f32 {
    if g.is_nan() { 0.0 } else { g.clamp(-G_MAX, G_MAX) }
}

/// Density per steradian at 1 - cos(theta).
#[inline]
pub fn eval(g: f32, one_minus_cos: f32) -> f32 {
    let g = clamped(g);
    lobe(g.abs(), if g < 0.0 { 2.0 - one_minus_cos } else { one_minus_cos })
}

/// Density per steradian for two unit directions of travel; exact in the lobe's peak.
#[inline]
pub fn eval_between(g: f32, before: Vec3A, after: Vec3A) -> f32 {
    let g = clamped(g);
    // 1 - cos = |a - b|^2 / 2 has no cancellation; the mirrored lobe wants 1 + cos = |a + b|^2 / 2.
    let chord = if g < 0.0 { before + after } else { before - after };
    lobe(g.abs(), 0.5 * chord.length_squared())
}

/// A direction around +z (the direction of travel before) and its density.
///
/// Inverting the distribution function in u: c = 2 u (1-g)^2 (1 + g - g u) / D^2, D = (1 - g) + 2 g (1 - u).
#[inline]
pub fn sample(g: f32, u: Vec2) -> (Vec3A, f32) {
    let g = clamped(g);
    let a = g.abs();
    let narrow = (1.0 - a) / ((1.0 - a) + 2.0 * a * (1.0 - u.x));
    let c = (2.0 * u.x * narrow * narrow * (1.0 + a - a * u.x)).min(2.0);
    let sin_theta = (c * (2.0 - c)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
    let z = if g < 0.0 { c - 1.0 } else { 1.0 - c };
    (Vec3A::new(sin_theta * cos_phi, sin_theta * sin_phi, z), lobe(a, c))
}

/// The forward lobe, 0 <= g < 1, c = 1 - cos.
#[inline]
fn lobe(g: f32, c: f32) -> f32 {
    let d = (1.0 - g) * (1.0 - g) + 2.0 * g * c.max(0.0);
    INV_4PI * (1.0 - g) * (1.0 + g) / (d * d.sqrt())
}

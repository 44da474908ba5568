//! Draine 2003, "Scattering by interstellar dust grains. I. Optical and ultraviolet", doi:10.1086/379118, equation 12.
//!
//! p(cos) = HG(cos) (1 + α cos^2) / N with N = 1 + α (1 + 2 g^2) / 3: Henyey-Greenstein for α = 0, Rayleigh for g = 0
//! and α = 1, Cornette-Shanks for α = 1.
//!
//! Jendersie & d'Eon 2023 (doi:10.1145/3587421.3595409) invert the distribution function in closed form. That formula
//! divides by g and α and subtracts nearly equal numbers: in f32 it loses forward peaks and small parameters. Here the
//! same function is inverted by Newton's method on a form without cancellation, to the last digits, for all parameters;
//! a test compares with the closed form in f64.

use super::henyey_greenstein::{G, clamped, from_peak, lobe, quantile};
use super::{AngleSample, PhaseFunction, PhaseKind, PhaseParam};
use glam::Vec3A;

/// Largest α: above it the cosine squared is all there is.
const ALPHA_MAX: f32 = 1e6;
/// Newton's method needs three to six steps; the bracket makes sure that it ends.
const MAX_STEPS: u32 = 32;

/// A Henyey-Greenstein lobe times 1 + α cos^2.
///
/// `g` is clamped to ±[`super::G_MAX`], `alpha` to [0, 1e6]; NaN reads as 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draine {
    /// Of the Henyey-Greenstein factor: not the mean cosine, unless `alpha` is 0.
    pub g: f32,
    /// Strength of the cosine squared.
    pub alpha: f32,
}

impl PhaseFunction for Draine {
    const KIND: PhaseKind = PhaseKind {
        name: "draine",
        doc: "A Henyey-Greenstein lobe times 1 + alpha cos^2.",
        params: &[
            PhaseParam { doc: "Anisotropy of the Henyey-Greenstein factor.", ..G },
            PhaseParam {
                name: "alpha",
                default: 1.0,
                range: [0.0, ALPHA_MAX],
                doc: "0 is Henyey-Greenstein, 1 Cornette-Shanks (Rayleigh for g = 0).",
            },
        ],
    };

    #[inline]
    fn eval(&self, one_minus_cos: f32) -> f32 {
        let (g, alpha) = self.clamped();
        peaked(g.abs(), alpha, if g < 0.0 { 2.0 - one_minus_cos } else { one_minus_cos })
    }

    #[inline]
    fn eval_between(&self, before: Vec3A, after: Vec3A) -> f32 {
        let (g, alpha) = self.clamped();
        peaked(g.abs(), alpha, from_peak(g, before, after))
    }

    #[inline]
    fn sample(&self, u: f32) -> AngleSample {
        let (g, alpha) = self.clamped();
        let c = Forward::new(g.abs(), alpha).quantile(u);
        AngleSample { c, is_backward: g < 0.0, value: peaked(g.abs(), alpha, c) }
    }

    /// Jendersie & d'Eon 2023, equation 3.
    #[inline]
    fn mean_cosine(&self) -> f32 {
        let (g, alpha) = self.clamped();
        g * (1.0 + alpha * (3.0 + 2.0 * g * g) / 5.0) / norm(g, alpha)
    }
}

impl Draine {
    #[inline]
    fn clamped(&self) -> (f32, f32) {
        (clamped(self.g), if self.alpha.is_nan() { 0.0 } else { self.alpha.clamp(0.0, ALPHA_MAX) })
    }
}

#[inline]
fn norm(g: f32, alpha: f32) -> f32 {
    1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0
}

/// Density with the peak at c = 0, 0 <= g < 1.
#[inline]
fn peaked(g: f32, alpha: f32, c: f32) -> f32 {
    let cos = 1.0 - c;
    lobe(g, c) * ((1.0 + alpha * cos * cos) / norm(g, alpha))
}

/// The distribution function of the forward lobe, in terms of that of its Henyey-Greenstein factor, v.
struct Forward {
    g: f32,
    alpha: f32,
    norm: f32,
}

impl Forward {
    fn new(g: f32, alpha: f32) -> Self {
        Self { g, alpha, norm: norm(g, alpha) }
    }

    /// The c = 1 - cos below which the lobe holds the part `u` of its light.
    ///
    /// dF/dv = (1 + α cos^2) / N lies between 1/N and (1 + α)/N: that brackets v, and makes Newton's method safe.
    fn quantile(&self, u: f32) -> f32 {
        let peak = self.norm / (1.0 + self.alpha);
        let (mut low, mut high) = (u * peak, (u * self.norm).min(1.0));
        // The peak, where the lower bound is exact, holds most of the light of a narrow lobe.
        let mut v = (low + (high - low) * u * (1.0 - self.g)).min(high);
        for _ in 0..MAX_STEPS {
            let c = quantile(self.g, v);
            let excess = self.distribution(v, c) - u;
            if excess > 0.0 {
                high = v;
            } else {
                low = v;
            }
            let cos = 1.0 - c;
            let next = v - excess * self.norm / (1.0 + self.alpha * cos * cos);
            let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
            let step = (next - v).abs();
            v = next;
            if step <= f32::EPSILON * v {
                break;
            }
        }
        quantile(self.g, v)
    }

    /// F(c) = v (1 + α B / 4) / N, where v B / 4 = ∫ cos^2 dv up to c and, with s0 = 1 - g, s = |travel - g after|,
    /// B = (2 - c)^2 + 2 c^2 / (s + s0)^2 (1 + g^2 - s s0 / 3 + g (2 - c)): a sum of positive terms.
    #[inline]
    fn distribution(&self, v: f32, c: f32) -> f32 {
        let (g, s0) = (self.g, 1.0 - self.g);
        let s = (s0 * s0 + 2.0 * g * c).sqrt();
        let (back, ratio) = (2.0 - c, c / (s + s0));
        let b = back * back + 2.0 * ratio * ratio * (1.0 + g * g - s * s0 / 3.0 + g * back);
        v * (1.0 + 0.25 * self.alpha * b) / self.norm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form of Jendersie & d'Eon 2023 (their listing), in f64.
    fn closed_form(g: f64, a: f64, xi: f64) -> f64 {
        let (g2, g3, g4, g6) = (g * g, g.powi(3), g.powi(4), g.powi(6));
        let pgp1_2 = (1.0 + g2).powi(2);
        let t1a = -a + a * g4;
        let t2 = -1296.0 * (-1.0 + g2) * (a - a * g2) * t1a * (4.0 * g2 + a * pgp1_2);
        let up = -1.0 + 2.0 * xi;
        let t3 = 3.0 * g2 * (1.0 + g * up) + a * (2.0 + g2 + g3 * (1.0 + 2.0 * g2) * up);
        let t4a = 432.0 * t1a.powi(3) + t2 + 432.0 * (a - a * g2) * t3 * t3;
        let t4b = -144.0 * a * g2 + 288.0 * a * g4 - 144.0 * a * g6;
        let t4 = t4a + (-4.0 * t4b.powi(3) + t4a * t4a).sqrt();
        let (t4p3, cube_root_2) = (t4.cbrt(), 2f64.cbrt());
        let t6 = (2.0 * t1a
            + 48.0 * cube_root_2 * (-(a * g2) + 2.0 * a * g4 - a * g6) / t4p3
            + t4p3 / (3.0 * cube_root_2))
            / (a - a * g2);
        let t5 = 6.0 * (1.0 + g2) + t6;
        let root = (6.0 * (1.0 + g2) - 8.0 * t3 / (a * (-1.0 + g2) * t5.sqrt()) - t6).sqrt();
        (1.0 + g2 - (-0.5 * t5.sqrt() + root / 2.0).powi(2)) / (2.0 * g)
    }

    #[test]
    fn samples_are_those_of_the_closed_form() {
        for (g, alpha) in [(0.5f32, 1.0f32), (0.8, 30.0), (0.3, 250.0), (0.55, 20.0), (0.95, 2.0)] {
            for i in 0..200 {
                let xi = (f64::from(i) + 0.5) / 200.0;
                // Their xi runs from the back of the lobe to its peak.
                let expected = closed_form(f64::from(g), f64::from(alpha), xi);
                let cos = 1.0 - f64::from(Draine { g, alpha }.sample((1.0 - xi) as f32).c);
                assert!((cos - expected).abs() < 2e-5, "{g} {alpha} {xi}: {cos} for {expected}");
            }
        }
    }

    /// F(quantile(u)) = u to the rounding of f32, for parameters of all sizes.
    #[test]
    fn the_inverse_is_exact() {
        for g in [0.0, 1e-9, 1e-4, 0.3, 0.7, 0.99, 0.9999, 0.99999] {
            for alpha in [0.0, 1e-9, 1e-3, 1.0, 30.0, 250.0, 1e6] {
                let lobe = Forward::new(g, alpha);
                for u in [0.0, 1e-20, 1e-12, 1e-6, 1e-3, 0.1, 0.3, 0.5, 0.51, 0.7, 0.9, 0.999, 0.999_999_9] {
                    let c = lobe.quantile(u);
                    // v from c, in f64: (1 + g) c / (s (s + 1 - g)).
                    let (g, c64, s0) = (f64::from(g), f64::from(c), 1.0 - f64::from(g));
                    let s = (s0 * s0 + 2.0 * g * c64).sqrt();
                    let v = (1.0 + g) * c64 / (s * (s + s0));
                    let found = f64::from(lobe.distribution(v as f32, c));
                    // One rounding of c moves F by density times rounding.
                    let density = f64::from(peaked(lobe.g, alpha, c)) * std::f64::consts::TAU;
                    let tolerance = 2e-6 * f64::from(u) + 2.0 * density * f64::from(f32::EPSILON) * c64;
                    assert!((found - f64::from(u)).abs() <= tolerance + 1e-37, "{g} {alpha} {u}: {found}");
                }
            }
        }
    }
}

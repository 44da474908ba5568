//! Rayleigh scattering of unpolarised light by particles much smaller than the wavelength: p(cos) = 3 (1 + cos^2) /
//! (16 pi). The dependence on wavelength is the business of the coefficients.

use super::{AngleSample, PhaseFunction, PhaseKind};
use tyndall_math::INV_4PI;

/// Particles much smaller than the wavelength: air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh;

impl PhaseFunction for Rayleigh {
    const KIND: PhaseKind = PhaseKind {
        name: "rayleigh",
        doc: "Particles much smaller than the wavelength: forward and backward alike, half as much sideways.",
        params: &[],
    };

    #[inline]
    fn eval(&self, one_minus_cos: f32) -> f32 {
        let cos = 1.0 - one_minus_cos;
        0.75 * INV_4PI * (1.0 + cos * cos)
    }

    /// Inverts u = (4 - 3 cos - cos^3) / 8 (Frisvad 2011, "Importance sampling the Rayleigh phase function",
    /// doi:10.1364/JOSAA.28.002436).
    #[inline]
    fn sample(&self, u: f32) -> AngleSample {
        let a = 2.0 - 4.0 * u;
        // Of the roots a ± sqrt(a^2 + 1) take the one without cancellation; cos has the sign of a.
        let root = (a.abs() + (a * a + 1.0).sqrt()).cbrt();
        let cos = (root - root.recip()).copysign(a).clamp(-1.0, 1.0);
        AngleSample { c: 1.0 - cos, is_backward: false, value: self.eval(1.0 - cos) }
    }

    #[inline]
    fn mean_cosine(&self) -> f32 {
        0.0
    }
}

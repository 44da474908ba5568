//! The constant phase function 1 / (4 pi).

use super::{AngleSample, PhaseFunction, PhaseKind};
use tyndall_math::INV_4PI;

/// The same in all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Isotropic;

impl PhaseFunction for Isotropic {
    const KIND: PhaseKind =
        PhaseKind { name: "isotropic", doc: "Scatters equally in all directions.", params: &[] };

    #[inline]
    fn eval(&self, _: f32) -> f32 {
        INV_4PI
    }

    #[inline]
    fn sample(&self, u: f32) -> AngleSample {
        AngleSample { c: 2.0 * u, is_backward: false, value: INV_4PI }
    }

    #[inline]
    fn mean_cosine(&self) -> f32 {
        0.0
    }
}

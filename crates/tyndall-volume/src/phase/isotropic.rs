//! The constant phase function 1 / (4 pi).

use super::PhaseKind;
use tyndall_math::INV_4PI;

pub(super) const KIND: PhaseKind =
    PhaseKind { name: "isotropic", doc: "Scatters equally in all directions.", params: &[] };

#[inline]
pub(super) fn eval() -> f32 {
    INV_4PI
}

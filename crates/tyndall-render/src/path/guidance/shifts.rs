//! Stratified numbers that guides answer to.

use tyndall_math::random::Pcg;

/// Tells the numbers of [`Shifts`] from all others.
const PURPOSE: u64 = u64::MAX - 1;

/// Shifts of stratified numbers, modulo 1 (Cranley & Patterson 1976); the same for all samples of a pixel in an epoch,
/// which stay stratified among each other.
pub(super) struct Shifts(Option<Pcg>);

impl Shifts {
    pub(super) fn new(seed: u64, pixel: u64, epoch: u32) -> Self {
        Self((epoch > 0).then(|| Pcg::new(&[seed, pixel, u64::from(epoch), PURPOSE])))
    }

    #[inline]
    pub(super) fn apply(&mut self, u: f32) -> f32 {
        match &mut self.0 {
            Some(shifts) => (u + shifts.next_f32()).fract(),
            None => u,
        }
    }
}

//! Russian roulette on the throughput.

use super::Path;
use super::guidance::Guidance;
use tyndall_math::{Rgb, max_component};

/// Scattering events before roulette begins: the first vertices carry most of the light.
const FIRST_EVENT: u32 = 2;

/// Smallest chance to survive: bounds the weight of a survivor.
const MIN_SURVIVAL: f32 = 0.05;

/// Bounds of the part that the field has in the chance: it may be wrong, and where it takes light for less than it is, few
/// survivors carry much (a lower bound of 0.25 instead: the cloud has 1.07 times the error, jungle and kitchen 1.02).
const WORTH: (f32, f32) = (0.7, 4.0);

/// The root of what a path is worth in its pixel, L_i / I (Vorba & Křivánek 2016, "Adjoint-Driven Russian Roulette and
/// Splitting in Light Transport Simulation", ACM TOG 35(4)): all of it costs more error than it saves time (jungle, 32
/// samples: .77 of the time and 1.08 of the error; with the root .86 and 1.02).
#[inline]
fn damped(importance: f32) -> f32 {
    importance.sqrt().clamp(WORTH.0, WORTH.1)
}

impl<G: Guidance> Path<'_, G> {
    /// Ends paths that carry little; survivors carry it all, so the mean is unchanged. White media never end.
    ///
    /// The chance is the square root of what is carried: survivors still weigh less the longer the path, and error
    /// times cost is lowest in all five reference scenes (1 to 13 % below throughput itself from the fourth event on).
    #[inline]
    pub(super) fn survives_roulette(&mut self) -> bool {
        if self.throughput == Rgb::ZERO || !self.throughput.is_finite() {
            return false;
        }
        if self.scatter_count < FIRST_EVENT {
            return true;
        }
        let carried = max_component(self.throughput.abs());
        let worth = self.guidance.importance(self.ray.direction).map_or(1.0, damped);
        let survival = (carried * worth).sqrt().clamp(MIN_SURVIVAL, 1.0);
        if survival < 1.0 && self.rng.next_f32() >= survival {
            return false;
        }
        self.throughput /= survival;
        true
    }
}

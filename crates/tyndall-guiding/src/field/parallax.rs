//! Light seen from elsewhere.
//!
//! A lobe is light that comes from about a distance d. Seen from a point that is moved by -o, it is at d·|μ + o/d|, in the
//! direction of μ + o/d (Ruppert et al. 2020, section 4). A source of fixed size then also covers a solid angle, and sends
//! an amount of light, that go with the inverse square of its distance; this is taken into account here.
//!
//! Only light of surfaces is somewhere. What a medium scatters comes from all along the way: taken for a thing at the
//! distance of one collision, it is put where it was not seen from anywhere else, and what a region knows of directions is
//! lost (error of the guided cloud over the unguided one: 2.2, and 1.1 with such light at no distance; underwater .67).

use super::TrainingSample;
use crate::EventClass;
use crate::directional::{DirectionSample, Group, Lanes, MAX_CONCENTRATION, PerLobe, VmfMixture};
use glam::Vec3A;

/// Squared ratios of distances are kept in this range: nearer light is no longer one thing in one direction.
const SQUARED_RATIO: (f32, f32) = (0.25, 4.0);
/// Squared lengths between which a vector has a direction.
const TINY: f32 = 1e-12;
const HUGE: f32 = 1e30;

/// `mixture` as seen from a point whose offset *to* the pivot is `offset`, and by what factor there is more light.
#[inline]
pub(super) fn seen_from(
    mixture: &VmfMixture,
    inverse_distance: &PerLobe,
    offset: Vec3A,
) -> (VmfMixture, f32) {
    mixture.map_groups(|g, lobes| lobes_seen_from(lobes, inverse_distance.0[g], offset))
}

/// [`seen_from`] of eight lobes, weights not normalised.
#[inline(always)]
pub(super) fn lobes_seen_from(lobes: Group, inverse_distance: Lanes, offset: Vec3A) -> Group {
    let offset = offset.to_array();
    let moved: [Lanes; 3] = std::array::from_fn(|i| lobes.mean[i] + inverse_distance * offset[i]);
    let square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2];
    // A lobe stays where it would have no direction, or one that overflowed.
    let bounded = square.max(Lanes::splat(TINY)).min(Lanes::splat(HUGE));
    let pick = |new: Lanes, old: Lanes| square.if_above(HUGE, old, square.if_above(TINY, new, old));
    let scale = Lanes::splat(1.0) / bounded.sqrt();
    let mean = std::array::from_fn(|i| pick(moved[i] * scale, lobes.mean[i]));
    let (least, most) = SQUARED_RATIO;
    let ratio = bounded.max(Lanes::splat(least)).min(Lanes::splat(most));
    let ratio = pick(ratio, Lanes::splat(1.0));
    let kappa = (lobes.kappa * ratio).min(Lanes::splat(MAX_CONCENTRATION));
    Group::new(lobes.weight / ratio, kappa, mean)
}

/// A sample as if its path had passed through the pivot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Observation {
    pub(super) light: DirectionSample,
    /// The density its direction was sampled with, per steradian at the pivot.
    pub(super) pdf: f32,
}

impl Observation {
    /// Distances are at least `min_distance`.
    #[inline]
    pub(super) fn new(sample: &TrainingSample, pivot: Vec3A, min_distance: f32) -> Self {
        let direction = sample.direction.unpack();
        let is_somewhere = sample.end == EventClass::Surface;
        let inverse = if is_somewhere { 1.0 / sample.distance.max(min_distance) } else { 0.0 };
        let inverse = if inverse.is_finite() { inverse } else { 0.0 };
        let v = direction + (Vec3A::from(sample.position) - pivot) * inverse;
        let square = v.length_squared();
        let (direction, ratio) = if square > TINY && square < HUGE {
            (v / square.sqrt(), square.clamp(SQUARED_RATIO.0, SQUARED_RATIO.1))
        } else {
            (direction, 1.0)
        };
        let light = DirectionSample {
            direction,
            weight: sample.light() / ratio,
            inverse_distance: inverse / ratio.sqrt(),
        };
        Self { light, pdf: sample.density() * ratio }
    }
}

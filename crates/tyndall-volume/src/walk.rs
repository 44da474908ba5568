//! Distance sampling by transmittance: scatter at `t`, or pass to the end of the segment.
//!
//! Homogeneous media are sampled in closed form, grids by null collisions (Woodcock et al. 1965; weighted and chromatic
//! as in Galtier et al. 2013, doi:10.1016/j.jqsrt.2013.04.001, and Kutz et al. 2017, doi:10.1145/3072959.3073665).
//!
//! Which collisions are sampled. With distances drawn by σ_t the weight of a scattering is the albedo, a constant, so
//! the relative variance of the in-scattered light of a homogeneous medium is 1/(1-T) - 1 whatever the albedo ω. Drawn
//! by σ_s, absorption would be the weight exp(-σ_a t), with relative second moment 1/(ω(2-ω)) for a thick medium: worse
//! for every ω < 1. What the light behind the medium loses by σ_t (1/T instead of exp(τ_s)) is the business of the
//! guided samplers. Where nothing scatters at all, though, a collision could only end the path: there absorption is the
//! weight and nothing is sampled. A pure absorber is exact.

mod channels;
mod closed_form;
mod emission;
mod homogeneous;
mod normalized;
mod resample;
mod segment;
mod single_grid;
mod track;

pub use normalized::Normalization;
pub use resample::{CandidateSums, ResampleOptions, Resampled, needs_candidates, resample_collision};
pub use segment::{Cell, Segment};
pub use track::{Candidate, CandidateVisitor};

pub(crate) use channels::survives_length;
pub(crate) use emission::attenuate_by_candidates;

use crate::medium::{Coefficients, Medium, Span};
use crate::phase::PhaseMix;
use glam::Vec3A;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Candidates after which a walk must survive a roulette, again and again: no finite majorant can hang a render.
pub(crate) const LONG_WALK: u32 = 1 << 16;

/// How a segment ends.
#[derive(Debug, Clone)]
pub enum Event {
    /// Light scatters on the way.
    Scatter {
        /// Where, in units of the ray's direction.
        t: f64,
        /// Where it goes from there.
        phase: PhaseMix,
    },
    /// The end of the segment is reached.
    Pass,
}

/// A sampled segment.
#[derive(Debug, Clone)]
pub struct Walk {
    /// What happened.
    pub event: Event,
    /// Factor on the path's throughput: σ_s T / pdf for a scattering, T / probability for a pass.
    /// A channel whose throughput is zero may get weight 0. Negative only after majorant violations.
    pub weight: Rgb,
    /// ∫ T(t) emission(t) dt over the whole segment, to be multiplied by the throughput *before* the walk. Exact where
    /// only homogeneous media are; an unbiased estimate where grids are. An unbounded medium that emits without
    /// absorbing has no finite radiance and counts as dark beyond its last boundary.
    pub emission: Rgb,
    /// How often a density exceeded its majorant: 0 unless there is a bug. The result is unbiased all the same.
    pub majorant_violations: u32,
}

impl Walk {
    /// Reaches the end with `weight`.
    #[inline]
    pub(crate) fn pass(weight: Rgb) -> Self {
        Self { event: Event::Pass, weight, emission: Rgb::ZERO, majorant_violations: 0 }
    }

    /// Scatters with `weight`.
    #[inline]
    fn scatter(event: Event, weight: Rgb) -> Self {
        Self { event, ..Self::pass(weight) }
    }
}

/// What walks cost. Add up over a render; the totals do not depend on the order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WalkStats {
    /// Candidate collisions, real or null.
    pub candidates: u64,
    /// Densities read from grids for candidates; the corners that bound single voxels in dense bricks are not counted.
    pub lookups: u64,
    /// Densities above their majorant; 0 unless there is a bug.
    pub majorant_violations: u64,
}

impl std::ops::AddAssign for WalkStats {
    fn add_assign(&mut self, other: Self) {
        self.candidates += other.candidates;
        self.lookups += other.lookups;
        self.majorant_violations += other.majorant_violations;
    }
}

/// Samples the next collision on a segment, or its end, in proportion to transmittance.
///
/// `spans` are the intervals of `ray` inside media, in any order, overlapping or not; parts outside `[0, ray.t_max]`
/// are ignored. `throughput` is the path's so far and only guides the choice between colour channels: if it is zero the
/// walk is over at once, with weight 0.
pub fn sample_collision(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    throughput: Rgb,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Walk {
    let Some(channels) = channels::channel_weights(throughput) else { return Walk::pass(Rgb::ZERO) };
    let walk = collide(media, spans, ray, channels, rng, stats);
    match emission::last_emissive(media, spans, ray) {
        None => walk,
        Some(end) => Walk {
            emission: emission::gather(
                media,
                spans,
                &ray.up_to((end as f32).next_up().min(ray.t_max)),
                rng,
                stats,
            ),
            ..walk
        },
    }
}

/// The collision, or the end of the segment.
#[inline]
fn collide(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    channels: Vec3A,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Walk {
    let mut present = spans.iter().filter_map(|span| Present::new(media, span, ray));
    let Some(first) = present.next() else { return Walk::pass(Rgb::ONE) };
    if present.next().is_none() && first.coefficients.is_achromatic() && first.medium.tint.is_none() {
        match &first.medium.density {
            None => return homogeneous::sample_one(&first, rng),
            Some(density) if first.coefficients.scatters() => {
                return single_grid::sample(&first, density, ray, rng, stats);
            }
            Some(_) => {}
        }
    }
    let mut segment = Segment::new(media, spans, ray);
    if segment.is_homogeneous() {
        homogeneous::sample(&mut segment, channels, rng)
    } else {
        track::sample(&mut segment, channels, 1.0, rng, stats)
    }
}

/// A span in which something is in the way.
struct Present<'a> {
    medium: &'a Medium,
    coefficients: Coefficients,
    t: [f64; 2],
}

impl<'a> Present<'a> {
    #[inline]
    fn new(media: &'a [Medium], span: &Span, ray: &Ray) -> Option<Self> {
        let t = span.clipped(ray)?;
        let medium = media.get(span.medium as usize)?;
        let coefficients = medium.coefficients();
        (!coefficients.is_zero()).then_some(Self { medium, coefficients, t })
    }
}

#[cfg(test)]
mod tests;

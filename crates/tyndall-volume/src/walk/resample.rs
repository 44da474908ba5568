//! Distance sampling with a chosen probability to scatter (Xu et al. 2024, Algorithm 1).
//!
//! All candidates of a segment are seen before anything is decided. With x_i their positions and p_i the probability
//! that the collision there is real, w_i = p_i Π_{j<i} (1 - p_j) are delta tracking's probabilities; W = Σ w_i, and
//! T̂ = Π (1 - p_i) estimates the transmittance. The caller answers W and T̂ with *any* probability P_v to scatter;
//! candidate i is then taken with w_i / W. The weights W/P_v and T̂/(1-P_v) keep the mean what it is:
//! E = Σ_i P_v (w_i/W) f_i W/P_v + (1-P_v) f_end T̂/(1-P_v) = Σ w_i f_i + T̂ f_end, whatever P_v was made of.
//!
//! In homogeneous media W = 1 - T in closed form, without candidates.
//!
//! Measured and left out: taking candidate i with w_i S_i / Σ w_j S_j, half of the time, S being the light that media are
//! known to scatter about there (the mean of what the paths of earlier passes gathered at their collisions, in a tree of
//! boxes of 128 samples each; eight stratified distances in homogeneous media). Error and time over those without, guided:
//! kitchen .96 and 1.06, underwater 1.00 and 1.36; variance and time of a lantern behind pillars in thin fog .98 and 1.19,
//! in dense fog .90 and 1.09, of a glowing mesh instead of it 1.14 and 1.23. Where lamps light a ray is found already, by
//! sampling them before the distance; what is left, light of higher orders, varies too little along rays to pay for asking.
//!
//! Channels: p_i is the mean of the channels' σ_t/σ̄ weighted by what they still carry, as in [`super::track`]; the rest
//! is a colour of the candidate, so that W and T̂ are scalars. Media that only absorb are a colour too.

use super::channels::channel_weights;
use super::homogeneous::Transmitted;
use super::segment::{Cell, Segment};
use super::track::{Candidate, CandidateVisitor, NullPath};
use super::{Event, Normalization, Present, Walk, WalkStats, emission, normalized};
use crate::medium::{Medium, Span};
use glam::Vec3A;
use std::ops::ControlFlow;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Survival of the roulette that ends walks nobody sees the end of.
const SURVIVAL: f32 = 0.25;
/// Spacing of the numbers that decide.
const U_DIGIT: f64 = 1.0 / 8_388_608.0;

/// What all candidates of a segment amount to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateSums {
    /// W, the weight of all candidates; 0 if nothing can scatter.
    pub w: f32,
    /// T̂, the estimated transmittance; 0 if nothing passes. W + T̂ = 1 without roulette.
    pub t_hat: f32,
    /// Optical depth of the scaled majorants: with exp(-depth) there is no candidate. Infinite in closed forms, which
    /// always have one.
    pub majorant_depth: f32,
}

/// A segment sampled with a chosen probability.
#[derive(Debug, Clone)]
pub struct Resampled {
    /// The sampled event, its weight with W/P_v or T̂/(1-P_v) in it.
    pub walk: Walk,
    /// What there was to choose between.
    pub sums: CandidateSums,
    /// P_v, the probability with which a scattering was chosen.
    pub probability: f32,
    /// If [`ResampleOptions::keeps_candidate`]: the scattering that was or would have been chosen, and its weight without
    /// regard to the choice, with W in it. Σ w_i f_i is its mean, whatever P_v is.
    pub candidate: Option<(Event, Rgb)>,
}

/// How [`resample_collision`] walks.
#[derive(Debug, Clone, Copy)]
pub struct ResampleOptions {
    /// Factor ≥ 1 on majorants: more candidates, so that a probability above 1 - exp(-τ̄) can be reached, and slack, so
    /// that one below it can where majorants are tight. Must not depend on the segment's random numbers.
    pub majorant_scale: f32,
    /// T̂ below which the walk must survive a roulette to see more of the medium.
    pub faint: f32,
    /// Instead of resampling candidates, where there are grids: P_v is not asked for, and is 1 or 0 when all is over. The
    /// sums are the weight of what was chosen, and 0.
    pub normalization: Option<Normalization>,
    /// Tell [`Resampled::candidate`]. Normalised flights have none where there are grids.
    pub keeps_candidate: bool,
}

/// What can happen on a segment, and how likely delta tracking finds it.
pub(super) struct Outcomes {
    pub(super) sums: CandidateSums,
    /// Factor on the throughput of a pass, T̂ left out.
    pub(super) pass: Rgb,
    pub(super) violations: u32,
}

/// Whether [`resample_collision`] walks to all candidates of the segment: there is a grid on it.
#[inline]
pub fn needs_candidates(media: &[Medium], spans: &[Span]) -> bool {
    spans.iter().any(|span| media.get(span.medium as usize).is_some_and(|medium| medium.density.is_some()))
}

/// Samples a scattering on the segment, or its end, with the probability that `choose` returns, strictly between 0 and 1;
/// it is not asked where W or T̂ is 0. `u` in [0, 1) decides; in homogeneous media it gives the distance as well.
///
/// Homogeneous media are always resampled: NDS is the same there, since W is exact and every candidate real.
///
/// The other arguments are those of [`super::sample_collision`].
#[allow(clippy::too_many_arguments, reason = "the arguments of the other walks and how to guide this one")]
pub fn resample_collision(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    throughput: Rgb,
    options: ResampleOptions,
    choose: impl FnOnce(&CandidateSums) -> f32,
    u: f32,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Resampled {
    let Some(channels) = channel_weights(throughput) else {
        let sums = CandidateSums { w: 0.0, t_hat: 1.0, majorant_depth: 0.0 };
        return Resampled { walk: Walk::pass(Rgb::ZERO), sums, probability: 0.0, candidate: None };
    };
    let mut resampled = resample(media, spans, ray, channels, options, choose, u, rng, stats);
    if let Some(end) = emission::last_emissive(media, spans, ray) {
        resampled.walk.emission = emission::gather(media, spans, &ray.up_to(end as f32), rng, stats);
    }
    resampled
}

#[allow(clippy::too_many_arguments, reason = "as above")]
#[inline]
fn resample(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    channels: Vec3A,
    options: ResampleOptions,
    choose: impl FnOnce(&CandidateSums) -> f32,
    u: f32,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Resampled {
    let keeps_candidate = options.keeps_candidate;
    let mut present = spans.iter().filter_map(|span| Present::new(media, span, ray));
    if let (Some(only), None) = (present.next(), present.next())
        && only.medium.density.is_none()
    {
        let transmitted = Transmitted::of_one(&only, channels);
        return decide(&transmitted.outcomes(), choose, keeps_candidate, u, rng, |u, _| {
            Some(transmitted.scatter_in_one(&only, u))
        });
    }
    let mut segment = Segment::new(media, spans, ray);
    if segment.is_homogeneous() {
        let transmitted = Transmitted::of(&mut segment, channels);
        return decide(&transmitted.outcomes(), choose, keeps_candidate, u, rng, |u, rng| {
            transmitted.scatter(&mut Segment::new(media, spans, ray), u, rng)
        });
    }
    if let Some(normalization) = options.normalization {
        let how = (normalization, options.majorant_scale);
        let walked = &mut Segment::new(media, spans, ray);
        return normalized::sample(walked, &mut segment, channels, how, u, rng, stats);
    }
    let mut reservoir = Reservoir {
        path: NullPath::new(channels),
        options,
        sums: CandidateSums { w: 0.0, t_hat: 1.0, majorant_depth: 0.0 },
        chosen: None,
    };
    segment.for_each_candidate(options.majorant_scale, &mut reservoir, rng, stats);
    let Reservoir { path, sums, chosen, .. } = reservoir;
    stats.majorant_violations += u64::from(path.violations);
    let outcomes = Outcomes { sums, pass: path.w, violations: path.violations };
    decide(&outcomes, choose, keeps_candidate, u, rng, |_, _| chosen)
}

/// Asks the caller, and samples what it decided.
#[inline]
fn decide(
    outcomes: &Outcomes,
    choose: impl FnOnce(&CandidateSums) -> f32,
    keeps_candidate: bool,
    u: f32,
    rng: &mut Pcg,
    scatter: impl FnOnce(f32, &mut Pcg) -> Option<(Event, Rgb)>,
) -> Resampled {
    let Outcomes { sums, pass, violations } = *outcomes;
    let CandidateSums { w, t_hat, .. } = sums;
    let probability = match (w > 0.0, t_hat > 0.0) {
        (false, _) => 0.0,
        (true, false) => 1.0,
        (true, true) => choose(&sums),
    };
    let scatters = u < probability;
    let mut candidate = None;
    if scatters || (keeps_candidate && w > 0.0) {
        // What `u` has left after this choice is filled up with new digits.
        let fine = f64::from(u) + f64::from(rng.next_f32()) * U_DIGIT;
        let p = f64::from(probability);
        let rest = if scatters { fine / p } else { (fine - p) / (1.0 - p) };
        candidate = scatter(rest.clamp(0.0, f64::from(1.0 - f32::EPSILON)) as f32, rng);
    }
    let kept = if keeps_candidate { candidate.clone() } else { None };
    let walk = if scatters {
        let (event, weight) = candidate.unwrap_or((Event::Pass, Rgb::ZERO));
        Walk::scatter(event, weight * (w / probability))
    } else {
        Walk::pass(pass * (t_hat / (1.0 - probability)))
    };
    let candidate = kept.map(|(event, weight)| (event, weight * w));
    Resampled { walk: Walk { majorant_violations: violations, ..walk }, sums, probability, candidate }
}

/// Sees all candidates and keeps one (weighted reservoir sampling, Chao 1982).
struct Reservoir {
    path: NullPath,
    options: ResampleOptions,
    sums: CandidateSums,
    /// The candidate kept, and its weight with 1/w_i left out.
    chosen: Option<(Event, Rgb)>,
}

impl CandidateVisitor for Reservoir {
    type Outcome = ();

    fn enter(&mut self, cell: &Cell) -> ControlFlow<(), bool> {
        let entered = self.path.enter(cell);
        match entered {
            ControlFlow::Break(()) => self.sums.t_hat = 0.0,
            ControlFlow::Continue(true) => {}
            ControlFlow::Continue(false) => {
                let depth = cell.sigma_bar.max_element() * cell.length() as f32;
                self.sums.majorant_depth += depth * self.options.majorant_scale;
            }
        }
        entered
    }

    fn live(&self) -> Vec3A {
        self.path.live()
    }

    fn visit(&mut self, segment: &mut Segment<'_>, candidate: &Candidate, rng: &mut Pcg) -> ControlFlow<()> {
        let collision = self.path.collide(candidate);
        let sums = &mut self.sums;
        let weight = sums.t_hat * collision.p;
        if weight > 0.0 {
            sums.w += weight;
            if rng.next_f32() * sums.w < weight {
                let (phase, colour) = self.path.scatter(segment, &collision, rng);
                self.chosen = Some((Event::Scatter { t: candidate.t, phase }, colour));
            }
        }
        sums.t_hat *= 1.0 - collision.p;
        if sums.t_hat > 0.0 && sums.t_hat < self.options.faint {
            sums.t_hat = if rng.next_f32() < SURVIVAL { sums.t_hat / SURVIVAL } else { 0.0 };
        }
        if sums.t_hat == 0.0 || !self.path.pass(&collision, !candidate.scatters, rng) {
            sums.t_hat = 0.0;
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}

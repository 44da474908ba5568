//! Null-collision tracking through any mixture of grids and homogeneous media.
//!
//! One scalar majorant σ̄ (the largest channel's) drives the candidates; the probability of a real collision is the mean
//! of σ_t,c / σ̄ over the channels, weighted by what each still carries; the channels' weights absorb the rest:
//! null w_c *= (1 - σ_t,c/σ̄) / (1 - p), real w_c *= (σ_s,c/σ̄) / p. Unbiased for any p in (0, 1), and for σ̄ < σ_t too,
//! where weights turn negative.

use super::closed_form::attenuation;
use super::segment::{Cell, Segment};
use super::{Event, LONG_WALK, Walk, WalkStats, survives_length};
use crate::medium::Coefficients;
use crate::phase::PhaseMix;
use glam::Vec3A;
use std::ops::ControlFlow;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;

/// Real-collision probability where the majorant is violated: both branches must stay possible.
const P_VIOLATED: f32 = 0.75;
/// A channel that carries this much less than the best one must survive a roulette.
const FAINT_CHANNEL: f32 = 1e-3;
/// A walk that only absorbs must survive a roulette below this weight.
const FAINT_WALK: f32 = 0.05;

/// A point of the majorant's Poisson process.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Where.
    pub t: f64,
    /// The rate of candidates there, per unit of `t`: at least the largest channel's σ_t.
    pub sigma_bar: f32,
    /// The media there.
    pub coefficients: Coefficients,
    /// Some medium there scatters.
    pub scatters: bool,
}

/// Who looks at candidates: a tracker, or the reservoir of a guided sampler.
pub trait CandidateVisitor {
    /// What it ends with.
    type Outcome;

    /// A cell begins. `Continue(true)` says that the whole cell is dealt with, without candidates.
    fn enter(&mut self, cell: &Cell) -> ControlFlow<Self::Outcome, bool>;

    /// 1 for the channels the majorant must bound from here on, 0 for those that no longer matter.
    fn live(&self) -> Vec3A;

    /// Majorant depth up to the next candidate: by tracking, exponentially distributed.
    fn free_flight(&mut self, rng: &mut Pcg) -> f64 {
        f64::from(rng.next_exponential())
    }

    /// The next candidate.
    fn visit(
        &mut self,
        segment: &mut Segment<'_>,
        candidate: &Candidate,
        rng: &mut Pcg,
    ) -> ControlFlow<Self::Outcome>;

    /// The segment ends with so much of the last flight unused.
    fn reach_end(&mut self, _unused: f64) {}
}

impl Segment<'_> {
    /// Shows `visitor` the points of the majorant's Poisson process, front to back, until it breaks.
    ///
    /// `scale` multiplies the majorant (1 = as it is). `None` at the end of the segment.
    pub fn for_each_candidate<V: CandidateVisitor>(
        &mut self,
        scale: f32,
        visitor: &mut V,
        rng: &mut Pcg,
        stats: &mut WalkStats,
    ) -> Option<V::Outcome> {
        let mut remaining = visitor.free_flight(rng);
        while let Some(cell) = self.next_cell() {
            match visitor.enter(&cell) {
                ControlFlow::Break(outcome) => return Some(outcome),
                ControlFlow::Continue(true) => continue,
                ControlFlow::Continue(false) => {}
            }
            let (length, mut s) = (cell.length(), 0f64);
            loop {
                let sigma_bar = (cell.sigma_bar * visitor.live()).max_element() * scale;
                let rate = f64::from(sigma_bar);
                if sigma_bar <= 0.0 || remaining >= (length - s) * rate {
                    remaining -= if sigma_bar > 0.0 { (length - s) * rate } else { 0.0 };
                    break;
                }
                s += remaining / rate;
                remaining = visitor.free_flight(rng);
                let t = (cell.t0 + s).min(cell.t1);
                let candidate = self.candidate(&cell, t, sigma_bar, stats);
                if let ControlFlow::Break(outcome) = visitor.visit(self, &candidate, rng) {
                    return Some(outcome);
                }
            }
        }
        visitor.reach_end(remaining);
        None
    }

    fn candidate(&mut self, cell: &Cell, t: f64, sigma_bar: f32, stats: &mut WalkStats) -> Candidate {
        stats.candidates += 1;
        stats.lookups += u64::from(cell.n_grids);
        let coefficients = self.coefficients_at(cell, t);
        Candidate { t, sigma_bar, coefficients, scatters: cell.scatters }
    }
}

/// What is left of the light after the null collisions so far.
pub(super) struct NullPath {
    /// Weights of the channels, and the shares of the path's throughput they are applied to.
    pub(super) w: Rgb,
    channels: Vec3A,
    n: u32,
    pub(super) violations: u32,
}

/// A candidate as the channels see it.
pub(super) struct Collision {
    /// Probability that it is real; 0 where nothing scatters.
    pub(super) p: f32,
    /// σ_t/σ̄ per channel.
    real: Rgb,
    /// 1/σ̄.
    per_bar: f32,
    carried: Vec3A,
}

impl NullPath {
    pub(super) fn new(channels: Vec3A) -> Self {
        Self { w: Rgb::ONE, channels, n: 0, violations: 0 }
    }

    /// What each channel carries, relative to the strongest.
    fn carried(&self) -> Vec3A {
        let carried = (self.w * self.channels).abs();
        carried / carried.max_element()
    }

    /// 1 for channels that carry anything.
    pub(super) fn live(&self) -> Vec3A {
        Vec3A::select((self.w * self.channels).cmpne(Vec3A::ZERO), Vec3A::ONE, Vec3A::ZERO)
    }

    /// A closed form for what a cell without grids absorbs where nothing scatters. Breaks when nothing is left; else
    /// says whether the cell is dealt with.
    pub(super) fn enter(&mut self, cell: &Cell) -> ControlFlow<(), bool> {
        if cell.n_grids > 0 {
            return ControlFlow::Continue(false);
        }
        if !cell.scatters {
            self.w *= attenuation(cell.homogeneous.sigma_t, cell.length() as f32);
            if self.live() == Vec3A::ZERO {
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(!cell.scatters)
    }

    /// Probability that the collision is real: the mean over what the channels carry; never where nothing scatters.
    pub(super) fn collide(&mut self, candidate: &Candidate) -> Collision {
        let c = &candidate.coefficients;
        let per_bar = candidate.sigma_bar.recip();
        let real = c.sigma_t * per_bar;
        let is_violated = (real * self.live()).max_element() > 1.0 + 4.0 * f32::EPSILON;
        self.violations += u32::from(is_violated);
        let carried = self.carried();
        let mean = (real * carried).dot(Vec3A::ONE) / carried.dot(Vec3A::ONE);
        let p = match (c.scatters(), is_violated) {
            (false, _) => 0.0,
            (true, false) => mean.min(1.0),
            (true, true) => P_VIOLATED,
        };
        Collision { p, real, per_bar, carried }
    }

    /// The phase function of a real collision, and the weight with 1/p in it.
    pub(super) fn scatter(
        &self,
        segment: &mut Segment<'_>,
        collision: &Collision,
        rng: &mut Pcg,
    ) -> (PhaseMix, Rgb) {
        let (phase, sigma_s) = segment.scatter(collision.carried, rng);
        (phase, self.w * (sigma_s * (collision.per_bar / collision.p)))
    }

    /// Takes the collision as a null collision; false when nothing is left to carry on.
    pub(super) fn pass(&mut self, collision: &Collision, absorbs_only: bool, rng: &mut Pcg) -> bool {
        self.w *= self.live() * (Rgb::ONE - collision.real) / (1.0 - collision.p);
        self.survives_roulette(absorbs_only, rng)
    }

    /// Ends channels and walks that carry next to nothing, without bias.
    fn survives_roulette(&mut self, absorbs_only: bool, rng: &mut Pcg) -> bool {
        let carried = self.carried();
        for c in 0..3 {
            if carried[c] > 0.0 && carried[c] < FAINT_CHANNEL {
                self.w[c] *= if rng.next_u32() & 1 == 0 { 2.0 } else { 0.0 };
            }
        }
        self.n += 1;
        if self.n.is_multiple_of(LONG_WALK) || (absorbs_only && self.w.abs().max_element() < FAINT_WALK) {
            self.w *= if survives_length(rng) { 2.0 } else { 0.0 };
        }
        self.w * self.channels != Rgb::ZERO
    }
}

/// Samples a collision; `channels` are the shares of the throughput.
pub(super) fn sample(
    segment: &mut Segment<'_>,
    channels: Vec3A,
    scale: f32,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Walk {
    let mut path = NullPath::new(channels);
    let ended = segment.for_each_candidate(scale, &mut path, rng, stats);
    stats.majorant_violations += u64::from(path.violations);
    let (event, weight) = ended.unwrap_or((Event::Pass, path.w));
    Walk { majorant_violations: path.violations, ..Walk::scatter(event, weight) }
}

impl CandidateVisitor for NullPath {
    type Outcome = (Event, Rgb);

    fn enter(&mut self, cell: &Cell) -> ControlFlow<(Event, Rgb), bool> {
        match self.enter(cell) {
            ControlFlow::Continue(is_done) => ControlFlow::Continue(is_done),
            ControlFlow::Break(()) => ControlFlow::Break((Event::Pass, Rgb::ZERO)),
        }
    }

    fn live(&self) -> Vec3A {
        self.live()
    }

    fn visit(
        &mut self,
        segment: &mut Segment<'_>,
        candidate: &Candidate,
        rng: &mut Pcg,
    ) -> ControlFlow<(Event, Rgb)> {
        let collision = self.collide(candidate);
        if rng.next_f32() < collision.p {
            let (phase, weight) = self.scatter(segment, &collision, rng);
            return ControlFlow::Break((Event::Scatter { t: candidate.t, phase }, weight));
        }
        if !self.pass(&collision, !candidate.scatters, rng) {
            return ControlFlow::Break((Event::Pass, Rgb::ZERO));
        }
        ControlFlow::Continue(())
    }
}

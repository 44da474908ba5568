//! Normalised distance sampling: free flights that are cut off, so that more of them end in the medium. NDS and NDS+, with
//! which Xu et al. 2024, "Volume Scattering Probability Guiding" (ACM TOG 43(6)), compare their resampling.
//!
//! Flights are drawn in majorant depth. With t_v the depth of the whole segment, they come from the exponential density cut
//! off at t_n > t_v, 1 - e^{-t_n} = (1 - e^{-t_v})/P*: the first candidate lies before the end with the probability P*. A
//! flight from depth s is 1 - e^{-(t_n-s)} times as likely under tracking, and one that leaves is
//! (1 - e^{-(t_n-s)})/(1 - e^{-(t_n-t_v)}) times as likely; S is the product of these. NDS+ also takes collisions with
//! p^{1/γ} instead of p, which multiplies S by p/p^{1/γ} or (1-p)/(1-p^{1/γ}).
//!
//! Null candidates keep NDS from reaching P*, the more so the looser the majorants; it can only raise the probability to
//! scatter: where P* ≤ 1 - e^{-t_v} flights are tracked.
//!
//! What differs from the published code: the domain is the whole segment, not each medium; the mixture with tracking,
//! 1/(α/S + 1-α), has the collisions of NDS+ in S (without them it is biased); depths are those really walked, since
//! channels that die out lower the majorants on the way.

use super::resample::{CandidateSums, Resampled};
use super::segment::{Cell, Segment};
use super::track::{Candidate, CandidateVisitor, NullPath};
use super::{Event, Walk, WalkStats};
use glam::Vec3A;
use std::ops::ControlFlow;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;

/// How flights are normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalization {
    /// P* < 1: the probability of a candidate before the end.
    pub target: f32,
    /// 1/γ in (0, 1], the power of the probability of a collision: 1 is NDS.
    pub exponent: f32,
    /// Share α in [0, 1] of normalised walks; the rest is tracked. Both densities count.
    pub alpha: f32,
}

/// Samples the segment that `measured` is of, too; `u` in [0, 1) decides how to walk, and gives the first flight.
pub(super) fn sample(
    segment: &mut Segment<'_>,
    measured: &mut Segment<'_>,
    channels: Vec3A,
    (normalization, scale): (Normalization, f32),
    u: f32,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Resampled {
    let path = NullPath::new(channels);
    let depth = majorant_depth(measured, path.live(), scale);
    let alpha = normalization.alpha;
    let is_normalized = u < alpha;
    rng.lead_with(
        if is_normalized { u / alpha } else { (u - alpha) / (1.0 - alpha) }.min(1.0 - f32::EPSILON),
    );
    let mut flights = Flights::new(path, depth, normalization, is_normalized);
    let ended = segment.for_each_candidate(scale, &mut flights, rng, stats);
    stats.majorant_violations += u64::from(flights.path.violations);
    let mixture = flights.mixture_weight(f64::from(alpha)) as f32;
    let (event, weight) = ended.unwrap_or((Event::Pass, flights.path.w));
    let scatters = matches!(event, Event::Scatter { .. });
    let (w, t_hat) = if scatters { (mixture, 0.0) } else { (0.0, mixture) };
    Resampled {
        walk: Walk { majorant_violations: flights.path.violations, ..Walk::scatter(event, weight * mixture) },
        sums: CandidateSums { w, t_hat, majorant_depth: depth as f32 },
        probability: f32::from(u8::from(scatters)),
        candidate: None,
    }
}

/// ∫ σ̄ along the segment where there are candidates.
fn majorant_depth(segment: &mut Segment<'_>, live: Vec3A, scale: f32) -> f64 {
    let mut depth = 0.0;
    while let Some(cell) = segment.next_cell() {
        let sigma_bar = (cell.sigma_bar * live).max_element() * scale;
        if sigma_bar > 0.0 && (cell.n_grids > 0 || cell.scatters) {
            depth += cell.length() * f64::from(sigma_bar);
        }
    }
    depth
}

/// A walk, and how much likelier tracking is to have made it.
struct Flights {
    path: NullPath,
    /// t_n; infinite for tracking.
    cut: f64,
    exponent: f64,
    is_normalized: bool,
    /// Where the current flight began, and how long it is, in majorant depth.
    start: f64,
    flight: f64,
    /// S of the flights that ended in candidates, and 1 - e^{-(t_n-s)} of the current one.
    ratio: f64,
    reach: f64,
}

impl Flights {
    fn new(path: NullPath, depth: f64, normalization: Normalization, is_normalized: bool) -> Self {
        let (covered, target) = (-(-depth).exp_m1(), f64::from(normalization.target));
        let is_raised = covered > 0.0 && covered < target;
        let (cut, exponent) = if is_raised {
            (-(-(covered / target)).ln_1p(), f64::from(normalization.exponent))
        } else {
            (f64::INFINITY, 1.0)
        };
        Self { path, cut, exponent, is_normalized, start: 0.0, flight: 0.0, ratio: 1.0, reach: 1.0 }
    }

    /// 1 - e^{-(t_n-s)}.
    fn reach_from(&self, depth: f64) -> f64 {
        // Rounding may bring the end of a walk to the cut.
        -(-(self.cut - depth).max(f64::MIN_POSITIVE)).exp_m1()
    }

    /// The density of tracking over that of the mixture: 1/(α/S + 1-α).
    fn mixture_weight(&self, alpha: f64) -> f64 {
        if alpha > 0.0 { (alpha / self.ratio + (1.0 - alpha)).recip() } else { 1.0 }
    }
}

impl CandidateVisitor for Flights {
    type Outcome = (Event, Rgb);

    fn enter(&mut self, cell: &Cell) -> ControlFlow<(Event, Rgb), bool> {
        CandidateVisitor::enter(&mut self.path, cell)
    }

    fn live(&self) -> Vec3A {
        self.path.live()
    }

    fn free_flight(&mut self, rng: &mut Pcg) -> f64 {
        // The flight before, if there was one, has ended in a candidate.
        self.ratio *= self.reach;
        self.start += self.flight;
        self.reach = self.reach_from(self.start);
        self.flight = if self.is_normalized {
            -(-f64::from(rng.next_f32()) * self.reach).ln_1p()
        } else {
            f64::from(rng.next_exponential())
        };
        self.flight
    }

    fn visit(
        &mut self,
        segment: &mut Segment<'_>,
        candidate: &Candidate,
        rng: &mut Pcg,
    ) -> ControlFlow<(Event, Rgb)> {
        let collision = self.path.collide(candidate);
        let p = f64::from(collision.p);
        let normalized = if self.exponent == 1.0 { p } else { p.powf(self.exponent) };
        let own = if self.is_normalized { normalized } else { p };
        if f64::from(rng.next_f32()) < own {
            self.ratio *= p / normalized;
            let (phase, weight) = self.path.scatter(segment, &collision, rng);
            return ControlFlow::Break((Event::Scatter { t: candidate.t, phase }, weight));
        }
        self.ratio *= (1.0 - p) / (1.0 - normalized);
        if !self.path.pass(&collision, !candidate.scatters, rng) {
            return ControlFlow::Break((Event::Pass, Rgb::ZERO));
        }
        ControlFlow::Continue(())
    }

    fn reach_end(&mut self, unused: f64) {
        let end = self.start + (self.flight - unused);
        self.ratio *= self.reach / self.reach_from(end);
    }
}

//! What a segment is told: with which probability to scatter, and how to walk for it.
//!
//! A path through the volume may cost more rays than one that starts at the surface; the odds take that into account.

use crate::moments::Moments;
use crate::{ScatteringOdds, TargetProbability, headroom_depth};

/// Share of the guided probability; the rest is delta tracking's (0.75 in the paper's tests).
const ALPHA: f32 = 0.75;
/// Majorants are scaled at least this much: a tight one would force a scattering.
const SLACK: f32 = 1.05;
/// Largest factor on majorants; thinner media than this compensates count as empty.
const MAX_SCALE: f32 = 1e3;
/// Part of T̂ that must remain, or the walk plays roulette.
const FAINT: f32 = 0.05;

/// Choosing must leave less than this of tracking's second moment: on further segments, and on the camera's where all
/// candidates must be walked to.
const WORTH_CHOOSING: f32 = 0.8;

/// How the distance along camera segments is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Strategy {
    /// Odds, P_v = κW/(κW+T̂).
    #[default]
    Odds,
    /// The probability P* of the variance criterion (Xu et al. 2024).
    Target,
    /// The same probability by normalised free flights, which reach it only under tight majorants (NDS in the paper).
    Normalized,
    /// That, with more of the candidates taken as collisions the more light passes (NDS+).
    NormalizedPlus,
}

/// Free flights that are cut off to meet the medium more often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalizedFlights {
    /// P*, in [0.001, 0.999]: of a candidate before the end.
    pub target: f32,
    /// 1/γ in [1/2, 1]: collisions are taken with this power of their probability.
    pub exponent: f32,
    /// Share of such flights; the rest is tracked.
    pub alpha: f32,
}

/// How a segment decides between scattering and passing.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Choice {
    Odds(ScatteringOdds),
    Target(TargetProbability),
    Normalized(NormalizedFlights),
}

/// What a segment is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentGuide {
    choice: Choice,
    majorant_scale: f32,
    outlier_limit: f32,
    expected: f32,
    is_worth_walking: bool,
}

/// How the segments after the camera's choose: by what the field knows about the direction in which they leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FurtherSegments {
    strategy: Strategy,
    cost_factor: f32,
}

impl Default for SegmentGuide {
    /// Delta tracking's probability, by choosing: so that something is learned.
    fn default() -> Self {
        Self {
            choice: Choice::Odds(ScatteringOdds::default()),
            majorant_scale: SLACK,
            outlier_limit: f32::INFINITY,
            expected: 0.0,
            is_worth_walking: false,
        }
    }
}

impl SegmentGuide {
    /// What the filtered sums of a pixel say: its choices are stratified.
    pub fn of_pixel(moments: &Moments, strategy: Strategy, costs: &ClassCosts) -> Self {
        let kappa = moments.stratified_odds().kappa();
        let guide = Self::new(moments, strategy, ScatteringOdds::new(kappa * costs.odds_factor()));
        let is_worth_walking =
            strategy != Strategy::Odds || second_moment_left(kappa, moments) < WORTH_CHOOSING;
        Self { is_worth_walking, ..guide }
    }

    fn new(moments: &Moments, strategy: Strategy, odds: ScatteringOdds) -> Self {
        let outlier_limit = moments.outlier_limit();
        let choice = match (strategy, moments.variance_target()) {
            (Strategy::Target, Some(target)) => Choice::Target(TargetProbability::new(target)),
            (Strategy::Normalized, Some(_)) => Choice::Normalized(NormalizedFlights::new(moments, 1.0)),
            (Strategy::NormalizedPlus, Some(_)) => {
                // γ = 1 + T, T the mean transmittance.
                let gamma = 1.0 + (moments.t / moments.n).clamp(0.0, 1.0);
                Choice::Normalized(NormalizedFlights::new(moments, 1.0 / gamma))
            }
            _ => Choice::Odds(odds),
        };
        let majorant_scale = majorant_scale(moments, &choice);
        let gathered = moments.volume_x + moments.surface_x;
        let expected = if gathered > 0.0 { gathered / moments.n } else { 0.0 };
        Self { choice, majorant_scale, outlier_limit, expected, is_worth_walking: true }
    }

    /// P_v for the candidates' weight W, the transmittance T̂ and the depth of the scaled majorants.
    #[inline]
    pub fn select_probability(&self, w: f32, t_hat: f32, majorant_depth: f32) -> f32 {
        match self.choice {
            Choice::Odds(odds) => odds.select_probability(w, t_hat, ALPHA),
            Choice::Target(target) => target.select_probability(w, t_hat, majorant_depth, ALPHA),
            Choice::Normalized(flights) => {
                // In closed form, and only to raise tracking's probability.
                let target = flights.target.max(w / (w + t_hat));
                TargetProbability::new(target).select_probability(w, t_hat, f32::INFINITY, flights.alpha)
            }
        }
    }

    /// How flights are to be normalised, if candidates are not to be resampled.
    #[inline]
    pub fn normalized_flights(&self) -> Option<NormalizedFlights> {
        match self.choice {
            Choice::Normalized(flights) => Some(flights),
            Choice::Odds(_) | Choice::Target(_) => None,
        }
    }

    /// Whether choosing pays where it takes a walk to all candidates. Tracking sees them only up to the first collision: in
    /// a dense cloud it takes a third of the time, and there is nothing to choose. The paper's strategies always choose.
    #[inline]
    pub fn is_worth_walking(&self) -> bool {
        self.is_worth_walking
    }

    /// Factor on majorants, at least 1.
    #[inline]
    pub fn majorant_scale(&self) -> f32 {
        self.majorant_scale
    }

    /// T̂ below which a walk plays roulette: later where the surface is the brighter class.
    #[inline]
    pub fn faint(&self) -> f32 {
        match self.choice {
            Choice::Odds(odds) => FAINT * odds.kappa().min(1.0),
            Choice::Target(_) | Choice::Normalized(_) => FAINT,
        }
    }

    /// Light that a path is expected to gather after the choice, in its largest channel; 0 while nothing is known.
    #[inline]
    pub fn expected(&self) -> f32 {
        self.expected
    }

    /// The limit for [`Moments::add`] of this pass; infinite as long as too little is known.
    #[inline]
    pub fn outlier_limit(&self) -> f32 {
        self.outlier_limit
    }
}

impl FurtherSegments {
    /// `costs` are those of the camera's paths after their choice, since later choices are not followed.
    pub fn new(strategy: Strategy, costs: &ClassCosts) -> Self {
        Self { strategy, cost_factor: costs.odds_factor() }
    }

    /// What the sums of a direction say; `None` where tracking is about as good.
    #[inline]
    pub fn guide(&self, moments: &Moments) -> Option<SegmentGuide> {
        let kappa = moments.odds().kappa();
        let pays = second_moment_left(kappa, moments) < WORTH_CHOOSING;
        pays.then(|| SegmentGuide::new(moments, self.strategy, ScatteringOdds::new(kappa * self.cost_factor)))
    }
}

impl NormalizedFlights {
    /// P* by variance: κW̄/(κW̄+T̄). Such walks tell W and T̂ only as the weight of what they chose, so that P* cannot be
    /// read off sums of squares as for [`Strategy::Target`]; κ can, its denominators having the same weights.
    fn new(moments: &Moments, exponent: f32) -> Self {
        let target = moments.odds().predicted_probability(moments.w, moments.t);
        Self { target: TargetProbability::new(target).target(), exponent, alpha: ALPHA }
    }
}

/// What choosing by κ leaves of tracking's second moment: (κW̄+T̄)² of κ²W̄+T̄, both over the squared radiance of the
/// surface, with W̄+T̄ = 1. One where nothing passes, nothing scatters or both classes are as bright.
fn second_moment_left(kappa: f32, moments: &Moments) -> f32 {
    let sum = moments.w + moments.t;
    let (w, t) = (moments.w / sum, moments.t / sum);
    let left = (kappa * w + t) * (kappa * w + t) / (kappa * kappa * w + t);
    if left.is_finite() { left } else { 1.0 }
}

/// The factor that lets the probability to expect be reached: [`headroom_depth`] against the mean optical depth.
fn majorant_scale(moments: &Moments, choice: &Choice) -> f32 {
    let predicted = match choice {
        Choice::Odds(odds) => odds.predicted_probability(moments.w, moments.t),
        Choice::Target(target) => target.target(),
        // Every null candidate takes it further from its target.
        Choice::Normalized(_) => return 1.0,
    };
    let depth = -(moments.t / moments.n).ln();
    if depth > 0.0 && depth.is_finite() {
        (headroom_depth(depth, predicted) / depth).clamp(SLACK, MAX_SCALE)
    } else {
        SLACK
    }
}

/// What paths cost after the choice, in rays: sums over segments of each class.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClassCosts {
    /// Rays of paths that scattered in the volume, and their number.
    pub volume: (u64, u64),
    /// The same of paths that passed.
    pub surface: (u64, u64),
}

impl ClassCosts {
    /// Adds the paths of `other`.
    pub fn merge(&mut self, other: &Self) {
        for (sum, new) in [(&mut self.volume, other.volume), (&mut self.surface, other.surface)] {
            *sum = (sum.0 + new.0, sum.1 + new.1);
        }
    }

    /// Rays of a mean path of each class, with the camera's own.
    fn means(&self) -> [f32; 2] {
        [self.volume, self.surface].map(|(rays, paths)| 1.0 + rays as f32 / paths.max(1) as f32)
    }

    /// Factor on κ that minimises variance times cost: RMS radiances count divided by the root of what a sample costs.
    fn odds_factor(&self) -> f32 {
        let [volume, surface] = self.means();
        (surface / volume).sqrt()
    }
}

#[cfg(test)]
#[path = "segment_guide_tests.rs"]
mod tests;

//! The sums that scattering odds are learned from.
//!
//! Per segment, X is the value of the whole path's light (emission along the segment left out) *including* the division
//! by the probability P of the class that was taken. Then E[1_vol X² P] = E[W² L_v²] whatever P was, so that samples
//! drawn under different guides add up, and
//! κ² = (Σ_vol X²P / ΣW²) / (Σ_surf X²P / ΣT̂²) estimates the squared ratio of RMS radiances.
//!
//! Everything is a sum: merging is addition, forgetting is scaling, filtering an image is a weighted sum of sums.

use crate::{ScatteringOdds, optimal_probability};

/// Pseudo-samples that say "volume and surface are equally bright" (κ = 1).
const PRIOR_SAMPLES: f64 = 4.0;
/// Samples above this many RMS values are cut (Winsorised) before they are learned from.
const OUTLIER_RMS: f32 = 7.0;
/// Least part of a class's mean square that counts as noise: what few samples found to be constant seldom is.
const VARIANCE_FLOOR: f32 = 0.05;
/// Samples needed before an RMS value is trusted to cut anything.
const OUTLIER_MIN_SAMPLES: f32 = 16.0;
/// Depths of rays that hit nothing, and the largest value ever taken from a sample.
const FAR_DEPTH: f32 = 1e9;
/// Largest value taken from a sample: its square is still a small part of the range of f32.
const MAX_VALUE: f32 = 1e12;

/// What a segment ended with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventClass {
    /// A scattering event in a medium.
    Volume,
    /// The surface behind, or the background.
    Surface,
}

/// What one segment teaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentSample {
    /// What was chosen.
    pub class: EventClass,
    /// X ≥ 0: the path's value (largest channel) from this segment on, including the weight W/P_v or T̂/(1-P_v).
    pub value: f32,
    /// Probability with which `class` was chosen: P_v or 1-P_v.
    pub probability: f32,
    /// W: the weight of all candidates.
    pub w: f32,
    /// T̂: the estimated transmittance.
    pub t_hat: f32,
    /// Distance to the chosen candidate; any number if W is 0.
    pub volume_depth: f32,
    /// Distance to the surface; infinite if there is none.
    pub surface_depth: f32,
}

/// Sums over segments, 44 bytes. The order of additions decides the last bit, so callers keep it fixed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// Σ X²P over volume events.
    pub volume_x2: f32,
    /// Σ X over volume events.
    pub volume_x: f32,
    /// Σ X²P over surface events.
    pub surface_x2: f32,
    /// Σ X over surface events.
    pub surface_x: f32,
    /// Σ W².
    pub w2: f32,
    /// Σ T̂².
    pub t2: f32,
    /// Σ W.
    pub w: f32,
    /// Σ T̂.
    pub t: f32,
    /// Σ W · volume depth.
    pub w_depth: f32,
    /// Σ T̂ · surface depth.
    pub t_depth: f32,
    /// Number of segments (a weight after decay or filtering).
    pub n: f32,
}

impl Moments {
    pub(crate) const N_SUMS: usize = 11;

    /// Adds a segment. X√P is cut at `limit`, which must come from earlier passes ([`Moments::outlier_limit`]);
    /// infinity cuts nothing. Samples that are not finite teach nothing.
    pub fn add(&mut self, sample: &SegmentSample, limit: f32) {
        if let Some(one) = Self::of(sample, limit) {
            self.merge(&one);
        }
    }

    /// The sums over one segment; `None` if it teaches nothing. For `limit` see [`Moments::add`].
    pub(crate) fn of(s: &SegmentSample, limit: f32) -> Option<Self> {
        if !(s.value.is_finite() && s.probability.is_finite() && s.w.is_finite() && s.t_hat.is_finite()) {
            return None;
        }
        let p = s.probability.clamp(0.0, 1.0);
        // X²P is what is summed: a class is no outlier for being taken rarely. For P = 0 this is infinite or NaN.
        let limit = limit / p.sqrt();
        let x = s.value.clamp(0.0, if limit.is_nan() { MAX_VALUE } else { limit.clamp(0.0, MAX_VALUE) });
        let x2 = x * x * p;
        let (w, t) = (s.w.clamp(0.0, MAX_VALUE), s.t_hat.clamp(0.0, MAX_VALUE));
        let (volume, surface) = match s.class {
            EventClass::Volume => (1.0, 0.0),
            EventClass::Surface => (0.0, 1.0),
        };
        let depth = |d: f32| if d.is_nan() { 0.0 } else { d.clamp(0.0, FAR_DEPTH) };
        Some(Self {
            volume_x2: volume * x2,
            volume_x: volume * x,
            surface_x2: surface * x2,
            surface_x: surface * x,
            w2: w * w,
            t2: t * t,
            w,
            t,
            w_depth: w * depth(s.volume_depth),
            t_depth: t * depth(s.surface_depth),
            n: 1.0,
        })
    }

    /// All sums, in the order of their declaration.
    pub(crate) fn to_array(self) -> [f32; Self::N_SUMS] {
        let Self { volume_x2, volume_x, surface_x2, surface_x, w2, t2, w, t, w_depth, t_depth, n } = self;
        [volume_x2, volume_x, surface_x2, surface_x, w2, t2, w, t, w_depth, t_depth, n]
    }

    pub(crate) fn from_array(sums: [f32; Self::N_SUMS]) -> Self {
        let [volume_x2, volume_x, surface_x2, surface_x, w2, t2, w, t, w_depth, t_depth, n] = sums;
        Self { volume_x2, volume_x, surface_x2, surface_x, w2, t2, w, t, w_depth, t_depth, n }
    }

    /// Adds the segments of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.add_scaled(other, 1.0);
    }

    /// Adds the segments of `other` with the weight `scale` ≥ 0.
    #[inline]
    pub fn add_scaled(&mut self, other: &Self, scale: f32) {
        self.volume_x2 += scale * other.volume_x2;
        self.volume_x += scale * other.volume_x;
        self.surface_x2 += scale * other.surface_x2;
        self.surface_x += scale * other.surface_x;
        self.w2 += scale * other.w2;
        self.t2 += scale * other.t2;
        self.w += scale * other.w;
        self.t += scale * other.t;
        self.w_depth += scale * other.w_depth;
        self.t_depth += scale * other.t_depth;
        self.n += scale * other.n;
    }

    /// Weakens what was learned to `factor` in [0, 1] of its samples: estimates stay, newer samples count more.
    pub fn decay(&mut self, factor: f32) {
        let old = std::mem::take(self);
        self.add_scaled(&old, if factor.is_nan() { 0.0 } else { factor.clamp(0.0, 1.0) });
    }

    /// E[L_v²] and E[L_s²], the mean squares of the radiance scattered in and of the surface's; `None` without light or
    /// without choice.
    ///
    /// Neither class counts as darker than the pooled mean square times (4/n)²: a class that happened not to be sampled
    /// yet must not be taken for black.
    pub fn mean_squares(&self) -> Option<[f32; 2]> {
        // Quotients of sums of squares: f32 would run out of range.
        let [a, b, c, d, n] = [self.volume_x2, self.w2, self.surface_x2, self.t2, self.n].map(f64::from);
        let pooled = (a + c) / (b + d);
        if !(b > 0.0 && d > 0.0 && n > 0.0 && pooled > 0.0 && pooled.is_finite()) {
            return None;
        }
        let floor = pooled * (PRIOR_SAMPLES / n).min(1.0).powi(2);
        Some([(a / b).max(floor) as f32, (c / d).max(floor) as f32])
    }

    /// Var[L_v] and Var[L_s], at least [`VARIANCE_FLOOR`] of the mean squares; `None` as for [`Self::mean_squares`].
    pub fn variances(&self) -> Option<[f32; 2]> {
        let [volume, surface] = self.mean_squares()?;
        let of = |square: f32, x: f32, weight: f32| {
            let mean = if weight > 0.0 { x / weight } else { 0.0 };
            (square - mean * mean).max(VARIANCE_FLOOR * square)
        };
        Some([of(volume, self.volume_x, self.w), of(surface, self.surface_x, self.t)])
    }

    /// κ, doubted while there are few samples; exactly 1 without light or without choice.
    ///
    /// log κ is shrunk towards 0 as if four pseudo-samples had said κ = 1.
    pub fn odds(&self) -> ScatteringOdds {
        self.doubted(self.mean_squares())
    }

    /// κ where the number that chooses is stratified: the classes' shares are then as good as exact and only what
    /// happens inside each is noise, so standard deviations take the place of RMS values (Neyman 1934, "On the Two
    /// Different Aspects of the Representative Method").
    pub fn stratified_odds(&self) -> ScatteringOdds {
        self.doubted(self.variances())
    }

    fn doubted(&self, squares: Option<[f32; 2]>) -> ScatteringOdds {
        let Some([volume, surface]) = squares else { return ScatteringOdds::default() };
        let ratio = f64::from(volume) / f64::from(surface).max(f64::MIN_POSITIVE);
        let n = f64::from(self.n);
        ScatteringOdds::new(ratio.powf(0.5 * n / (n + PRIOR_SAMPLES)) as f32)
    }

    /// P* by contribution, E[W L_v] / (E[W L_v] + E[T̂ L_s]); `None` without light.
    pub fn contribution_target(&self) -> Option<f32> {
        (self.volume_x + self.surface_x > 0.0).then(|| optimal_probability(self.volume_x, self.surface_x))
    }

    /// P* by variance, from the RMS values of W L_v and T̂ L_s; `None` without light.
    pub fn variance_target(&self) -> Option<f32> {
        let (a, b) = (self.volume_x2, self.surface_x2);
        (a + b > 0.0).then(|| optimal_probability(a.sqrt(), b.sqrt()))
    }

    /// Above which X√P the next pass should be cut: seven RMS values, infinite while there are fewer than 16 samples.
    pub fn outlier_limit(&self) -> f32 {
        if self.n < OUTLIER_MIN_SAMPLES {
            return f32::INFINITY;
        }
        let rms = ((self.volume_x2 + self.surface_x2) / self.n).sqrt();
        if rms > 0.0 { OUTLIER_RMS * rms } else { f32::INFINITY }
    }

    /// Mean distance of scattering, weighted by W; `None` if nothing can scatter.
    pub fn mean_volume_depth(&self) -> Option<f32> {
        mean_depth(self.w_depth, self.w)
    }

    /// Mean distance of the surface, weighted by T̂; `None` if nothing is seen of it. Background counts as 1e9.
    pub fn mean_surface_depth(&self) -> Option<f32> {
        mean_depth(self.t_depth, self.t)
    }
}

fn mean_depth(weighted: f32, weight: f32) -> Option<f32> {
    // Sums that decayed to subnormal numbers have lost digits.
    (weight > 0.0).then(|| (weighted / weight).min(FAR_DEPTH))
}

#[cfg(test)]
#[path = "moments_tests.rs"]
mod tests;

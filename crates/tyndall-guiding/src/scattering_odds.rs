//! The probability to scatter in a volume instead of reaching the surface behind it.
//!
//! A tracker walks a segment and finds candidates x_i of weights w_i; W = Σ w_i, and T̂ estimates the transmittance
//! (W + T̂ = 1 without roulette). Choosing the volume with *any* probability P_v that depends on the candidates only,
//! and weighting by W/P_v or T̂/(1-P_v), is unbiased as long as P_v > 0 where W > 0 and P_v < 1 where T̂ > 0.
//!
//! - Odds form (default): P_v = κW / (κW + T̂) minimises the variance of the segment if κ is the ratio of the RMS
//!   radiance scattered in at the candidates to the RMS radiance of the surface. κ holds no transmittance, so it stays
//!   valid while a density changes.
//! - Target form: P_v = P*' is a constant per pixel or region, as published (Xu et al. 2024, Algorithm 1).
//!
//! Both are mixed with delta tracking's choice W / (W + T̂) by the share α (0.75 in the paper's tests).

/// κ is kept between this and its inverse: past it the lesser class would starve and never correct the estimate.
const KAPPA_MAX: f32 = 1e3;
/// A class of weight above zero is chosen at least this often; 16 steps of a 24-bit random number.
const P_MIN: f32 = 1.0 / (1 << 20) as f32;
/// Range of the target form's P* (the published code's clamp).
const TARGET_RANGE: (f32, f32) = (1e-3, 0.999);

/// How much brighter, in RMS, the light scattered in along a ray is than the surface behind: κ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatteringOdds {
    kappa: f32,
}

impl Default for ScatteringOdds {
    /// κ = 1, which is delta tracking.
    fn default() -> Self {
        Self { kappa: 1.0 }
    }
}

impl ScatteringOdds {
    /// `kappa` is clamped to [1e-3, 1e3]; NaN becomes 1.
    #[inline]
    pub fn new(kappa: f32) -> Self {
        Self { kappa: if kappa.is_nan() { 1.0 } else { kappa.clamp(1.0 / KAPPA_MAX, KAPPA_MAX) } }
    }

    /// κ, in [1e-3, 1e3].
    #[inline]
    pub fn kappa(&self) -> f32 {
        self.kappa
    }

    /// P_v = α κW/(κW+T̂) + (1-α) W/(W+T̂), for `w` = W ≥ 0, `t_hat` = T̂ ≥ 0 and `alpha` in [0, 1].
    ///
    /// 0 if W is 0, else 1 if T̂ is 0, else strictly between.
    #[inline]
    pub fn select_probability(&self, w: f32, t_hat: f32, alpha: f32) -> f32 {
        let (w, t_hat, alpha) = (sane(w), sane(t_hat), sane(alpha).min(1.0));
        let odds = self.kappa * w;
        mix_strategies(odds / (odds + t_hat), w, t_hat, alpha)
    }

    /// The choice and both weights.
    #[inline]
    pub fn select(&self, w: f32, t_hat: f32, alpha: f32) -> Selection {
        Selection::new(self.select_probability(w, t_hat, alpha), w, t_hat)
    }

    /// P̂ = κW̄/(κW̄+T̄): the probability to expect before the candidates are known, from mean W and T̂. One half if
    /// both are 0.
    #[inline]
    pub fn predicted_probability(&self, mean_w: f32, mean_t_hat: f32) -> f32 {
        let (odds, t) = (self.kappa * sane(mean_w), sane(mean_t_hat));
        if odds + t > 0.0 { odds / (odds + t) } else { 0.5 }
    }
}

/// A learned or given probability P* to scatter on a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetProbability {
    target: f32,
}

impl TargetProbability {
    /// `target` is clamped to [0.001, 0.999]; NaN becomes one half.
    #[inline]
    pub fn new(target: f32) -> Self {
        let (low, high) = TARGET_RANGE;
        Self { target: if target.is_nan() { 0.5 } else { target.clamp(low, high) } }
    }

    /// P*, in [0.001, 0.999].
    #[inline]
    pub fn target(&self) -> f32 {
        self.target
    }

    /// P*' = P*/(1 - e^{-τ̄'}): made up for segments without a candidate, which cannot scatter. `depth` is the majorant
    /// depth actually walked, τ̄' of [`headroom_depth`]. At most 0.999, so that the surface is never lost.
    #[inline]
    pub fn compensated(&self, depth: f32) -> f32 {
        let p_candidate = -(-sane(depth)).exp_m1();
        // Written without a division by zero, for depth 0.
        if self.target < TARGET_RANGE.1 * p_candidate { self.target / p_candidate } else { TARGET_RANGE.1 }
    }

    /// P_v = α P*' + (1-α) W/(W+T̂), with the same edge cases as [`ScatteringOdds::select_probability`].
    #[inline]
    pub fn select_probability(&self, w: f32, t_hat: f32, depth: f32, alpha: f32) -> f32 {
        mix_strategies(self.compensated(depth), sane(w), sane(t_hat), sane(alpha).min(1.0))
    }

    /// The choice and both weights.
    #[inline]
    pub fn select(&self, w: f32, t_hat: f32, depth: f32, alpha: f32) -> Selection {
        Selection::new(self.select_probability(w, t_hat, depth, alpha), w, t_hat)
    }
}

/// τ̄' = max(τ̄, -ln(1 - min(P̂, 0.79)/0.8)): the majorant depth to walk so that a probability P̂ can be reached with one
/// fifth of the surface's share to spare. The majorant is scaled by τ̄'/τ̄. At most 4.4 unless τ̄ is larger.
#[inline]
pub fn headroom_depth(majorant_depth: f32, predicted: f32) -> f32 {
    let needed = -(-sane(predicted).min(0.79) / 0.8).ln_1p();
    needed.max(majorant_depth)
}

/// The probability of the first of two strategies that minimises the variance of choosing between them:
/// P = a/(a+b) for the RMS values a, b of the two estimates (their means give the published contribution criterion).
/// One half if both are 0.
#[inline]
pub fn optimal_probability(rms_volume: f32, rms_surface: f32) -> f32 {
    let (a, b) = (sane(rms_volume), sane(rms_surface));
    if a + b > 0.0 { a / (a + b) } else { 0.5 }
}

/// The probability to choose the volume and what the throughput is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selection {
    /// P_v.
    pub probability: f32,
    /// W/P_v; 0 if the volume cannot be chosen.
    pub volume_weight: f32,
    /// T̂/(1-P_v); 0 if the surface cannot be reached.
    pub surface_weight: f32,
}

impl Selection {
    #[inline]
    fn new(probability: f32, w: f32, t_hat: f32) -> Self {
        let divide = |weight: f32, p: f32| if p > 0.0 { weight / p } else { 0.0 };
        Self {
            probability,
            volume_weight: divide(sane(w), probability),
            surface_weight: divide(sane(t_hat), 1.0 - probability),
        }
    }
}

#[inline]
fn mix_strategies(guided: f32, w: f32, t_hat: f32, alpha: f32) -> f32 {
    if w == 0.0 {
        return 0.0;
    }
    if t_hat == 0.0 {
        return 1.0;
    }
    (alpha * guided + (1.0 - alpha) * (w / (w + t_hat))).clamp(P_MIN, 1.0 - P_MIN)
}

/// Non-negative and far from overflow; NaN becomes 0.
#[inline]
fn sane(v: f32) -> f32 {
    if v.is_nan() { 0.0 } else { v.clamp(0.0, 1e30) }
}

#[cfg(test)]
#[path = "scattering_odds_tests.rs"]
mod tests;

//! Which light to ask next.
//!
//! Up to [`MAX_WEIGHED`] lights are weighed for every receiver by a guess of what they send there; more are drawn by
//! power, half of the time, and otherwise uniformly. A light is never left out unless it certainly sends nothing.

use super::Light;
use glam::Vec3A;
use tyndall_math::sampling::PiecewiseConstant1D;

/// Sets up to this size are weighed for every receiver.
const MAX_WEIGHED: usize = 16;
/// Share of the uniform choice in weighed sets: guesses ignore occlusion and orientation.
const UNIFORM_SHARE: f64 = 0.2;

/// All lights of a scene.
#[derive(Debug, Clone)]
pub struct LightSet {
    /// The lights; indices into this are what sampling returns.
    pub lights: Vec<Light>,
    /// By power, for large sets.
    by_power: Option<PiecewiseConstant1D>,
}

impl LightSet {
    /// Prepares the choice; `scene_radius` turns the irradiance of lights at infinity into power.
    pub fn build(lights: Vec<Light>, scene_radius: f32) -> Self {
        let by_power = (lights.len() > MAX_WEIGHED).then(|| {
            let radius = f64::from(scene_radius.clamp(f32::MIN_POSITIVE, f32::MAX));
            let powers: Vec<f64> = lights.iter().map(|l| l.flux(radius)).collect();
            let largest = powers.iter().copied().fold(0.0, f64::max);
            let weights: Vec<f32> = powers.iter().map(|p| (p / largest) as f32).collect();
            PiecewiseConstant1D::new(&weights)
        });
        Self { lights, by_power }
    }

    /// Chooses a light for the receiver at `from`: its index and the probability of that choice.
    #[inline]
    pub fn sample_light(&self, from: Vec3A, u: f32) -> Option<(usize, f32)> {
        match (&self.by_power, self.lights.len()) {
            (_, 0) => None,
            (None, 1) => Some((0, 1.0)),
            (None, _) => self.weigh(from).choose(u),
            (Some(by_power), n) => {
                let index = if u < 0.5 {
                    by_power.sample(2.0 * u).cell
                } else {
                    (((2.0 * u - 1.0) * n as f32) as usize).min(n - 1)
                };
                Some((index, self.mixed_probability(by_power, index)))
            }
        }
    }

    /// The probability with which [`Self::sample_light`] chooses light `index`.
    #[inline]
    pub fn probability(&self, from: Vec3A, index: usize) -> f32 {
        match (&self.by_power, self.lights.len()) {
            (_, n) if index >= n => 0.0,
            (None, 1) => 1.0,
            (None, _) => self.weigh(from).probabilities[index],
            (Some(by_power), _) => self.mixed_probability(by_power, index),
        }
    }

    fn mixed_probability(&self, by_power: &PiecewiseConstant1D, index: usize) -> f32 {
        0.5 * by_power.probability(index) + 0.5 / self.lights.len() as f32
    }

    fn weigh(&self, from: Vec3A) -> Choice {
        let n = self.lights.len();
        let mut weights = [0.0f64; MAX_WEIGHED];
        for (weight, light) in weights.iter_mut().zip(&self.lights) {
            *weight = light.importance(from).max(0.0).min(f64::MAX / MAX_WEIGHED as f64);
        }
        let total: f64 = weights.iter().sum();
        let n_candidates = weights.iter().filter(|w| **w > 0.0).count();
        let mut probabilities = [0.0; MAX_WEIGHED];
        for (p, weight) in probabilities.iter_mut().zip(weights).filter(|(_, w)| *w > 0.0) {
            *p = ((1.0 - UNIFORM_SHARE) * (weight / total) + UNIFORM_SHARE / n_candidates as f64) as f32;
        }
        Choice { probabilities, n }
    }
}

/// Probabilities of the lights of a small set at one receiver.
struct Choice {
    probabilities: [f32; MAX_WEIGHED],
    n: usize,
}

impl Choice {
    fn choose(&self, u: f32) -> Option<(usize, f32)> {
        let mut left = u;
        let mut last = None;
        for (index, &p) in self.probabilities[..self.n].iter().enumerate().filter(|(_, p)| **p > 0.0) {
            last = Some((index, p));
            if left < p {
                break;
            }
            left -= p;
        }
        last
    }
}

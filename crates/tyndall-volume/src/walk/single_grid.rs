//! One grid, grey extinction: delta tracking with the albedo as weight.

use super::{Event, LONG_WALK, Present, Walk, WalkStats, survives_length};
use crate::majorant::GridWalk;
use crate::medium::GridDensity;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Samples the collision. The medium scatters.
pub(super) fn sample(
    present: &Present<'_>,
    density: &GridDensity,
    ray: &Ray,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Walk {
    let c = &present.coefficients;
    let sigma_t = c.sigma_t.x;
    let mut walk = GridWalk::new(density, ray, present.t.map(|t| t as f32), sigma_t);
    let mut result = Walk::pass(Rgb::ONE);
    let (mut n, mut lookups) = (0u32, 0u64);
    let mut remaining = f64::from(rng.next_exponential());
    'walk: while let Some(step) = walk.next() {
        let sigma_bar = sigma_t * step.max;
        let (length, rate, mut s) = (f64::from(step.t1) - f64::from(step.t0), f64::from(sigma_bar), 0f64);
        let certain = step.min / step.max;
        while remaining < (length - s) * rate {
            s += remaining / rate;
            remaining = f64::from(rng.next_exponential());
            n += 1;
            let t = ((f64::from(step.t0) + s) as f32).min(step.t1);
            let u = rng.next_f32();
            // Below the brick's minimum the collision is real whatever the voxels say.
            let mut p = certain;
            if u >= certain {
                lookups += 1;
                p = sigma_t * walk.density(&step, t) / sigma_bar;
            }
            let (mut real_weight, mut null_weight) = (1.0, 1.0);
            if p > 1.0 {
                result.majorant_violations += 1;
                (real_weight, null_weight, p) = (p / 0.75, (1.0 - p) / 0.25, 0.75);
            }
            if u < p {
                let phase = present.medium.phase;
                (result.event, result.weight) =
                    (Event::Scatter { t: f64::from(t), phase }, result.weight * c.albedo() * real_weight);
                break 'walk;
            }
            result.weight *= null_weight;
            if n.is_multiple_of(LONG_WALK) {
                result.weight *= if survives_length(rng) { 2.0 } else { 0.0 };
                if result.weight == Rgb::ZERO {
                    break 'walk;
                }
            }
        }
        remaining -= (length - s) * rate;
    }
    stats.candidates += u64::from(n);
    stats.lookups += lookups;
    stats.majorant_violations += u64::from(result.majorant_violations);
    result
}

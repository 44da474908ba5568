//! The part of light that passes a segment unscattered.
//!
//! Transmittance of overlapping media is a product, so every medium is taken alone: homogeneous ones exactly, grids by
//! residual ratio tracking (Novák, Selle & Jarosz 2014, doi:10.1145/2661229.2661292) with each cell's minimum as the
//! control: exact in uniform bricks, and never noisier than ratio tracking. Independent unbiased factors multiply to
//! an unbiased product. A product that has become faint must survive a roulette, so dense media cost a few look-ups.

use crate::majorant::GridWalk;
use crate::medium::{GridDensity, Medium, Span};
use crate::walk::{LONG_WALK, WalkStats, survives_length};
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Below this the product must survive a roulette, ...
const FAINT: f32 = 0.05;
/// ... with this probability.
const SURVIVAL: f32 = 0.25;

/// Transmittance from `ray.origin` to `ray.t_max` per channel: exact without grids, an unbiased estimate with them.
///
/// In [0, 1 / survival] per channel; 0 is returned as soon as it is certain.
pub fn transmittance(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Rgb {
    let mut depth = Rgb::ZERO;
    let mut has_grid = false;
    let present =
        |span: &Span| Some((span.clipped(ray)?, media.get(span.medium as usize)?)).map(|(t, m)| (t, m, m.coefficients()));
    for ([t0, t1], medium, c) in spans.iter().filter_map(present) {
        has_grid |= medium.density.is_some();
        if medium.density.is_none() && c.sigma_t != Rgb::ZERO {
            depth += Rgb::select(c.sigma_t.cmpgt(Rgb::ZERO), c.sigma_t * (t1 - t0), Rgb::ZERO);
        }
    }
    let mut product = (-depth).exp();
    if !has_grid {
        return product;
    }
    for (t, medium, c) in spans.iter().filter_map(present) {
        let Some(density) = &medium.density else { continue };
        if c.sigma_t != Rgb::ZERO && product != Rgb::ZERO {
            product = through_grid(density, c.sigma_t, ray, t, product, rng, stats);
        }
    }
    product
}

/// `product` times the transmittance of one grid.
fn through_grid(
    density: &GridDensity,
    sigma_t: Rgb,
    ray: &Ray,
    t: [f32; 2],
    mut product: Rgb,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Rgb {
    let largest = sigma_t.max_element();
    let relative = sigma_t / largest;
    let mut walk = GridWalk::new(density, ray, t, largest);
    // Optical depth of the control, at the largest channel; applied when the product is judged and at the end.
    let mut control = 0f32;
    let mut n = 0u32;
    let mut remaining = f64::from(rng.next_exponential());
    while let Some(step) = walk.next() {
        let length = f64::from(step.t1) - f64::from(step.t0);
        control += largest * step.min * (step.t1 - step.t0);
        let residual = step.max - step.min;
        let rate = f64::from(largest * residual);
        let mut s = 0f64;
        while s + remaining / rate < length {
            s += remaining / rate;
            remaining = f64::from(rng.next_exponential());
            n += 1;
            let t = ((f64::from(step.t0) + s) as f32).min(step.t1);
            let excess = (walk.density(&step, t) - step.min) / residual;
            stats.majorant_violations += u64::from(excess > 1.0 + 4.0 * f32::EPSILON);
            product *= Rgb::ONE - relative * excess;
            let visible = product.abs().max_element();
            if visible < FAINT && !roulette(&mut product, rng) {
                stats.candidates += u64::from(n);
                stats.lookups += u64::from(n);
                return Rgb::ZERO;
            }
            if n.is_multiple_of(LONG_WALK) {
                product *= if survives_length(rng) { 2.0 } else { 0.0 };
            }
        }
        if rate > 0.0 {
            remaining -= (length - s) * rate;
        }
        if control > 3.0 {
            product *= (-relative * control).exp();
            control = 0.0;
            if product.abs().max_element() < FAINT && !roulette(&mut product, rng) {
                break;
            }
        }
    }
    stats.candidates += u64::from(n);
    stats.lookups += u64::from(n);
    product * (-relative * control).exp()
}

/// Ends most faint products and raises the others.
#[inline]
fn roulette(product: &mut Rgb, rng: &mut Pcg) -> bool {
    let survives = *product != Rgb::ZERO && rng.next_f32() < SURVIVAL;
    *product = if survives { *product / SURVIVAL } else { Rgb::ZERO };
    survives
}

#[cfg(test)]
mod tests;

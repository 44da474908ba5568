//! Segments without grids: everything in closed form.

use super::channels::{choose_channel, exponential};
use super::closed_form::{attenuation, mean_free_integral, optical_depth};
use super::segment::{Cell, Segment};
use super::{Event, Present, Walk};
use crate::phase::PhaseMix;
use glam::Vec3A;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;

/// One medium, grey extinction: plain exponential sampling with the albedo as weight.
#[inline]
pub(super) fn sample_one(present: &Present<'_>, rng: &mut Pcg) -> Walk {
    let (c, [t0, t1]) = (&present.coefficients, present.t);
    let emission =
        if c.emission == Rgb::ZERO { Rgb::ZERO } else { c.emission * mean_free_integral(c.sigma_t, t1 - t0) };
    if !c.scatters() {
        return Walk { emission, ..Walk::pass(attenuation(c.sigma_t, t1 - t0)) };
    }
    let (tau, sigma_t) = (exponential(rng), c.sigma_t.x);
    if tau >= sigma_t * (t1 - t0) {
        return Walk { emission, ..Walk::pass(Rgb::ONE) };
    }
    // `sigma_t * (t1 - t0) > tau` does not quite imply `t < t1` in f32.
    let t = (t0 + tau / sigma_t).min(t1);
    let event = Event::Scatter { t, phase: PhaseMix::single(present.medium.phase) };
    Walk { event, weight: c.albedo(), emission, majorant_violations: 0 }
}

/// Any number of media: one-sample MIS between the channels' exponential distributions.
///
/// pdf(t) = Σ_c q_c σ_c(t) exp(-τ_c(t)) with q_c ∝ |β_c|; τ only grows in cells where something scatters, absorption
/// elsewhere is the factor `absorbed`.
pub(super) fn sample(segment: &mut Segment<'_>, channels: Vec3A, rng: &mut Pcg) -> Walk {
    let channel = choose_channel(channels, rng);
    let drawn = exponential(rng);
    let (mut tau, mut absorbed) = (Rgb::ZERO, Rgb::ZERO);
    let mut walk: Option<Walk> = None;
    let mut emission = Rgb::ZERO;
    while let Some(cell) = segment.next_cell() {
        let (c, dt) = (&cell.homogeneous, cell.t1 - cell.t0);
        if c.emission != Rgb::ZERO {
            emission += (-(tau + absorbed)).exp() * c.emission * mean_free_integral(c.sigma_t, dt);
        }
        let depth = optical_depth(c.sigma_t, dt);
        if !c.scatters() {
            absorbed += depth;
        } else {
            if walk.is_none() && tau[channel] + depth[channel] > drawn {
                let ds = (drawn - tau[channel]).max(0.0) / c.sigma_t[channel];
                walk = Some(scatter(segment, &cell, ds, tau, absorbed, channels, rng));
            }
            tau += depth;
        }
        if walk.is_some() && !segment.emits() {
            break;
        }
    }
    let passed = || {
        let transmitted = (-tau).exp();
        let probability = transmitted.dot(channels);
        if probability > 0.0 { (-absorbed).exp() * transmitted / probability } else { Rgb::ZERO }
    };
    let walk = walk.unwrap_or_else(|| Walk::pass(passed()));
    Walk { emission, ..walk }
}

/// The collision `ds` behind the beginning of `cell`, where the optical depths are `tau` and `absorbed`.
fn scatter(
    segment: &mut Segment<'_>,
    cell: &Cell,
    ds: f32,
    tau: Rgb,
    absorbed: Rgb,
    channels: Vec3A,
    rng: &mut Pcg,
) -> Walk {
    let t = (cell.t0 + ds).min(cell.t1);
    let sigma_t = cell.homogeneous.sigma_t;
    // Relative to the largest coefficient: 1e12 per unit must not overflow.
    let scale = sigma_t.max_element().recip();
    let transmitted = (-(tau + optical_depth(sigma_t, ds))).exp();
    let pdf = (channels * sigma_t * scale).dot(transmitted);
    let (phase, sigma_s) = segment.scatter(channels, rng);
    let weight = (-absorbed).exp() * transmitted * (sigma_s * scale);
    let weight = if pdf > 0.0 { weight / pdf } else { Rgb::ZERO };
    Walk { event: Event::Scatter { t, phase }, weight, emission: Rgb::ZERO, majorant_violations: 0 }
}

//! Collisions on segments without grids: everything in closed form.

use super::channels::{choose_channel, exponential};
use super::closed_form::{attenuation, optical_depth};
use super::segment::{Cell, Segment};
use super::{Event, Present, Walk};
use glam::Vec3A;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;

/// One medium, grey extinction: plain exponential sampling with the albedo as weight.
#[inline]
pub(super) fn sample_one(present: &Present<'_>, rng: &mut Pcg) -> Walk {
    let (c, [t0, t1]) = (&present.coefficients, present.t);
    if !c.scatters() {
        return Walk::pass(attenuation(c.sigma_t, (t1 - t0) as f32));
    }
    let (tau, sigma_t) = (exponential(rng), c.sigma_t.x);
    if tau >= sigma_t * (t1 - t0) as f32 {
        return Walk::pass(Rgb::ONE);
    }
    // `tau < sigma_t * (t1 - t0)` does not quite imply `t < t1`.
    let t = (t0 + f64::from(tau / sigma_t)).min(t1);
    let event = Event::Scatter { t, phase: present.medium.phase };
    Walk::scatter(event, c.albedo())
}

/// Any number of media: one-sample MIS between the channels' exponential distributions.
///
/// pdf(t) = Σ_c q_c σ_c(t) exp(-τ_c(t)) with q_c ∝ |β_c|; τ only grows in cells where something scatters, absorption
/// elsewhere is the factor `absorbed`.
pub(super) fn sample(segment: &mut Segment<'_>, channels: Vec3A, rng: &mut Pcg) -> Walk {
    let channel = choose_channel(channels, rng);
    let drawn = exponential(rng);
    let (mut tau, mut absorbed) = (Rgb::ZERO, Rgb::ZERO);
    while let Some(cell) = segment.next_cell() {
        let (c, dt) = (&cell.homogeneous, cell.length() as f32);
        let depth = optical_depth(c.sigma_t, dt);
        if !c.scatters() {
            absorbed += depth;
            continue;
        }
        if tau[channel] + depth[channel] > drawn {
            let ds = (drawn - tau[channel]).max(0.0) / c.sigma_t[channel];
            return scatter(segment, &cell, ds, tau, absorbed, channels, rng);
        }
        tau += depth;
    }
    let transmitted = (-tau).exp();
    let probability = transmitted.dot(channels);
    let passed = if probability > 0.0 { (-absorbed).exp() * transmitted / probability } else { Rgb::ZERO };
    Walk::pass(passed)
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
    let t = (cell.t0 + f64::from(ds)).min(cell.t1);
    let sigma_t = cell.homogeneous.sigma_t;
    // Relative to the largest coefficient: 1e12 per unit must not overflow.
    let scale = sigma_t.max_element().recip();
    let transmitted = (-(tau + optical_depth(sigma_t, ds))).exp();
    let pdf = (channels * sigma_t * scale).dot(transmitted);
    let (phase, sigma_s) = segment.scatter(channels, rng);
    let weight = (-absorbed).exp() * transmitted * (sigma_s * scale);
    let weight = if pdf > 0.0 { weight / pdf } else { Rgb::ZERO };
    Walk::scatter(Event::Scatter { t, phase }, weight)
}

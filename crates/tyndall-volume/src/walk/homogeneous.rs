//! Collisions on segments without grids: everything in closed form.

use super::channels::{choose_channel, exponential};
use super::closed_form::{attenuation, optical_depth};
use super::resample::{CandidateSums, Outcomes};
use super::segment::{Cell, Segment};
use super::{Event, Present, Walk};
use crate::medium::Coefficients;
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

/// What passes a segment without grids, and where the rest scatters: the closed forms behind a chosen probability.
pub(super) struct Transmitted {
    channels: Vec3A,
    /// Optical depth where something scatters, and where nothing does.
    tau: Rgb,
    absorbed: Rgb,
}

impl Transmitted {
    /// Of one medium.
    #[inline]
    pub(super) fn of_one(present: &Present<'_>, channels: Vec3A) -> Self {
        let depth = optical_depth(present.coefficients.sigma_t, (present.t[1] - present.t[0]) as f32);
        if present.coefficients.scatters() {
            Self { channels, tau: depth, absorbed: Rgb::ZERO }
        } else {
            Self { channels, tau: Rgb::ZERO, absorbed: depth }
        }
    }

    /// Of all that is left of `segment`.
    pub(super) fn of(segment: &mut Segment<'_>, channels: Vec3A) -> Self {
        let mut sum = Self { channels, tau: Rgb::ZERO, absorbed: Rgb::ZERO };
        while let Some(cell) = segment.next_cell() {
            let depth = optical_depth(cell.homogeneous.sigma_t, cell.length() as f32);
            *if cell.scatters { &mut sum.tau } else { &mut sum.absorbed } += depth;
        }
        sum
    }

    /// W = Σ_c q_c (1 - T_c) and T̂ = Σ_c q_c T_c, with the channels' shares q_c as in [`sample`].
    #[inline]
    pub(super) fn outcomes(&self) -> Outcomes {
        let transmitted = (-self.tau).exp();
        let (w, t_hat) = (self.scattered().element_sum(), transmitted.dot(self.channels));
        let pass = if t_hat > 0.0 { (-self.absorbed).exp() * transmitted / t_hat } else { Rgb::ZERO };
        let sums = CandidateSums { w, t_hat, majorant_depth: f32::INFINITY };
        Outcomes { sums, pass, violations: 0 }
    }

    /// q_c (1 - T_c).
    #[inline]
    fn scattered(&self) -> Vec3A {
        let one_minus = |tau: f32| -(-tau).exp_m1();
        self.channels * Vec3A::new(one_minus(self.tau.x), one_minus(self.tau.y), one_minus(self.tau.z))
    }

    /// A channel drawn by what it scatters, and the optical depth in it at which it does.
    #[inline]
    fn draw(&self, u: f32) -> (usize, f32) {
        let scattered = self.scattered();
        let mut rest = u * scattered.element_sum();
        let mut channel = scattered.max_position();
        for c in 0..3 {
            if scattered[c] > 0.0 && rest < scattered[c] {
                channel = c;
                break;
            }
            rest -= scattered[c];
        }
        // 1 - T of the channel times a uniform number: 1 - exp(-depth).
        let depth = -(-(rest / self.channels[channel]).clamp(0.0, 1.0)).ln_1p();
        (channel, depth.min(self.tau[channel]))
    }

    /// A collision in the medium of [`Self::of_one`], and its weight with 1/W left out.
    #[inline]
    pub(super) fn scatter_in_one(&self, present: &Present<'_>, u: f32) -> (Event, Rgb) {
        let (channel, depth) = self.draw(u);
        let (c, [t0, t1]) = (&present.coefficients, present.t);
        let ds = depth / c.sigma_t[channel];
        let event = Event::Scatter { t: (t0 + f64::from(ds)).min(t1), phase: present.medium.phase };
        if c.is_achromatic() {
            return (event, c.albedo());
        }
        (event, mixture_weight(c, ds, Rgb::ZERO, Rgb::ZERO, c.sigma_s, self.channels))
    }

    /// A collision on the segment of [`Self::of`], made anew, and its weight with 1/W left out.
    pub(super) fn scatter(&self, segment: &mut Segment<'_>, u: f32, rng: &mut Pcg) -> Option<(Event, Rgb)> {
        let (channel, depth) = self.draw(u);
        let (mut tau, mut absorbed) = (Rgb::ZERO, Rgb::ZERO);
        while let Some(cell) = segment.next_cell() {
            let of_cell = optical_depth(cell.homogeneous.sigma_t, cell.length() as f32);
            if !cell.scatters {
                absorbed += of_cell;
                continue;
            }
            let sigma = cell.homogeneous.sigma_t[channel];
            // The same sums as in `of`, so that the last cell is reached in spite of rounding.
            if sigma > 0.0 && tau[channel] + of_cell[channel] >= depth {
                let ds = (depth - tau[channel]).max(0.0) / sigma;
                let walk = scatter(segment, &cell, ds, tau, absorbed, self.channels, rng);
                return Some((walk.event, walk.weight));
            }
            tau += of_cell;
        }
        None
    }
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
    let (phase, sigma_s) = segment.scatter(channels, rng);
    let weight = mixture_weight(&cell.homogeneous, ds, tau, absorbed, sigma_s, channels);
    Walk::scatter(Event::Scatter { t, phase }, weight)
}

/// σ_s T / pdf of the channels' mixture, `ds` behind the beginning of a cell of coefficients `c`.
#[inline]
fn mixture_weight(c: &Coefficients, ds: f32, tau: Rgb, absorbed: Rgb, sigma_s: Rgb, channels: Vec3A) -> Rgb {
    // Relative to the largest coefficient: 1e12 per unit must not overflow.
    let scale = c.sigma_t.max_element().recip();
    let transmitted = (-(tau + optical_depth(c.sigma_t, ds))).exp();
    let pdf = (channels * c.sigma_t * scale).dot(transmitted);
    let weight = (-absorbed).exp() * transmitted * (sigma_s * scale);
    if pdf > 0.0 { weight / pdf } else { Rgb::ZERO }
}

//! What media shine along a segment: ∫ T(t) ε(t) dt.
//!
//! Estimated apart from collisions: a walk that ends in smoke would see the fire behind it only as often as it gets
//! there, and its candidates, which follow extinction, would never meet fire in clear air. Three parts:
//! - *Where* emission is read: at equal steps of m(t) = ∫ r dt with one random offset (systematic sampling), r being a
//!   few per voxel and at least the bound of extinction, so that thick smoke is sampled at its depth. A point at t
//!   stands for the length 1 / r. The steps depend on bounds alone, never on what is found: the sum is unbiased.
//! - *How much* of it arrives: T by residual ratio tracking (Novák, Selle & Jarosz 2014, doi:10.1145/2661229.2661292),
//!   an independent unbiased factor, exact where extinction is uniform.
//! - Cells without grids in closed form.
//!
//! What little is left is decided by roulette, so dense smoke ends the work after a few mean free paths. Segments
//! without emissive media pay one test per span.

use super::closed_form::{attenuation, mean_free_integral};
use super::segment::{Cell, Segment};
use super::{LONG_WALK, WalkStats, survives_length};
use crate::medium::{Medium, Span};
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Below this a channel of the transmittance must survive a roulette.
const FAINT: f32 = 0.005;
/// Probability to survive.
const SURVIVAL: f32 = 0.25;
/// Most points in a cell on account of its extinction: no density can hang a render.
const MOST_BY_DEPTH: f64 = 64.0;

/// Where the last emissive medium on the segment ends; `None` if nothing shines.
#[inline]
pub(super) fn last_emissive(media: &[Medium], spans: &[Span], ray: &Ray) -> Option<f64> {
    let emits = |span: &&Span| media.get(span.medium as usize).is_some_and(Medium::emits);
    let ends = spans.iter().filter(emits).filter_map(|span| span.clipped(ray));
    ends.map(|[_, t1]| t1).reduce(f64::max)
}

/// An unbiased estimate of the emission seen from the ray's origin; exact without grids.
pub(super) fn gather(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Rgb {
    let mut segment = Segment::with_emission(media, spans, ray);
    let mut view = View { through: Rgb::ONE, seen: Rgb::ZERO, to_point: 0.0, to_candidate: 0.0, n: 0 };
    if !segment.is_homogeneous() {
        view.to_point = f64::from(rng.next_f32());
        view.to_candidate = f64::from(rng.next_exponential());
    }
    while let Some(cell) = segment.next_cell() {
        if cell.n_grids == 0 {
            view.cross_homogeneous(&cell);
        } else {
            view.cross(&mut segment, &cell, rng, stats);
        }
        if view.through == Rgb::ZERO {
            break;
        }
    }
    stats.candidates += u64::from(view.n);
    view.seen
}

/// `through` times an unbiased estimate of the transmittance of one span, whose extinction may be anything.
pub(crate) fn attenuate_by_candidates(
    media: &[Medium],
    span: &Span,
    ray: &Ray,
    through: Rgb,
    rng: &mut Pcg,
    stats: &mut WalkStats,
) -> Rgb {
    let mut segment = Segment::new(media, std::slice::from_ref(span), ray);
    let to_candidate = f64::from(rng.next_exponential());
    let mut view = View { through, seen: Rgb::ZERO, to_point: 0.0, to_candidate, n: 0 };
    while let Some(cell) = segment.next_cell() {
        view.cross(&mut segment, &cell, rng, stats);
        if view.through == Rgb::ZERO {
            break;
        }
    }
    stats.candidates += u64::from(view.n);
    view.through
}

/// The way of light back to the ray's origin, while it is followed.
struct View {
    /// Unbiased estimate of the transmittance up to here.
    through: Rgb,
    /// What was found.
    seen: Rgb,
    /// Steps of m(t) to the next point at which emission is read.
    to_point: f64,
    /// Optical depth of the residual extinction to the next candidate.
    to_candidate: f64,
    /// Candidates so far.
    n: u32,
}

impl View {
    fn cross_homogeneous(&mut self, cell: &Cell) {
        let (sigma_t, dt) = (cell.homogeneous.sigma_t, cell.length() as f32);
        if cell.emits {
            self.seen += self.through * cell.glow * mean_free_integral(sigma_t, dt);
        }
        self.through *= attenuation(sigma_t, dt);
    }

    /// A cell with grids: points and candidates in the order of the ray.
    fn cross(&mut self, segment: &mut Segment<'_>, cell: &Cell, rng: &mut Pcg, stats: &mut WalkStats) {
        let length = cell.length();
        let points = points_per_length(cell, length);
        // `through` holds the attenuation by the lower bound up to here.
        let (mut s, mut attenuated_to) = (0f64, 0f64);
        while self.through != Rgb::ZERO {
            let candidates = self.candidates_per_length(cell);
            let point = if points > 0.0 { self.to_point / points } else { f64::INFINITY };
            let candidate = if candidates > 0.0 { self.to_candidate / candidates } else { f64::INFINITY };
            let step = point.min(candidate);
            if step >= length - s {
                self.advance(length - s, points, candidates);
                break;
            }
            s += step;
            self.advance(step, points, candidates);
            let t = (cell.t0 + s).min(cell.t1);
            if candidate <= point {
                self.to_candidate = f64::from(rng.next_exponential());
                self.collide(segment, cell, t, candidates as f32, rng, stats);
            } else {
                self.to_point = 1.0;
                self.through *= attenuation(cell.sigma_min, (s - attenuated_to) as f32);
                attenuated_to = s;
                stats.lookups += u64::from(cell.n_grids);
                self.seen += self.through * segment.emission_at(cell, t) * (points.recip() as f32);
                self.roulette(rng);
            }
        }
        self.through *= attenuation(cell.sigma_min, (length - attenuated_to) as f32);
        self.roulette(rng);
    }

    /// Moves on by a length.
    #[inline]
    fn advance(&mut self, length: f64, points: f64, candidates: f64) {
        self.to_point = (self.to_point - length * points).max(0.0);
        self.to_candidate = (self.to_candidate - length * candidates).max(0.0);
    }

    /// Largest residual extinction among channels that are not dark.
    #[inline]
    fn candidates_per_length(&self, cell: &Cell) -> f64 {
        let live = self.through.cmpne(Rgb::ZERO);
        f64::from(Rgb::select(live, cell.sigma_bar - cell.sigma_min, Rgb::ZERO).max_element())
    }

    /// A candidate of the residual extinction.
    fn collide(
        &mut self,
        segment: &mut Segment<'_>,
        cell: &Cell,
        t: f64,
        rate: f32,
        rng: &mut Pcg,
        stats: &mut WalkStats,
    ) {
        self.n += 1;
        stats.lookups += u64::from(cell.n_grids);
        let residual = (segment.coefficients_at(cell, t).sigma_t - cell.sigma_min) / rate;
        let live = self.through.cmpne(Rgb::ZERO);
        let largest = Rgb::select(live, residual, Rgb::ZERO).max_element();
        stats.majorant_violations += u64::from(largest > 1.0 + 4.0 * f32::EPSILON);
        self.through *= Rgb::ONE - residual;
        if self.n.is_multiple_of(LONG_WALK) {
            self.through *= if survives_length(rng) { 2.0 } else { 0.0 };
        }
        self.roulette(rng);
    }

    /// Ends most faint channels and raises the others. Grey light stays grey: all channels share the number.
    #[inline]
    fn roulette(&mut self, rng: &mut Pcg) {
        let is_faint = self.through.abs().cmplt(Rgb::splat(FAINT)) & self.through.cmpne(Rgb::ZERO);
        if is_faint.any() {
            let survivors = if rng.next_f32() < SURVIVAL { self.through / SURVIVAL } else { Rgb::ZERO };
            self.through = Rgb::select(is_faint, survivors, self.through);
        }
    }
}

/// Points per unit of `t` at which emission is read: a function of bounds alone. The cap is far above what an estimate
/// needs; beyond it extinction is so strong that only the first point counts.
#[inline]
fn points_per_length(cell: &Cell, length: f64) -> f64 {
    if !cell.emits {
        return 0.0;
    }
    let by_depth = f64::from(cell.sigma_bar.max_element()).min(MOST_BY_DEPTH / length);
    by_depth.max(f64::from(cell.emission_rate))
}

#[cfg(test)]
mod tests;

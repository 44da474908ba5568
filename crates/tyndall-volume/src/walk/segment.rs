//! Overlapping spans cut into cells: intervals in which the same media are present and bounds are constant.

use super::Present;
use crate::majorant::{GridStep, GridWalk};
use crate::medium::{Coefficients, Medium, Span};
use crate::phase::{MAX_LOBES, Phase, PhaseMix};
use arrayvec::ArrayVec;
use glam::Vec3A;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Spans kept without allocation; more go to the heap.
const INLINE: usize = 8;

/// One medium along the ray.
struct Track<'a> {
    coefficients: Coefficients,
    phase: Phase,
    /// The homogeneous span, or the current step of the grid.
    t0: f32,
    t1: f32,
    grid: Option<(GridWalk<'a>, Option<GridStep>)>,
    is_active: bool,
    /// At the point last asked for; 1 for homogeneous media.
    density: f32,
}

#[allow(clippy::large_enum_variant, reason = "the large variant is the common one: no allocation")]
enum Tracks<'a> {
    Inline(ArrayVec<Track<'a>, INLINE>),
    Heap(Vec<Track<'a>>),
}

/// An interval of the segment in which the same media are present.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Where it begins.
    pub t0: f32,
    /// Where it ends, greater than `t0`; may be infinite.
    pub t1: f32,
    /// Sum of the homogeneous media: exact.
    pub homogeneous: Coefficients,
    /// Bound of the sum of all media's extinction, per channel.
    pub sigma_bar: Rgb,
    /// Grids present.
    pub n_grids: u32,
    /// Something may scatter.
    pub scatters: bool,
    /// Least rate of candidates, per unit of `t`, with which emission of grids is estimated; 0 without.
    pub emission_rate: f32,
}

/// The media along a ray up to its end, visited front to back.
pub struct Segment<'a> {
    tracks: Tracks<'a>,
    t: f32,
    emits: bool,
    is_homogeneous: bool,
}

impl<'a> Segment<'a> {
    /// The segment of `ray` through `spans`, which may overlap and come in any order.
    pub fn new(media: &'a [Medium], spans: &[Span], ray: &Ray) -> Self {
        let mut tracks = Tracks::Inline(ArrayVec::new());
        let (mut emits, mut is_homogeneous) = (false, true);
        for present in spans.iter().filter_map(|span| Present::new(media, span, ray)) {
            emits |= present.coefficients.emission != Rgb::ZERO;
            is_homogeneous &= present.medium.density.is_none();
            tracks.push(Track::new(&present, ray));
        }
        Self { tracks, t: 0.0, emits, is_homogeneous }
    }

    /// No grids: cells are exact, [`Cell::homogeneous`] is all there is.
    pub fn is_homogeneous(&self) -> bool {
        self.is_homogeneous
    }

    /// Something emits.
    pub fn emits(&self) -> bool {
        self.emits
    }

    /// The next cell that contains anything.
    pub fn next_cell(&mut self) -> Option<Cell> {
        loop {
            let (t, mut next, mut any) = (self.t, f32::INFINITY, false);
            for track in self.tracks.as_mut_slice() {
                track.advance(t);
                track.is_active = track.t0 <= t && t < track.t1;
                any |= track.is_active;
                next = next.min(if track.is_active { track.t1 } else { track.t0 });
            }
            if !any && next == f32::INFINITY {
                return None;
            }
            self.t = next;
            if any {
                return Some(self.sum_bounds(t, next));
            }
        }
    }

    /// The sums of the media at `t`, in the cell last returned.
    pub fn coefficients_at(&mut self, cell: &Cell, t: f32) -> Coefficients {
        let mut sum = cell.homogeneous;
        for track in self.tracks.as_mut_slice().iter_mut().filter(|track| track.is_active) {
            if let Some((walk, Some(step))) = &track.grid {
                track.density = walk.density(step, t);
                sum.add_scaled(&track.coefficients, track.density);
            }
        }
        sum
    }

    /// The phase function at the point last asked for, and the scattering coefficient that goes with it.
    ///
    /// That is the mixture and the sum of the scattering coefficients, if their ratio is the same in all channels or
    /// only one phase function is involved. Otherwise, or beyond [`MAX_LOBES`] functions, one medium is chosen in
    /// proportion to its scattering (averaged with `channels`), and its coefficient is divided by the probability.
    pub fn scatter(&mut self, channels: Vec3A, rng: &mut Pcg) -> (PhaseMix, Rgb) {
        let mut groups = ArrayVec::<(Phase, Rgb), MAX_LOBES>::new();
        let (mut total, mut fits) = (Rgb::ZERO, true);
        for (phase, sigma_s) in self.tracks.scattering() {
            total += sigma_s;
            match groups.iter_mut().find(|(known, _)| *known == phase) {
                Some((_, sum)) => *sum += sigma_s,
                None => fits &= groups.try_push((phase, sigma_s)).is_ok(),
            }
        }
        if let ([(phase, sigma_s)], true) = (&groups[..], fits) {
            return (PhaseMix::single(*phase), *sigma_s);
        }
        if fits && groups.iter().all(|(_, sigma_s)| is_parallel(*sigma_s, total)) {
            let weight = |sigma_s: Rgb| sigma_s.max_element() / total.max_element();
            if let Some(mix) = PhaseMix::new(groups.iter().map(|&(phase, sigma_s)| (weight(sigma_s), phase)))
            {
                return (mix, total);
            }
        }
        self.scatter_one(channels, total.dot(channels), rng)
    }

    fn scatter_one(&self, channels: Vec3A, total: f32, rng: &mut Pcg) -> (PhaseMix, Rgb) {
        let mut rest = rng.next_f32() * total;
        let mut chosen = (Phase::Isotropic, Rgb::ZERO);
        for (phase, sigma_s) in self.tracks.scattering() {
            let share = sigma_s.dot(channels);
            if share > 0.0 {
                chosen = (phase, sigma_s * (total / share));
                if rest < share {
                    break;
                }
                rest -= share;
            }
        }
        (PhaseMix::single(chosen.0), chosen.1)
    }

    fn sum_bounds(&self, t0: f32, t1: f32) -> Cell {
        let mut homogeneous = Coefficients::default();
        let (mut sigma_bar, mut n_grids, mut scatters) = (Rgb::ZERO, 0, false);
        let (mut emission_rate, mut emits) = (0f32, false);
        for track in self.tracks.as_slice().iter().filter(|track| track.is_active) {
            scatters |= track.coefficients.scatters();
            emits |= track.coefficients.emission != Rgb::ZERO;
            match &track.grid {
                Some((walk, Some(step))) => {
                    n_grids += 1;
                    sigma_bar += track.coefficients.sigma_t * step.max;
                    emission_rate = emission_rate.max(walk.emission_rate());
                }
                _ => homogeneous.add_scaled(&track.coefficients, 1.0),
            }
        }
        sigma_bar += homogeneous.sigma_t;
        let emission_rate = if emits { emission_rate } else { 0.0 };
        Cell { t0, t1, homogeneous, sigma_bar, n_grids, scatters, emission_rate }
    }
}

/// Equal up to a factor.
fn is_parallel(a: Rgb, b: Rgb) -> bool {
    (a * b.max_element()).abs_diff_eq(b * a.max_element(), 1e-6 * a.max_element() * b.max_element())
}

impl<'a> Track<'a> {
    fn new(present: &Present<'a>, ray: &Ray) -> Self {
        let coefficients = present.coefficients;
        let [t0, t1] = present.t;
        let grid = present.medium.density.as_ref().map(|density| {
            (GridWalk::new(density, ray, present.t, coefficients.sigma_t.max_element()), None)
        });
        // A grid begins with an empty step, which the first `advance` replaces.
        let t1 = if grid.is_some() { f32::NEG_INFINITY } else { t1 };
        let phase = present.medium.phase;
        Self { coefficients, phase, t0, t1, grid, is_active: false, density: 1.0 }
    }

    /// Moves on until the current piece ends behind `t`; at infinity when there is none.
    #[inline]
    fn advance(&mut self, t: f32) {
        while self.t1 <= t {
            let next = self.grid.as_mut().and_then(|(walk, step)| {
                *step = walk.next();
                *step
            });
            (self.t0, self.t1) = next.map_or((f32::INFINITY, f32::INFINITY), |step| (step.t0, step.t1));
            if next.is_none() {
                break;
            }
        }
    }
}

impl<'a> Tracks<'a> {
    fn push(&mut self, track: Track<'a>) {
        match self {
            Self::Inline(inline) if inline.is_full() => {
                let mut heap: Vec<_> = inline.drain(..).collect();
                heap.push(track);
                *self = Self::Heap(heap);
            }
            Self::Inline(inline) => inline.push(track),
            Self::Heap(heap) => heap.push(track),
        }
    }

    #[inline]
    fn as_slice(&self) -> &[Track<'a>] {
        match self {
            Self::Inline(tracks) => tracks,
            Self::Heap(tracks) => tracks,
        }
    }

    #[inline]
    fn as_mut_slice(&mut self) -> &mut [Track<'a>] {
        match self {
            Self::Inline(tracks) => tracks,
            Self::Heap(tracks) => tracks,
        }
    }

    /// Phase functions and scattering coefficients at the point last asked for.
    fn scattering(&self) -> impl Iterator<Item = (Phase, Rgb)> {
        let active = self.as_slice().iter().filter(|track| track.is_active);
        let scattering = active.map(|track| (track.phase, track.coefficients.sigma_s * track.density));
        scattering.filter(|(_, sigma_s)| *sigma_s != Rgb::ZERO)
    }
}

//! Overlapping spans cut into cells: intervals in which the same media are present and bounds are constant.

use super::Present;
use crate::majorant::{GridStep, GridWalk};
use crate::medium::{Coefficients, Emission, Medium, Span, usable};
use crate::phase::{Isotropic, MAX_LOBES, Phase, PhaseMix};
use arrayvec::ArrayVec;
use glam::Vec3A;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// Spans kept without allocation; more go to the heap.
const INLINE: usize = 8;

/// One medium along the ray.
struct Track<'a> {
    medium: &'a Medium,
    /// At density 1; with a tint, upper bounds.
    coefficients: Coefficients,
    /// `None` where emission is not asked for, or there is none.
    emission: Option<Emission>,
    /// The homogeneous span, or the current step of the grid.
    t0: f64,
    t1: f64,
    grid: Option<(GridWalk<'a>, Option<GridStep>)>,
    is_active: bool,
    /// Scattering at the point last asked for.
    sigma_s: Rgb,
}

#[allow(clippy::large_enum_variant, reason = "the large variant is the common one: no allocation")]
enum Tracks<'a> {
    Inline(ArrayVec<Track<'a>, INLINE>),
    Heap(Vec<Track<'a>>),
}

/// An interval of the segment in which the same media are present.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cell {
    /// Where it begins.
    pub t0: f64,
    /// Where it ends, greater than `t0`; may be infinite.
    pub t1: f64,
    /// Sum of the homogeneous media: exact.
    pub homogeneous: Coefficients,
    /// Upper bound of the sum of all media's extinction, per channel.
    pub sigma_bar: Rgb,
    /// Lower bound of the same.
    pub sigma_min: Rgb,
    /// Grids present.
    pub n_grids: u32,
    /// Something may scatter.
    pub scatters: bool,
    /// What homogeneous media emit per unit of `t`.
    pub(super) glow: Rgb,
    /// Something may emit.
    pub(super) emits: bool,
    /// Least rate, per unit of `t`, of points at which emission is read if something emits: some per voxel of the
    /// finest grid; 0 without grids.
    pub(super) emission_rate: f32,
}

impl Cell {
    /// How long it is.
    #[inline]
    pub fn length(&self) -> f64 {
        self.t1 - self.t0
    }
}

/// The media along a ray up to its end, visited front to back.
pub struct Segment<'a> {
    tracks: Tracks<'a>,
    ray: Ray,
    t: f64,
    is_homogeneous: bool,
}

impl<'a> Segment<'a> {
    /// The segment of `ray` through `spans`, which may overlap and come in any order. Media that only emit are left out:
    /// light does not collide with them.
    pub fn new(media: &'a [Medium], spans: &[Span], ray: &Ray) -> Self {
        Self::of(ray, spans.iter().filter_map(|span| Track::colliding(media, span, ray)))
    }

    /// The same from `t` on, without the spans that begin further on: for the media at that point.
    pub(crate) fn at(media: &'a [Medium], spans: &[Span], ray: &Ray, t: f64) -> Self {
        let here = spans.iter().filter(|span| span.t0 <= t && t < span.t1);
        Self::of(ray, here.filter_map(|span| Track::colliding(media, &Span { t0: t, ..*span }, ray)))
    }

    /// The same with the media that only emit.
    pub(super) fn with_emission(media: &'a [Medium], spans: &[Span], ray: &Ray) -> Self {
        Self::of(ray, spans.iter().filter_map(|span| Track::shining(media, span, ray)))
    }

    fn of(ray: &Ray, all: impl Iterator<Item = Track<'a>>) -> Self {
        let tracks = Tracks::Inline(ArrayVec::new());
        let mut segment = Self { tracks, ray: *ray, t: 0.0, is_homogeneous: true };
        for track in all {
            segment.is_homogeneous &= track.grid.is_none();
            segment.tracks.push(track);
        }
        segment
    }

    /// No grids: cells are exact, [`Cell::homogeneous`] is all there is.
    pub fn is_homogeneous(&self) -> bool {
        self.is_homogeneous
    }

    /// The next cell that contains anything.
    pub fn next_cell(&mut self) -> Option<Cell> {
        loop {
            let (t, mut next, mut any) = (self.t, f64::INFINITY, false);
            for track in self.tracks.as_mut_slice() {
                track.advance(t);
                track.is_active = track.t0 <= t && t < track.t1;
                any |= track.is_active;
                next = next.min(if track.is_active { track.t1 } else { track.t0 });
            }
            if !any && next == f64::INFINITY {
                return None;
            }
            self.t = next;
            if any {
                return Some(self.sum_bounds(t, next));
            }
        }
    }

    /// The sums of the media at `t`, in the cell last returned.
    pub fn coefficients_at(&mut self, cell: &Cell, t: f64) -> Coefficients {
        let mut sum = cell.homogeneous;
        for track in self.tracks.as_mut_slice().iter_mut().filter(|track| track.is_active) {
            if let Some((walk, Some(step))) = &track.grid {
                let density = walk.density(step, t as f32);
                let here = match &track.medium.tint {
                    None => track.coefficients,
                    Some(tint) => track.medium.tinted(tint, tint.color(self.ray.at(t as f32), density)),
                };
                track.sigma_s = here.sigma_s * density;
                sum.add_scaled(&here, density);
            }
        }
        sum
    }

    /// What all media emit at `t`, per unit of it, in the cell last returned.
    pub(super) fn emission_at(&self, cell: &Cell, t: f64) -> Rgb {
        let mut sum = cell.glow;
        for track in self.tracks.as_slice().iter().filter(|track| track.is_active) {
            if let Some((walk, Some(step))) = &track.grid
                && let Some(emission) = track.emission
            {
                let density = walk.density(step, t as f32);
                sum += emission.at(density);
                if let Some(tint) = &track.medium.tint {
                    sum += usable(tint.glow * tint.color(self.ray.at(t as f32), density) * density);
                }
            }
        }
        sum
    }

    /// The phase function at the point last asked for, and the scattering coefficient that goes with it.
    ///
    /// That is the mixture and the sum of the scattering coefficients, if their ratio is the same in all channels or
    /// all media have the same phase function. Otherwise, or beyond [`MAX_LOBES`] functions, one medium is chosen in
    /// proportion to its scattering (averaged with `channels`), and its coefficient is divided by the probability.
    pub fn scatter(&mut self, channels: Vec3A, rng: &mut Pcg) -> (PhaseMix, Rgb) {
        let mut groups = ArrayVec::<(&PhaseMix, Rgb), MAX_LOBES>::new();
        let (mut total, mut fits) = (Rgb::ZERO, true);
        for (phase, sigma_s) in self.tracks.scattering() {
            total += sigma_s;
            match groups.iter_mut().find(|(known, _)| *known == phase) {
                Some((_, sum)) => *sum += sigma_s,
                None => fits &= groups.try_push((phase, sigma_s)).is_ok(),
            }
        }
        if let ([(phase, sigma_s)], true) = (&groups[..], fits) {
            return (**phase, *sigma_s);
        }
        if fits && groups.iter().all(|(_, sigma_s)| is_parallel(*sigma_s, total)) {
            let weighted = groups.iter().flat_map(|(phase, sigma_s)| {
                let weight = sigma_s.max_element() / total.max_element();
                phase.lobes().iter().map(move |(part, lobe)| (weight * part, *lobe))
            });
            if let Some(mix) = PhaseMix::new(weighted) {
                return (mix, total);
            }
        }
        self.scatter_one(channels, total.dot(channels), rng)
    }

    fn scatter_one(&self, channels: Vec3A, total: f32, rng: &mut Pcg) -> (PhaseMix, Rgb) {
        let mut rest = rng.next_f32() * total;
        let mut chosen = (PhaseMix::single(Phase::Isotropic(Isotropic)), Rgb::ZERO);
        for (phase, sigma_s) in self.tracks.scattering() {
            let share = sigma_s.dot(channels);
            if share > 0.0 {
                chosen = (*phase, sigma_s * (total / share));
                if rest < share {
                    break;
                }
                rest -= share;
            }
        }
        chosen
    }

    fn sum_bounds(&self, t0: f64, t1: f64) -> Cell {
        let mut cell = Cell { t0, t1, ..Cell::default() };
        for track in self.tracks.as_slice().iter().filter(|track| track.is_active) {
            cell.scatters |= track.coefficients.scatters();
            cell.emits |= track.emission.is_some();
            match &track.grid {
                Some((walk, Some(step))) => {
                    cell.n_grids += 1;
                    cell.sigma_bar += track.coefficients.sigma_t * step.max;
                    let least = match &track.medium.tint {
                        None => track.coefficients.sigma_t,
                        Some(_) => track.medium.least_extinction(),
                    };
                    cell.sigma_min += least * step.min;
                    cell.emission_rate = cell.emission_rate.max(walk.emission_rate());
                }
                _ => {
                    cell.homogeneous.add_scaled(&track.coefficients, 1.0);
                    cell.glow += track.emission.map_or(Rgb::ZERO, |emission| emission.at(1.0));
                }
            }
        }
        cell.sigma_bar += cell.homogeneous.sigma_t;
        cell.sigma_min += cell.homogeneous.sigma_t;
        cell
    }
}

/// Equal up to a factor.
fn is_parallel(a: Rgb, b: Rgb) -> bool {
    (a * b.max_element()).abs_diff_eq(b * a.max_element(), 1e-6 * a.max_element() * b.max_element())
}

impl<'a> Track<'a> {
    /// The track of a span with extinction, without its emission.
    fn colliding(media: &'a [Medium], span: &Span, ray: &Ray) -> Option<Self> {
        let Present { medium, coefficients, t } = Present::new(media, span, ray)?;
        Some(Self::new(medium, coefficients, None, t, ray))
    }

    /// The track of a span with extinction or emission.
    fn shining(media: &'a [Medium], span: &Span, ray: &Ray) -> Option<Self> {
        let (t, medium) = (span.clipped(ray)?, media.get(span.medium as usize)?);
        let coefficients = medium.coefficients();
        let emission = medium.emits().then(|| medium.emission.usable());
        let is_seen = !coefficients.is_zero() || emission.is_some();
        is_seen.then(|| Self::new(medium, coefficients, emission, t, ray))
    }

    fn new(
        medium: &'a Medium,
        coefficients: Coefficients,
        emission: Option<Emission>,
        [t0, t1]: [f64; 2],
        ray: &Ray,
    ) -> Self {
        let grid = medium.density.as_ref().map(|density| {
            (GridWalk::new(density, ray, [t0 as f32, t1 as f32], coefficients.sigma_t.max_element()), None)
        });
        // A grid begins with an empty step, which the first `advance` replaces.
        let t1 = if grid.is_some() { f64::NEG_INFINITY } else { t1 };
        let sigma_s = coefficients.sigma_s;
        Self { medium, coefficients, emission, t0, t1, grid, is_active: false, sigma_s }
    }

    /// Moves on until the current piece ends behind `t`; at infinity when there is none.
    #[inline]
    fn advance(&mut self, t: f64) {
        while self.t1 <= t {
            let next = self.grid.as_mut().and_then(|(walk, step)| {
                *step = walk.next();
                *step
            });
            (self.t0, self.t1) =
                next.map_or((f64::INFINITY, f64::INFINITY), |step| (f64::from(step.t0), f64::from(step.t1)));
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
    fn scattering(&self) -> impl Iterator<Item = (&'a PhaseMix, Rgb)> {
        let active = self.as_slice().iter().filter(|track| track.is_active);
        let scattering = active.map(|track| (&track.medium.phase, track.sigma_s));
        scattering.filter(|(_, sigma_s)| *sigma_s != Rgb::ZERO)
    }
}

//! The questions a path asks of the world.
//!
//! Those of every segment are always inlined: both path loops, with media and without, then cost what each would cost
//! alone. Left to the compiler, the second one made the first 2.5 % dearer.

use super::World;
use super::bodies::Unseen;
use super::shade::ShadingBuffer;
use glam::Vec3A;
use tyndall_geometry::{Hit, SpanScratch};
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};
use tyndall_volume::{Span, WalkStats};

/// Surfaces block light only up to this fraction of the way, so that a mesh modelled exactly at the light's own surface
/// (the lamp's panel) does not hide it. Relative: no absolute epsilon.
const SHADOW_END: f32 = 1.0 - 1e-4;

/// Surfaces this many times further away than what rounding took from a ray's origin are where they seem to be.
const NEAR: f32 = 1e4;

/// Working memory of one worker.
#[derive(Default)]
pub(crate) struct WorldScratch {
    /// Spans of the segment that was asked about last.
    pub(crate) spans: Vec<Span>,
    crossings: SpanScratch,
}

/// A hit on a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceHit(pub(super) Hit);

impl SurfaceHit {
    /// Ray parameter.
    pub(crate) fn t(&self) -> f32 {
        self.0.t
    }
}

/// What ends a segment.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SegmentEnd {
    /// A surface.
    Surface(SurfaceHit),
    /// The body of a light.
    Light {
        /// Which.
        index: usize,
        /// Where.
        t: f32,
    },
    /// Nothing.
    Escaped,
}

impl SegmentEnd {
    /// Ray parameter, infinite if the ray escaped.
    pub(crate) fn t(&self) -> f32 {
        match self {
            Self::Surface(hit) => hit.t(),
            Self::Light { t, .. } => *t,
            Self::Escaped => f32::INFINITY,
        }
    }
}

impl World {
    /// The nearest surface or light body along the ray at `time` in [0, 1], 0 when the shutter opens and 1 when it closes,
    /// but for `unseen` bodies.
    #[inline(always)]
    pub(crate) fn trace(&self, ray: &Ray, time: f32, unseen: Unseen) -> SegmentEnd {
        let surface = self.surfaces.accel().intersect(ray, time);
        let within = surface.map_or(*ray, |hit| ray.up_to(hit.t));
        if let Some((index, t)) = self.bodies.nearest(&self.lights, &within, unseen) {
            return SegmentEnd::Light { index, t };
        }
        surface.map_or(SegmentEnd::Escaped, |hit| SegmentEnd::Surface(SurfaceHit(hit)))
    }

    /// Distance of a segment's end from `ray.origin + low`, which was traced without `low`. It matters where the end is
    /// hardly further away than the rounding of the origin.
    #[inline]
    pub(crate) fn distance(&self, end: &SegmentEnd, ray: &Ray, time: f32, low: Vec3A) -> f32 {
        let t = end.t();
        match end {
            SegmentEnd::Surface(hit) if t < NEAR * low.abs().max_element() => {
                self.near_distance(hit, ray, time, low)
            }
            _ => t,
        }
    }

    /// Distance of the plane of a surface.
    #[cold]
    fn near_distance(&self, hit: &SurfaceHit, ray: &Ray, time: f32, low: Vec3A) -> f32 {
        let normal = self.surfaces.accel().surface_point(ray, time, &hit.0).geometric_normal;
        let shift = low.dot(normal) / ray.direction.dot(normal);
        if shift.is_finite() { (hit.t() - shift).max(0.0) } else { hit.t() }
    }

    /// Fills `scratch.spans` with the parts of the ray inside media; `low` is what rounding took from its origin.
    #[inline(always)]
    pub(crate) fn find_spans(&self, ray: &Ray, low: Vec3A, scratch: &mut WorldScratch) {
        let WorldScratch { spans, crossings } = scratch;
        spans.clear();
        self.media
            .boundaries()
            .spans(ray, low, crossings, &mut |medium, t0, t1| spans.push(Span { t0, t1, medium }));
    }

    /// What of the light of light `index`, which is at the ray's end, reaches its origin: surfaces and other lights'
    /// opaque bodies block, media and transparent surfaces attenuate. Unbiased, and exact where all media are homogeneous.
    /// `low` is what rounding took from the ray's origin.
    #[inline(always)]
    #[allow(
        clippy::too_many_arguments,
        reason = "a ray has a time and a rest; the others are working memory"
    )]
    pub(crate) fn visibility<const MEDIA: bool>(
        &self,
        ray: &Ray,
        time: f32,
        low: Vec3A,
        index: usize,
        rng: &mut Pcg,
        scratch: &mut WorldScratch,
        walks: &mut WalkStats,
    ) -> Rgb {
        let short = ray.up_to(ray.t_max * SHADOW_END);
        if self.bodies.blocks(&self.lights, &short, index) {
            return Rgb::ZERO;
        }
        let past_surfaces = self.past_surfaces(&short, time);
        if !MEDIA || past_surfaces == Rgb::ZERO {
            return past_surfaces;
        }
        self.find_spans(ray, low, scratch);
        if scratch.spans.is_empty() {
            return past_surfaces;
        }
        past_surfaces * tyndall_volume::transmittance(self.media.list(), &scratch.spans, ray, rng, walks)
    }

    /// What surfaces let through along the ray.
    #[inline(always)]
    fn past_surfaces(&self, ray: &Ray, time: f32) -> Rgb {
        if self.surfaces.all_opaque() {
            return if self.surfaces.accel().occluded(ray, time) { Rgb::ZERO } else { Rgb::ONE };
        }
        let mut through = Rgb::ONE;
        let mut rest = *ray;
        while let Some(hit) = self.surfaces.accel().intersect(&rest, time) {
            let hit = SurfaceHit(hit);
            let mut buffer = ShadingBuffer::default();
            let surface = self.shade(&rest, time, &hit, &mut buffer);
            through *= surface.shading.bsdf.transparency();
            if through == Rgb::ZERO {
                return Rgb::ZERO;
            }
            let origin = surface.origin_behind(rest.direction);
            rest = Ray { origin, direction: rest.direction, t_max: rest.t_max - hit.t() };
        }
        through
    }
}

//! Light sampling before distance sampling: a light is chosen for a whole segment, then a distance by the angle that
//! it subtends at the light (Kulla & Fajardo 2012, "Importance Sampling Techniques for Path Tracing in Participating
//! Media", doi:10.1111/j.1467-8659.2012.03148.x).
//!
//! A light close to a ray through fog lights a short piece of it very brightly; distances drawn by transmittance rarely
//! fall there. Three techniques find the same light: this one, light sampling at a collision, and the phase function's
//! direction from a collision. They are combined by the balance heuristic, with [`collision_density`] in place of the
//! tracker's density of distances: the weights add up to one for every path, which is all that they must.

use super::guidance::Guidance;
use super::guided::GuidedVertex;
use super::vertex::Vertex;
use super::{Path, PathStatistics, Scratch};
use glam::{Vec2, Vec3A};
use tyndall_math::{Ray, Rgb};
use tyndall_shading::{LightSet, Receiver};
use tyndall_volume::{Span, collision_density, scattering_at, transmittance};

/// The part of a ray inside media.
#[derive(Debug, Clone, Copy)]
pub(super) struct LitSegment {
    origin: Vec3A,
    direction: Vec3A,
    t0: f32,
    t1: f32,
}

/// What the technique of this module would have done at a collision of the segment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rival {
    segment: LitSegment,
    /// Distance of the collision.
    t: f64,
    /// [`collision_density`] there.
    collision_density: f32,
}

/// Angles about a light, for distances along a segment.
struct Angles {
    /// Distance of the light's foot point on the ray.
    foot: f32,
    /// Distance of the light from the ray, at least the light's radius: inside the light nothing is singular.
    distance: f32,
    /// Signed angles of both ends.
    theta: [f32; 2],
}

impl LitSegment {
    /// The part of `ray` covered by `spans`; `None` if that is nothing.
    pub(super) fn new(ray: &Ray, spans: &[Span]) -> Option<Self> {
        let t0 = spans.iter().map(|s| s.t0).fold(f64::INFINITY, f64::min).max(0.0) as f32;
        let t1 = (spans.iter().map(|s| s.t1).fold(0.0, f64::max) as f32).min(ray.t_max);
        (t0 < t1).then_some(Self { origin: ray.origin, direction: ray.direction, t0, t1 })
    }

    fn receiver(&self) -> Receiver {
        Receiver::Segment { origin: self.origin, direction: self.direction, t0: self.t0, t1: self.t1 }
    }

    /// `None` for lights at infinity and where the angles vanish in rounding.
    fn angles(&self, lights: &LightSet, index: usize) -> Option<Angles> {
        let (center, radius) = lights.bounding_sphere(index)?;
        let to_light = center - self.origin;
        let foot = to_light.dot(self.direction);
        let off_axis = (to_light - self.direction * foot).length();
        // A light on the ray itself: as wide as the rounding of its position.
        let least = radius.max(1e-5 * to_light.length()).max(f32::MIN_POSITIVE);
        let distance = off_axis.max(least);
        let theta = [self.t0, self.t1].map(|t| ((t - foot) / distance).atan());
        (theta[1] - theta[0] > 1e-6).then_some(Angles { foot, distance, theta })
    }

    /// Density with which light `index` and the distance `t` are drawn.
    fn density(&self, lights: &LightSet, index: usize, t: f32) -> f32 {
        let Some(angles) = self.angles(lights, index) else { return 0.0 };
        lights.probability(&self.receiver(), index) * angles.density(t)
    }
}

impl Angles {
    fn sample(&self, u: f32) -> f32 {
        let theta = self.theta[0] + (self.theta[1] - self.theta[0]) * u;
        self.foot + self.distance * theta.tan()
    }

    /// Per unit of `t`.
    fn density(&self, t: f32) -> f32 {
        let x = (t - self.foot) / self.distance;
        ((self.theta[1] - self.theta[0]) * self.distance * (1.0 + x * x)).recip()
    }
}

impl Rival {
    pub(super) fn new(
        path: &Path<'_, impl Guidance>,
        segment: LitSegment,
        spans: &[Span],
        ray: &Ray,
        t: f64,
    ) -> Self {
        let collision_density =
            collision_density(path.world.media(), spans, ray, t, [segment.t0, segment.t1])
                .max(f32::MIN_POSITIVE);
        Self { segment, t, collision_density }
    }

    /// How densely this technique draws light `index` and the collision's distance, in units of the density of
    /// collisions there.
    pub(super) fn relative_density(&self, lights: &LightSet, index: usize) -> f32 {
        (self.segment.density(lights, index, self.t as f32) / self.collision_density).min(f32::MAX)
    }
}

impl<G: Guidance> Path<'_, G> {
    /// The segment, if its lights are to be sampled before the distance.
    #[inline]
    pub(super) fn lit_segment(&self, ray: &Ray, scratch: &Scratch) -> Option<LitSegment> {
        if !self.world.lights().has_local() || self.scatter_count == self.max_scatter {
            return None;
        }
        LitSegment::new(ray, &scratch.spans)
    }

    /// Adds single scattering of one light along the segment; `ray` reaches to its end and `scratch` has its spans.
    /// Leaves the spans as they were.
    pub(super) fn add_segment_light<const MEDIA: bool>(
        &mut self,
        segment: &LitSegment,
        ray: &Ray,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) {
        let [u_light, u_distance, u, v] = self.sampler.next_4d();
        let lights = self.world.lights();
        let Some((index, p_light)) = lights.sample_light(&segment.receiver(), u_light) else { return };
        let Some(angles) = segment.angles(lights, index) else { return };
        let t = angles.sample(u_distance);
        let density = p_light * angles.density(t);
        if !(segment.t0 <= t && t < segment.t1 && density > 0.0) {
            return;
        }
        let media = self.world.media();
        let channels = self.throughput.abs();
        let Some((phase, sigma_s)) =
            scattering_at(media, &scratch.spans, ray, f64::from(t), channels, &mut self.rng)
        else {
            return;
        };
        let point = self.point_in_medium(ray, f64::from(t));
        let position = point.high;
        let Some(sample) = lights.lights[index].sample(position, Vec2::new(u, v)) else { return };
        let vertex = GuidedVertex::new(self, Vertex::Medium { point, travel: ray.direction, phase });
        let (value, pdf_vertex) = vertex.evaluate(sample.direction);
        if value == Rgb::ZERO || sample.radiance == Rgb::ZERO || sample.pdf <= 0.0 {
            return;
        }
        let rival = Rival::new(self, *segment, &scratch.spans, ray, f64::from(t));
        let relative = (density / rival.collision_density).min(f32::MAX);
        let p_point = lights.probability(&Receiver::Point { position }, index);
        let by_phase = if sample.is_delta { 0.0 } else { pdf_vertex / sample.pdf };
        let weight = (1.0 + (p_point + by_phase) / relative).recip();
        let up_to = transmittance(media, &scratch.spans, &ray.up_to(t), &mut self.rng, &mut statistics.walks);
        let spans = std::mem::take(&mut scratch.spans);
        let visibility = self.visibility::<MEDIA>(&vertex.vertex, &sample, index, scratch, statistics);
        scratch.spans = spans;
        let through = up_to * visibility;
        if through != Rgb::ZERO {
            let scattered = self.throughput * through * sigma_s * value * sample.radiance;
            let light = scattered * (weight / density / sample.pdf);
            self.recorder.add_medium_light(light, self.scatter_count + 1);
        }
    }
}

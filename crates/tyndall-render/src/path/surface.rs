//! Events at surfaces and in media: record, direct light, next direction.

use super::guidance::Guidance;
use super::guided::{GuidedVertex, NextDirection};
use super::vertex::Vertex;
use super::{Origin, Path, PathStatistics, Scratch};
use crate::world::{ShadingBuffer, SurfaceHit};
use glam::Vec3A;
use tyndall_math::{Ray, Rgb, SplitPoint, mean_component};
use tyndall_shading::SurfaceShading;
use tyndall_volume::PhaseMix;

impl<G: Guidance> Path<'_, G> {
    /// A scattering event in a medium; returns whether the path goes on.
    #[inline(never)]
    pub(super) fn scatter_in_medium<const MEDIA: bool>(
        &mut self,
        t: f64,
        phase: PhaseMix,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> bool {
        statistics.volume_events += 1;
        self.recorder.scatter_in_medium(self.throughput, t as f32, || self.ray.at(t as f32));
        if !self.count_scatter() {
            return false;
        }
        let travel = self.ray.direction;
        let point = self.point_in_medium(&self.ray, t);
        self.scatter_at::<MEDIA>(Vertex::Medium { point, travel, phase }, scratch, statistics)
    }

    /// A surface is met; returns whether the path goes on.
    pub(super) fn scatter_at_surface<const MEDIA: bool>(
        &mut self,
        hit: &SurfaceHit,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> bool {
        self.recorder.meet_surface(hit.t());
        let mut buffer = ShadingBuffer::default();
        let surface = self.world.shade(&self.ray, self.time, hit, &mut buffer);
        let SurfaceShading { bsdf, emission, .. } = surface.shading;
        let transparency = bsdf.transparency();
        if transparency != Rgb::ZERO {
            let straight = mean_component(transparency).min(1.0);
            if self.rng.next_f32() < straight {
                // Straight on: not an event. The vertex before still owns the direction.
                self.throughput *= transparency / straight;
                let direction = self.ray.direction;
                let origin = surface.origin_behind(direction);
                self.ray = Ray { origin, direction, t_max: self.ray.t_max - hit.t() };
                self.low = surface.position - origin;
                return true;
            }
            self.throughput /= 1.0 - straight;
        }
        statistics.surface_events += 1;
        let wo = -self.ray.direction;
        self.recorder.scatter_at_surface(|| bsdf.albedo(&surface.frame, wo), &surface, self.throughput);
        if *emission != Rgb::ZERO {
            self.recorder.add(self.throughput * *emission, self.scatter_count);
        }
        if !self.count_scatter() {
            return false;
        }
        let vertex = Vertex::Surface {
            position: surface.position,
            error: surface.error,
            frame: surface.frame,
            wo,
            bsdf,
        };
        self.scatter_at::<MEDIA>(vertex, scratch, statistics)
    }

    /// Direct light and the next direction.
    #[inline(always)]
    fn scatter_at<const MEDIA: bool>(
        &mut self,
        vertex: Vertex<'_>,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> bool {
        let vertex = GuidedVertex::new(self, vertex);
        vertex.record(&mut self.recorder);
        if !self.guidance.take_is_lit() {
            let light = self.direct_light::<MEDIA>(&vertex, scratch, statistics);
            self.recorder.add(light, self.scatter_count);
        }
        self.guidance.count_event(vertex.is_guided());
        let mut u = self.sampler.next_4d();
        if vertex.is_guided() {
            statistics.guided_events += 1;
            u = u.map(|u| self.guidance.shift(u));
        }
        let Some(next) = vertex.sample(u) else { return false };
        self.throughput *= next.weight;
        self.leave(&vertex.vertex, &next);
        true
    }

    /// The point at `t` on `ray`, which begins where the path is.
    #[inline]
    pub(super) fn point_in_medium(&self, ray: &Ray, t: f64) -> SplitPoint {
        if self.world.has_dense_media() {
            SplitPoint::on(ray, self.low, t)
        } else {
            SplitPoint { high: ray.at(t as f32), low: Vec3A::ZERO }
        }
    }

    /// Counts a scattering event unless the path has had all it may.
    #[inline]
    fn count_scatter(&mut self) -> bool {
        if self.scatter_count == self.max_scatter {
            return false;
        }
        self.scatter_count += 1;
        true
    }

    #[inline(always)]
    fn leave(&mut self, vertex: &Vertex<'_>, next: &NextDirection) {
        self.origin = Origin {
            position: vertex.position(),
            pdf: next.pdf,
            is_delta: next.is_delta,
            rival: self.rival.take(),
            vertex: Some(vertex.class()),
        };
        self.passed_light = None;
        let origin = vertex.origin_towards(next.direction);
        self.ray = Ray::new(origin.high, next.direction);
        self.low = origin.low;
    }
}

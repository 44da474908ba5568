//! Direct light: light sampling at events, and emitters met by chance, combined by the balance heuristic
//! (Veach & Guibas 1995) over directional densities.

use super::guidance::Guidance;
use super::guided::GuidedVertex;
use super::vertex::Vertex;
use super::{Path, PathStatistics, Scratch};
use glam::Vec2;
use tyndall_math::{Ray, Rgb, SplitPoint};
use tyndall_shading::{LightSample, Receiver};

impl<G: Guidance> Path<'_, G> {
    /// Light from one sampled light, by way of `vertex`. Overwrites the spans in `scratch`.
    #[inline(always)]
    pub(super) fn direct_light<const MEDIA: bool>(
        &mut self,
        vertex: &GuidedVertex<'_, G::Directions>,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> Rgb {
        let lights = self.world.lights();
        if lights.lights.is_empty() || vertex.vertex.is_delta_only() {
            return Rgb::ZERO;
        }
        let [u_light, u, v, _] = self.sampler.next_4d();
        let position = vertex.vertex.position();
        let receiver = Receiver::Point { position };
        let Some((index, p_light)) = lights.sample_light(&receiver, u_light) else { return Rgb::ZERO };
        let Some(light) = lights.lights[index].sample(position, Vec2::new(u, v)) else {
            return Rgb::ZERO;
        };
        let (value, pdf_vertex) = vertex.evaluate(light.direction);
        let pdf_light = p_light * light.pdf;
        if value == Rgb::ZERO || light.radiance == Rgb::ZERO || pdf_light <= 0.0 {
            return Rgb::ZERO;
        }
        // All densities relative to that of arriving at the vertex by a collision.
        let rival = self.rival.map_or(0.0, |rival| rival.relative_density(lights, index)) * light.pdf;
        let by_vertex = if light.is_delta { 0.0 } else { pdf_vertex };
        let weight = pdf_light / (pdf_light + rival + by_vertex);
        let contribution = self.throughput * value * light.radiance * (weight / pdf_light);
        let visibility = self.visibility::<MEDIA>(&vertex.vertex, &light, index, scratch, statistics);
        if visibility == Rgb::ZERO { Rgb::ZERO } else { contribution * visibility }
    }

    /// What of a light sampled at a vertex arrives there. Overwrites the spans in `scratch`.
    #[inline(always)]
    pub(super) fn visibility<const MEDIA: bool>(
        &mut self,
        vertex: &Vertex<'_>,
        light: &LightSample,
        index: usize,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> Rgb {
        let (shadow_ray, low) = vertex.shadow_ray(light);
        statistics.shadow_rays += 1;
        let Self { world, time, rng, .. } = self;
        world.visibility::<MEDIA>(&shadow_ray, *time, low, index, rng, scratch, &mut statistics.walks)
    }

    /// Adds the light whose body the ray met; returns whether the path goes on behind it.
    pub(super) fn add_light(&mut self, index: usize, t: f32) -> bool {
        let light = &self.world.lights().lights[index];
        let radiance = light.radiance(self.ray.origin, self.ray.direction);
        if radiance != Rgb::ZERO {
            let weight = self.weight_of_emitter(index);
            self.recorder.add(self.throughput * radiance * weight, self.scatter_count);
        }
        if light.is_opaque() {
            self.recorder.meet_light(t);
            return false;
        }
        // As at a transparent surface: no event.
        self.recorder.pass_light(t);
        let behind = SplitPoint::on(&self.ray, self.low, f64::from(t));
        self.ray = Ray { origin: behind.high, direction: self.ray.direction, t_max: self.ray.t_max - t };
        self.low = behind.low;
        self.passed_light = Some(index);
        true
    }

    /// Adds the lights at infinity that the ray escapes to.
    #[inline(always)]
    pub(super) fn add_background(&mut self) {
        self.recorder.escape(self.throughput);
        let lights = self.world.lights();
        for &index in self.world.infinite_lights() {
            let light = &lights.lights[index];
            if self.scatter_count == 0 && !light.is_camera_visible() {
                continue;
            }
            let radiance = light.radiance(self.ray.origin, self.ray.direction);
            if radiance != Rgb::ZERO {
                let weight = self.weight_of_emitter(index);
                self.recorder.add(self.throughput * radiance * weight, self.scatter_count);
            }
        }
    }

    /// Balance-heuristic weight of having met a light by directional sampling.
    #[inline]
    fn weight_of_emitter(&self, index: usize) -> f32 {
        if self.origin.is_delta {
            return 1.0;
        }
        let lights = self.world.lights();
        let from = self.origin.position;
        let p_light = lights.probability(&Receiver::Point { position: from }, index);
        let rival = self.origin.rival.map_or(0.0, |rival| rival.relative_density(lights, index));
        let pdf_light = (p_light + rival) * lights.lights[index].pdf(from, self.ray.direction);
        self.origin.pdf / (self.origin.pdf + pdf_light)
    }
}

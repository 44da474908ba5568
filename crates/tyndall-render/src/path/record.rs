//! Collects what a path contributes to the AOVs.

use crate::aov::SampleRecord;
use crate::camera::CameraRay;
use crate::world::Surface;
use glam::{DVec3, Vec3A};
use tyndall_math::{Rgb, mean_component};

/// What the first scattering event was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum First {
    None,
    Medium,
    Surface,
}

/// The record of a path in the making.
pub(super) struct Recorder {
    record: SampleRecord,
    first: First,
    /// No surface, not even a transparent one, has been passed yet.
    is_first_segment: bool,
    /// Transmittance up to the last light that was passed before.
    to_last_light: Rgb,
    near_depth: f32,
    axial_speed: f32,
    /// Distance of the current ray's origin from the near plane along the camera ray.
    travelled: f32,
}

impl Recorder {
    pub(super) fn new(camera_ray: &CameraRay) -> Self {
        Self {
            record: SampleRecord { alpha: 1.0, ..Default::default() },
            first: First::None,
            is_first_segment: true,
            to_last_light: Rgb::ONE,
            near_depth: camera_ray.near_depth,
            axial_speed: camera_ray.axial_speed,
            travelled: 0.0,
        }
    }

    /// What has been gathered so far, without the camera's exposure.
    #[inline]
    pub(super) fn radiance(&self) -> Rgb {
        self.record.radiance
    }

    /// Adds radiance arriving at the camera (throughput included) that scattered so many times.
    #[inline]
    pub(super) fn add(&mut self, radiance: Rgb, scatters: u32) {
        self.add_by_order(radiance, scatters);
        if self.first == First::Medium {
            self.record.volume_radiance += radiance;
        }
    }

    /// Adds light from a medium along a segment, emitted or scattered, that scattered so many times in all; before the
    /// first event it belongs to the volume.
    #[inline]
    pub(super) fn add_medium_light(&mut self, radiance: Rgb, scatters: u32) {
        self.add_by_order(radiance, scatters);
        if self.first != First::Surface {
            self.record.volume_radiance += radiance;
        }
    }

    #[inline]
    fn add_by_order(&mut self, radiance: Rgb, scatters: u32) {
        self.record.radiance += radiance;
        match scatters {
            0 => self.record.unscattered += radiance,
            1 => self.record.direct += radiance,
            _ => {}
        }
    }

    /// The camera's segment reached its end with this weight.
    #[inline]
    pub(super) fn pass_first_segment(&mut self, weight: Rgb) {
        if self.is_first_segment && self.first == First::None {
            self.record.transmittance = self.to_last_light * weight;
        }
    }

    /// A scattering event in a medium with this albedo, `t` along the current ray, at `position`.
    #[inline]
    pub(super) fn scatter_in_medium(&mut self, albedo: Rgb, t: f32, position: impl FnOnce() -> Vec3A) {
        if self.first == First::None {
            self.first = First::Medium;
            self.record.position = position();
            self.record.albedo = albedo;
            self.record.volume_depth = self.near_depth + (self.travelled + t) * self.axial_speed;
        }
    }

    /// A vertex is guided by so many training samples and lobes.
    #[inline]
    pub(super) fn guide(&mut self, n_samples: f32, n_lobes: usize) {
        if self.record.guide[0] == 0.0 {
            self.record.guide = [1.0, n_samples, n_lobes as f32];
        }
    }

    /// How the camera's segment chose between scattering and passing.
    #[inline]
    pub(super) fn choose(&mut self, probability: f32, scatters: bool) {
        if self.is_first_segment && self.first == First::None {
            self.record.scatter_probability = probability;
            self.record.scatters = f32::from(u8::from(scatters));
        }
    }

    /// A surface was met `t` along the current ray.
    #[inline]
    pub(super) fn meet_surface(&mut self, t: f32) {
        if self.first == First::None {
            self.travelled += t;
            self.is_first_segment = false;
        }
    }

    /// A scattering event at the surface that was met.
    #[inline]
    pub(super) fn scatter_at_surface(
        &mut self,
        albedo: impl FnOnce() -> Rgb,
        surface: &Surface,
        throughput: Rgb,
    ) {
        if self.first == First::None {
            self.first = First::Surface;
            self.record.position = surface.position;
            self.record.albedo = albedo();
            self.record.normal = surface.frame.frame.normal;
            self.record.mattes = surface.mattes;
            self.record.coverage = mean_component(throughput);
            self.record.depth = self.near_depth + self.travelled * self.axial_speed;
        }
    }

    /// A light that is not opaque was passed `t` along the current ray.
    #[inline]
    pub(super) fn pass_light(&mut self, t: f32) {
        if self.first == First::None {
            self.travelled += t;
            self.to_last_light = self.record.transmittance;
        }
    }

    /// A light's body was seen directly at distance `t`.
    #[inline]
    pub(super) fn meet_light(&mut self, t: f32) {
        if self.first == First::None {
            self.record.depth = self.near_depth + (self.travelled + t) * self.axial_speed;
        }
    }

    /// The path left the scene with this throughput: the background shows through.
    #[inline]
    pub(super) fn escape(&mut self, throughput: Rgb) {
        if self.first == First::None {
            self.record.alpha = 1.0 - mean_component(throughput);
        }
    }

    /// The record of a camera with this exposure, in a world with this origin.
    pub(super) fn finish(mut self, exposure_scale: f32, origin: DVec3) -> SampleRecord {
        self.record.position = (self.record.position.as_dvec3() + origin).as_vec3a();
        self.record.unscattered *= exposure_scale;
        self.record.direct *= exposure_scale;
        self.record.radiance *= exposure_scale;
        self.record.volume_radiance *= exposure_scale;
        self.record
    }
}

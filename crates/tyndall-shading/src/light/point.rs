//! A point that shines into all directions.
//!
//! It stands for a sphere of radiance L and area A too small to see: the mean projected area of a convex body is A / 4
//! (Cauchy), so its intensity is L A / 4. A normalized sphere has L = intensity / A, hence I = intensity / 4.

use super::bounds::{LightBounds, Outreach};
use super::build::LightBuilder;
use super::emission::Emission;
use super::sphere::ellipsoid_area;
use super::{Emitter, LightSample};
use crate::kind::KindSpec;
use glam::{Vec2, Vec3A};
use tyndall_math::Rgb;

#[derive(Debug, Clone)]
pub(super) struct Point {
    position: Vec3A,
    /// In place of radiance: watts per steradian.
    intensity: Emission,
    /// Mean of the shaping inside its cone.
    mean_factor: f64,
}

impl Point {
    pub(super) fn build(builder: &mut LightBuilder, radius: f64) -> Option<Self> {
        let area = if builder.prim.normalize { 1.0 } else { ellipsoid_area(builder.linear * radius) };
        if area <= 0.0 || area.is_nan() {
            return builder.reject(
                "a point light without radius has no area to emit from",
                "the light was removed; set normalize or a radius",
            );
        }
        let intensity = builder.radiance(4.0 / area)?;
        let intensity = builder.shaped(intensity);
        Some(Self { position: builder.center.as_vec3a(), mean_factor: intensity.mean_factor(), intensity })
    }
}

impl Emitter for Point {
    const KIND: KindSpec = KindSpec {
        name: "point",
        doc: "A sphere light treated as a point: no area, seen only by sampling it.",
        params: &[],
    };

    fn sample(&self, from: Vec3A, _: Vec2) -> Option<LightSample> {
        let offset = self.position - from;
        let distance = offset.length();
        if !(distance > 0.0 && distance.is_finite()) {
            return None;
        }
        let direction = offset / distance;
        // Divided twice: the square of the distance may leave f32.
        let radiance = self.intensity.towards(-direction) / distance / distance;
        Some(LightSample {
            direction,
            distance,
            radiance: radiance.min(Rgb::splat(f32::MAX)),
            pdf: 1.0,
            is_delta: true,
        })
    }

    fn pdf(&self, _: Vec3A, _: Vec3A) -> f32 {
        0.0
    }

    fn radiance(&self, _: Vec3A, _: Vec3A) -> Rgb {
        Rgb::ZERO
    }

    fn outreach(&self) -> Outreach {
        let mean = f64::from(self.intensity.radiance.max_element()) * self.mean_factor;
        Outreach::Local(LightBounds::new((self.position, self.position), self.intensity.cone(), mean))
    }

    fn is_delta(&self) -> bool {
        true
    }
}

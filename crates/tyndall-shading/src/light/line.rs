//! A straight line that shines: a cylinder too thin to see.
//!
//! A tube of radiance L and radius r sends the intensity 2 r L sin(theta) per length at angle theta to its axis. Points
//! are drawn uniformly in the angle they subtend at the receiver (Kulla & Fajardo 2012, equi-angular sampling,
//! doi:10.1111/j.1467-8659.2012.03148.x), so the estimate has no peak near the line.

use super::bounds::{LightBounds, Outreach};
use super::build::LightBuilder;
use super::emission::Emission;
use super::{Emitter, LightSample};
use crate::kind::KindSpec;
use glam::{Vec2, Vec3A};
use std::f64::consts::PI;
use tyndall_math::Rgb;

#[derive(Debug, Clone)]
pub(super) struct Line {
    center: Vec3A,
    axis: Vec3A,
    half_length: f32,
    /// In place of radiance: 2 r L.
    strength: Emission,
    /// Largest channel of the mean intensity inside the shaping's cone.
    intensity: f64,
}

impl Line {
    pub(super) fn build(builder: &mut LightBuilder, length: f64, radius: f64) -> Option<Self> {
        let linear = builder.linear;
        let half = linear.x_axis * (0.5 * length);
        let length = 2.0 * half.length();
        let cross = linear.y_axis.cross(linear.z_axis).length();
        let world_radius = radius * cross.sqrt();
        // Normalized: L = intensity / (2 pi r length), so 2 r L = intensity / (pi length).
        let size = if builder.prim.normalize { PI * length } else { 1.0 / (2.0 * world_radius) };
        if !(length > 0.0 && size.is_finite()) {
            return builder.reject(
                format!("a line light of length {length} and radius {world_radius} has no area to emit from"),
                "the light was removed; set normalize, or a length and radius",
            );
        }
        let strength = builder.radiance(size)?;
        let strength = builder.shaped(strength);
        let power = f64::from(strength.radiance.max_element()) * length * strength.mean_factor();
        Some(Self {
            center: builder.center.as_vec3a(),
            axis: half.normalize().as_vec3a(),
            half_length: half.length() as f32,
            // The mean of sin(theta) over the sphere is pi / 4.
            intensity: power * PI / 4.0,
            strength,
        })
    }
}

impl Emitter for Line {
    const KIND: KindSpec = KindSpec {
        name: "line",
        doc: "A cylinder light treated as a line: no area, seen only by sampling it.",
        params: &[],
    };

    fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample> {
        let along = (from - self.center).dot(self.axis);
        let foot = self.center + self.axis * along;
        let apart = (from - foot).length();
        let angle = |end: f32| (end - along).atan2(apart);
        let (a, b) = (angle(-self.half_length), angle(self.half_length));
        let theta = a + (b - a) * u.x;
        let offset = (foot - from) + self.axis * (apart * theta.tan());
        let distance = offset.length();
        if !(distance > 0.0 && distance.is_finite() && apart > 0.0) {
            return None;
        }
        let direction = offset / distance;
        // 2 r L sin(theta) / d^2 over the density apart / ((b - a) d^2), with sin(theta) = apart / d.
        let radiance = self.strength.towards(-direction) * ((b - a) / distance);
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
        let half = self.axis.abs() * self.half_length;
        let corners = (self.center - half, self.center + half);
        Outreach::Local(LightBounds::new(corners, self.strength.cone(), self.intensity))
    }

    fn is_delta(&self) -> bool {
        true
    }
}

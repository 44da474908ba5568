//! A disk (an ellipse under non-uniform scale) that emits from one side; points are drawn uniformly by area.

use super::bounds::{LightBounds, Outreach};
use super::build::LightBuilder;
use super::emission::Emission;
use super::plane::Plane;
use super::{Emitter, LightSample};
use crate::kind::{KindSpec, POSITIVE, ParamSpec};
use glam::{Vec2, Vec3A};
use std::f64::consts::PI;
use tyndall_math::sampling::concentric_disk;
use tyndall_math::{Ray, Rgb};

#[derive(Debug, Clone)]
pub(super) struct Disk {
    plane: Plane,
    pdf_area: f32,
    emission: Emission,
    /// Largest channel of the mean intensity along the normal, inside the shaping's cone.
    intensity: f64,
}

impl Disk {
    pub(super) fn build(builder: &mut LightBuilder, radius: f64) -> Option<Self> {
        let found = Plane::build(builder, radius, radius);
        let area = PI * found.as_ref().map_or(0.0, |(_, area)| *area);
        let emission = builder.area_emission(area)?;
        let radiance = f64::from(emission.radiance.max_element());
        Some(Self {
            plane: found?.0,
            pdf_area: (1.0 / area) as f32,
            intensity: radiance * area * emission.mean_factor(),
            emission,
        })
    }

    fn corners(&self) -> (Vec3A, Vec3A) {
        let (x, y) = (self.plane.axis_x, self.plane.axis_y);
        let squared = x * x + y * y;
        self.plane.bounds(Vec3A::new(squared.x.sqrt(), squared.y.sqrt(), squared.z.sqrt()))
    }

    #[inline]
    fn contains(xy: Vec2) -> bool {
        xy.length_squared() <= 1.0
    }
}

impl Emitter for Disk {
    const KIND: KindSpec = KindSpec {
        name: "disk",
        doc: "A disk in the xy plane that emits along -z.",
        params: &[ParamSpec::float("radius", 0.5, POSITIVE, "stage units", "Radius.")],
    };

    fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample> {
        if !self.plane.is_seen_from(from) {
            return None;
        }
        let offset = self.plane.at(concentric_disk(u)) - from;
        let distance = offset.length();
        let direction = offset / distance;
        let pdf = self.plane.solid_angle_pdf(self.pdf_area, distance, direction);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            distance,
            radiance: self.emission.towards(-direction),
            pdf,
            is_delta: false,
        })
    }

    fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32 {
        let hit = self.plane.hit(from, direction);
        if hit.t > 0.0 && Self::contains(hit.xy) && self.plane.is_seen_from(from) {
            self.plane.solid_angle_pdf(self.pdf_area, hit.t, direction)
        } else {
            0.0
        }
    }

    fn radiance(&self, from: Vec3A, direction: Vec3A) -> Rgb {
        if self.plane.is_seen_from(from) { self.emission.towards(-direction) } else { Rgb::ZERO }
    }

    fn intersect(&self, ray: &Ray) -> Option<f32> {
        self.plane.intersect(ray, Self::contains)
    }

    fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        Some(self.corners())
    }

    fn outreach(&self) -> Outreach {
        let cone = self.emission.cone_of_card(self.plane.normal);
        Outreach::Local(LightBounds::new(self.corners(), cone, self.intensity))
    }
}

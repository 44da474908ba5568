//! A tube along x, without caps, that emits outwards; elliptical under non-uniform scale.
//!
//! Points are drawn uniformly along the axis and uniformly in the angle under which the receiver sees the tube across
//! its axis, in the space in which the tube has unit radius. Only the visible side is drawn, and the density has no
//! peak at the silhouette: with psi the largest such angle, r the distance across the axis (in that space), d the
//! distance and |M| the determinant of the map to world space, it is d^3 / (4 psi |M| r^2) per steradian.

use super::bounds::{LightBounds, Outreach};
use super::build::LightBuilder;
use super::emission::Emission;
use super::sphere::inverse;
use super::{Emitter, LightSample};
use crate::kind::{KindSpec, POSITIVE, ParamSpec};
use glam::{DMat3, Mat3A, Vec2, Vec3A};
use std::f64::consts::TAU;
use tyndall_math::{Ray, Rgb};

#[derive(Debug, Clone)]
pub(super) struct Cylinder {
    center: Vec3A,
    /// Columns: half the axis, and the two radii.
    world_from_unit: Mat3A,
    unit_from_world: Mat3A,
    /// Cube root of the determinant.
    scale: f32,
    emission: Emission,
    /// Largest channel of the mean intensity inside the shaping's cone.
    intensity: f64,
}

/// The tube across its axis, seen from a point outside.
struct View {
    /// From the axis to the point, in units of the radius: > 1.
    rho: f32,
    /// Unit vector across the axis, from the point towards it.
    inward: Vec2,
    /// Half of the angle that the tube fills.
    half_angle: f32,
}

impl Cylinder {
    pub(super) fn build(builder: &mut LightBuilder, length: f64, radius: f64) -> Option<Self> {
        let linear = builder.linear;
        let m =
            DMat3::from_cols(linear.x_axis * (0.5 * length), linear.y_axis * radius, linear.z_axis * radius);
        let area = tube_area(m);
        let emission = builder.area_emission(area)?;
        if m.determinant() == 0.0 {
            return builder
                .reject("the transform flattens the cylinder", "the light was removed; use a RectLight");
        }
        Some(Self {
            center: builder.center.as_vec3a(),
            world_from_unit: Mat3A::from_cols(m.x_axis.as_vec3a(), m.y_axis.as_vec3a(), m.z_axis.as_vec3a()),
            unit_from_world: inverse(m),
            intensity: f64::from(emission.radiance.max_element()) * area * 0.25 * emission.mean_factor(),
            scale: m.determinant().abs().cbrt() as f32,
            emission,
        })
    }

    fn corners(&self) -> (Vec3A, Vec3A) {
        let m = &self.world_from_unit;
        let around = m.y_axis * m.y_axis + m.z_axis * m.z_axis;
        let half = m.x_axis.abs() + Vec3A::new(around.x.sqrt(), around.y.sqrt(), around.z.sqrt());
        (self.center - half, self.center + half)
    }

    #[inline]
    fn unit_position(&self, from: Vec3A) -> Vec3A {
        self.unit_from_world * (from - self.center)
    }

    #[inline]
    fn view(p: Vec3A) -> Option<View> {
        let across = Vec2::new(p.y, p.z);
        let rho = across.length();
        let is_outside = rho > 1.0 && rho.is_finite();
        is_outside.then(|| {
            let tangent = ((rho - 1.0) * (rho + 1.0)).sqrt();
            View { rho, inward: -across / rho, half_angle: 1f32.atan2(tangent) }
        })
    }

    /// Density per steradian of a point at `distance` in the world and `r` across the axis in unit space.
    #[inline]
    fn density(&self, view: &View, distance: f32, r: f32) -> f32 {
        (distance / self.scale).powi(3) / (4.0 * view.half_angle * r * r)
    }

    /// Parameters of both hits of the line with the infinite tube, nearest first.
    #[inline]
    fn roots(o: Vec3A, d: Vec3A) -> Option<[f32; 2]> {
        let (o2, d2) = (Vec2::new(o.y, o.z), Vec2::new(d.y, d.z));
        let a = d2.length_squared();
        let middle = -o2.dot(d2) / a;
        let half_chord2 = (1.0 - (o2 + d2 * middle).length_squared()) / a;
        (half_chord2 >= 0.0).then(|| [middle - half_chord2.sqrt(), middle + half_chord2.sqrt()])
    }
}

/// World-space area of the tube whose half axis and radii are the columns of `m`; the trapezoid rule converges
/// exponentially on the periodic integrand.
fn tube_area(m: DMat3) -> f64 {
    let n = 1024;
    let sum: f64 = (0..n)
        .map(|i| {
            let (s, c) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
            m.x_axis.cross(m.z_axis * c - m.y_axis * s).length()
        })
        .sum();
    2.0 * TAU * sum / f64::from(n)
}

impl Emitter for Cylinder {
    const KIND: KindSpec = KindSpec {
        name: "cylinder",
        doc: "A tube along x without caps that emits outwards.",
        params: &[
            ParamSpec::float("length", 1.0, POSITIVE, "stage units", "Extent along x."),
            ParamSpec::float("radius", 0.5, POSITIVE, "stage units", "Radius."),
        ],
    };

    fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample> {
        let p = self.unit_position(from);
        let view = Self::view(p)?;
        let psi = (2.0 * u.y - 1.0) * view.half_angle;
        let (sin, cos) = psi.sin_cos();
        let across = (view.rho * sin).powi(2);
        let r = view.rho * cos - (1.0 - across).max(0.0).sqrt();
        let step = Vec2::new(cos, sin).rotate(view.inward) * r;
        let offset = self.world_from_unit * Vec3A::new(2.0 * u.x - 1.0 - p.x, step.x, step.y);
        let distance = offset.length();
        let direction = offset / distance;
        let pdf = self.density(&view, distance, r);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            distance,
            radiance: self.emission.towards(-direction),
            pdf,
            is_delta: false,
        })
    }

    fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32 {
        let o = self.unit_position(from);
        let Some(view) = Self::view(o) else { return 0.0 };
        let d = self.unit_from_world * direction;
        let Some([t, _]) = Self::roots(o, d) else { return 0.0 };
        if !(t > 0.0 && (o.x + d.x * t).abs() <= 1.0) {
            return 0.0;
        }
        let pdf = self.density(&view, t, t * d.y.hypot(d.z));
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    fn radiance(&self, from: Vec3A, direction: Vec3A) -> Rgb {
        let o = self.unit_position(from);
        let d = self.unit_from_world * direction;
        // A ray that enters through an open end meets the inside, which is black.
        let hits_outside = o.y.hypot(o.z) > 1.0
            && Self::roots(o, d).is_none_or(|[t, _]| (o.x + d.x * t).abs() <= 1.0 + 1e-4);
        if hits_outside { self.emission.towards(-direction) } else { Rgb::ZERO }
    }

    fn intersect(&self, ray: &Ray) -> Option<f32> {
        let o = self.unit_position(ray.origin);
        let d = self.unit_from_world * ray.direction;
        Self::roots(o, d)?
            .into_iter()
            .find(|&t| (0.0..=ray.t_max).contains(&t) && (o.x + d.x * t).abs() <= 1.0)
    }

    fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        Some(self.corners())
    }

    fn outreach(&self) -> Outreach {
        Outreach::Local(LightBounds::new(self.corners(), self.emission.cone(), self.intensity))
    }
}

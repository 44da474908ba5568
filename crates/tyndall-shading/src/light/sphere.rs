//! A sphere that emits outwards; an ellipsoid under non-uniform scale.
//!
//! Directions are drawn uniformly from the cone that the sphere fills (Shirley, Wang, Zimmerman 1996,
//! doi:10.1145/226150.226151), in the space in which the ellipsoid is a unit sphere; a linear map of determinant 1 that
//! stretches a unit vector by k changes solid angles by k^-3.

use super::bounds::{LightBounds, Outreach};
use super::build::LightBuilder;
use super::emission::Emission;
use super::{Emitter, LightSample};
use crate::kind::{KindSpec, POSITIVE, ParamSpec};
use glam::{DMat3, DVec3, Mat3A, Vec2, Vec3A};
use std::f64::consts::{PI, TAU};
use tyndall_math::sampling::{uniform_cone, uniform_cone_pdf};
use tyndall_math::{Frame, Ray, Rgb};

#[derive(Debug, Clone)]
pub(super) struct Sphere {
    center: Vec3A,
    /// World distances are unit-sphere distances times this and the stretch of `world_from_unit`.
    scale: f32,
    /// Of determinant +-1.
    world_from_unit: Mat3A,
    unit_from_world: Mat3A,
    emission: Emission,
    /// Largest channel of radiance times area / 4 times mean shaping: the mean intensity inside the shaping's cone.
    intensity: f64,
}

impl Sphere {
    pub(super) fn build(builder: &mut LightBuilder, radius: f64) -> Option<Self> {
        let world_from_unit = builder.linear * radius;
        let emission = builder.area_emission(ellipsoid_area(world_from_unit))?;
        let scale = world_from_unit.determinant().abs().cbrt();
        if scale <= 0.0 || scale.is_nan() {
            return builder
                .reject("the transform flattens the sphere", "the light was removed; use a DiskLight");
        }
        let unimodular = world_from_unit * (1.0 / scale);
        let area = ellipsoid_area(world_from_unit);
        Some(Self {
            center: builder.center.as_vec3a(),
            scale: scale as f32,
            world_from_unit: Mat3A::from_cols(
                unimodular.x_axis.as_vec3a(),
                unimodular.y_axis.as_vec3a(),
                unimodular.z_axis.as_vec3a(),
            ),
            unit_from_world: inverse(unimodular),
            intensity: f64::from(emission.radiance.max_element()) * area * 0.25 * emission.mean_factor(),
            emission,
        })
    }

    fn corners(&self) -> (Vec3A, Vec3A) {
        let rows = self.world_from_unit.transpose();
        let half = Vec3A::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length()) * self.scale;
        (self.center - half, self.center + half)
    }

    /// `from` in the space in which the light is the unit sphere around the origin.
    #[inline]
    fn unit_position(&self, from: Vec3A) -> Vec3A {
        self.unit_from_world * ((from - self.center) / self.scale)
    }
}

/// 1 - cos of the half angle of the cone that the unit sphere fills at squared distance `d2` > 1.
#[inline]
fn cone(d2: f32) -> f32 {
    let sin2 = 1.0 / d2;
    sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
}

impl Emitter for Sphere {
    const KIND: KindSpec = KindSpec {
        name: "sphere",
        doc: "A sphere that emits outwards.",
        params: &[ParamSpec::float(
            "radius",
            0.5,
            POSITIVE,
            "stage units",
            "Radius in the light's own space.",
        )],
    };

    fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample> {
        let p = self.unit_position(from);
        let d2 = p.length_squared();
        if !(d2 > 1.0 && d2.is_finite()) {
            return None;
        }
        let d = d2.sqrt();
        let one_minus_cos = cone(d2);
        let local = uniform_cone(u, one_minus_cos);
        let direction = Frame::from_normal(-p / d).world_from_local(local);
        // Distance along the cone's ray to the unit sphere: h = 1 - cos theta keeps sin^2 exact for narrow cones.
        let h = u.x * one_minus_cos;
        let t = d * (1.0 - h) - (1.0 - d2 * (h * (2.0 - h))).max(0.0).sqrt();
        let stretched = self.world_from_unit * direction;
        let stretch = stretched.length();
        let direction = stretched / stretch;
        Some(LightSample {
            direction,
            distance: t.max(0.0) * stretch * self.scale,
            radiance: self.emission.towards(-direction),
            pdf: uniform_cone_pdf(one_minus_cos) * stretch.powi(3),
            is_delta: false,
        })
    }

    fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32 {
        let p = self.unit_position(from);
        let d2 = p.length_squared();
        let shrunk = self.unit_from_world * direction;
        let length = shrunk.length();
        let w = shrunk / length;
        let along = p.dot(w);
        let is_hit = d2 > 1.0 && along < 0.0 && (p - w * along).length_squared() <= 1.0;
        if is_hit { uniform_cone_pdf(cone(d2)) / length.powi(3) } else { 0.0 }
    }

    fn radiance(&self, from: Vec3A, direction: Vec3A) -> Rgb {
        let is_outside = self.unit_position(from).length_squared() > 1.0;
        if is_outside { self.emission.towards(-direction) } else { Rgb::ZERO }
    }

    fn intersect(&self, ray: &Ray) -> Option<f32> {
        let o = self.unit_position(ray.origin);
        let d = self.unit_from_world * (ray.direction / self.scale);
        let a = d.length_squared();
        let middle = -o.dot(d) / a;
        let half_chord2 = (1.0 - (o + d * middle).length_squared()) / a;
        if half_chord2 < 0.0 || half_chord2.is_nan() {
            return None;
        }
        let half_chord = half_chord2.sqrt();
        [middle - half_chord, middle + half_chord].into_iter().find(|t| (0.0..=ray.t_max).contains(t))
    }

    fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        Some(self.corners())
    }

    fn outreach(&self) -> Outreach {
        Outreach::Local(LightBounds::new(self.corners(), self.emission.cone(), self.intensity))
    }
}

/// The inverse of an f64 matrix in f32.
pub(super) fn inverse(m: DMat3) -> Mat3A {
    let i = m.inverse();
    Mat3A::from_cols(i.x_axis.as_vec3a(), i.y_axis.as_vec3a(), i.z_axis.as_vec3a())
}

/// Surface area of the image of the unit sphere: the integral of the length of the transformed area element.
///
/// The trapezoid and midpoint rules converge exponentially here: the integrand is smooth and periodic.
pub(super) fn ellipsoid_area(m: DMat3) -> f64 {
    let cofactor =
        DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if let Some(radius) = uniform_scale(m) {
        return 4.0 * PI * radius * radius;
    }
    let (n_theta, n_phi) = (256, 128);
    let mut sum = 0.0;
    for i in 0..n_theta {
        let z = -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(n_theta);
        let r = (1.0 - z * z).sqrt();
        for j in 0..n_phi {
            let (s, c) = (TAU * f64::from(j) / f64::from(n_phi)).sin_cos();
            sum += (cofactor * DVec3::new(r * c, r * s, z)).length();
        }
    }
    sum * 4.0 * PI / (f64::from(n_theta) * f64::from(n_phi))
}

/// The scale of a map that is a rotation (or reflection) and one scale. Thousands of lights are spheres: their area
/// needs no quadrature.
fn uniform_scale(m: DMat3) -> Option<f64> {
    let square = m.x_axis.length_squared();
    let gram = m.transpose() * m;
    gram.abs_diff_eq(DMat3::from_diagonal(DVec3::splat(square)), 1e-12 * square).then(|| square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_of_spheres_and_spheroids() {
        assert!((ellipsoid_area(DMat3::IDENTITY * 3.0) / (36.0 * PI) - 1.0).abs() < 1e-6);
        // Oblate spheroid, a = 2, c = 1: 2 pi a^2 + pi c^2 / e * ln((1+e)/(1-e)).
        let e = (0.75f64).sqrt();
        let oblate = 2.0 * PI * 4.0 + PI / e * ((1.0 + e) / (1.0 - e)).ln();
        let m = DMat3::from_diagonal(DVec3::new(2.0, 2.0, 1.0));
        assert!((ellipsoid_area(m) / oblate - 1.0).abs() < 1e-4);
    }
}

//! A light at infinity that fills a cone of directions, such as the sun.
//!
//! Units: UsdLux `normalize`, schema text of usd-core 26.11.

use super::bounds::Outreach;
use super::build::LightBuilder;
use super::{Emitter, LightSample};
use crate::kind::{KindSpec, ParamSpec};
use glam::{DVec3, Vec2, Vec3A};
use std::f64::consts::{FRAC_PI_2, PI};
use tyndall_math::sampling::{uniform_cone, uniform_cone_pdf};
use tyndall_math::{Frame, Rgb};

/// Half angles below this (radians) are a parallel beam: f32 directions cannot resolve them.
const MIN_HALF_ANGLE: f64 = 1e-5;

#[derive(Debug, Clone)]
pub(super) struct Distant {
    /// z is the direction towards the middle of the light.
    frame: Frame,
    /// 1 - cos(theta_max); 0 for a parallel beam.
    one_minus_cos: f32,
    /// Radiance, or the irradiance of a parallel beam.
    radiance: Rgb,
    /// Largest channel on a surface that faces the light.
    irradiance: f64,
}

impl Distant {
    pub(super) fn build(builder: &mut LightBuilder, angle: f64) -> Option<Self> {
        if !angle.is_finite() {
            return builder.reject(
                format!("angle {angle} is not finite"),
                "the light was removed; set an angle in degrees",
            );
        }
        let theta = (0.5 * angle.to_radians()).clamp(0.0, PI);
        let size = size_factor(theta);
        let mut radiance = builder.radiance(if builder.prim.normalize { size } else { 1.0 })?;
        let is_beam = theta < MIN_HALF_ANGLE;
        if is_beam {
            radiance *= size as f32;
        }
        let axis = (builder.linear * DVec3::Z).try_normalize();
        let Some(axis) = axis else {
            return builder
                .reject("the transform has no z axis", "the light was removed; repair its transform");
        };
        let irradiance = f64::from(radiance.max_element()) * if is_beam { 1.0 } else { size };
        Some(Self {
            frame: Frame::from_normal(axis.as_vec3a()),
            one_minus_cos: if is_beam { 0.0 } else { (2.0 * (0.5 * theta).sin().powi(2)) as f32 },
            radiance,
            irradiance,
        })
    }
}

/// `sizeFactor_distant`: the irradiance on a facing surface of radiance 1 in a cone of half angle `theta`; 1 for 0.
fn size_factor(theta: f64) -> f64 {
    let sin2 = theta.sin().powi(2);
    if theta == 0.0 {
        1.0
    } else if theta <= FRAC_PI_2 {
        sin2 * PI
    } else {
        (2.0 - sin2) * PI
    }
}

impl Emitter for Distant {
    const KIND: KindSpec = KindSpec {
        name: "distant",
        doc: "Light from infinitely far, travelling along -z.",
        params: &[ParamSpec::float(
            "angle",
            0.53,
            [0.0, 360.0],
            "degrees",
            "Angular diameter; 0 is a parallel beam.",
        )],
    };
    const IS_INFINITE: bool = true;

    fn sample(&self, _: Vec3A, u: Vec2) -> Option<LightSample> {
        let is_delta = self.is_delta();
        let (direction, pdf) = if is_delta {
            (self.frame.normal, 1.0)
        } else {
            let local = uniform_cone(u, self.one_minus_cos);
            (self.frame.world_from_local(local), uniform_cone_pdf(self.one_minus_cos))
        };
        Some(LightSample { direction, distance: f32::INFINITY, radiance: self.radiance, pdf, is_delta })
    }

    fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32 {
        if self.radiance(from, direction) == Rgb::ZERO { 0.0 } else { uniform_cone_pdf(self.one_minus_cos) }
    }

    fn radiance(&self, _: Vec3A, direction: Vec3A) -> Rgb {
        // |d - axis|^2 = 2 (1 - cos): exact for narrow cones, where the cosine is not.
        let is_inside = (direction - self.frame.normal).length_squared() <= 2.0 * self.one_minus_cos;
        if is_inside && !self.is_delta() { self.radiance } else { Rgb::ZERO }
    }

    fn outreach(&self) -> Outreach {
        Outreach::Infinite { irradiance: self.irradiance }
    }

    fn is_delta(&self) -> bool {
        self.one_minus_cos == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_factors_are_the_schemas() {
        assert_eq!(size_factor(0.0), 1.0);
        assert!((size_factor(FRAC_PI_2) - PI).abs() < 1e-12);
        assert!((size_factor(PI) - 2.0 * PI).abs() < 1e-12);
        assert!((size_factor(0.1) - PI * 0.1f64.sin().powi(2)).abs() < 1e-15);
    }
}

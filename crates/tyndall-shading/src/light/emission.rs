//! Emitted radiance and its restriction to directions.
//!
//! Formulas: UsdLuxShapingAPI, schema text of usd-core 26.11.

use glam::{DVec3, Vec3A};
use tyndall_math::Rgb;
use tyndall_scene::prim::Shaping;

/// Radiance of a light in each direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Emission {
    /// Before shaping.
    pub radiance: Rgb,
    shape: Option<Shape>,
}

#[derive(Debug, Clone, Copy)]
struct Shape {
    /// The light's -z in world space.
    axis: Vec3A,
    focus: f32,
    focus_tint: Rgb,
    /// theta_cutoff in radians; `None` if the cone is open.
    cutoff: Option<f32>,
    /// theta_smoothStart in radians.
    smooth_start: f32,
}

impl Emission {
    /// `axis` is the world direction of the light's -z, of any length.
    pub(super) fn new(radiance: Rgb, shaping: &Shaping, axis: DVec3) -> Self {
        let is_open = shaping.cone_angle >= 90.0 && shaping.cone_softness <= 0.0;
        let focus = shaping.focus.max(0.0);
        let shape = (!is_open || focus > 0.0).then(|| {
            let cutoff = shaping.cone_angle.clamp(0.0, 180.0).to_radians();
            Shape {
                axis: axis.normalize_or(DVec3::NEG_Z).as_vec3a(),
                focus,
                focus_tint: Vec3A::from_array(shaping.focus_tint).max(Vec3A::ZERO),
                cutoff: (!is_open).then_some(cutoff),
                smooth_start: cutoff * (1.0 - shaping.cone_softness.clamp(0.0, 1.0)),
            }
        });
        Self { radiance, shape }
    }

    /// Radiance leaving in the unit `direction` (away from the light).
    #[inline]
    pub(super) fn towards(&self, direction: Vec3A) -> Rgb {
        match &self.shape {
            None => self.radiance,
            Some(shape) => self.radiance * shape.factor(direction),
        }
    }

    /// Mean of the shaping over all directions, largest channel.
    pub(super) fn mean_factor(&self) -> f64 {
        let Some(shape) = &self.shape else { return 1.0 };
        let n = 512;
        let mean: f64 = (0..n)
            .map(|i| {
                let cos = 1.0 - (i as f32 + 0.5) * (2.0 / n as f32);
                let angle = cos.acos();
                f64::from(shape.factor_at(angle, cos).max_element())
            })
            .sum();
        mean / f64::from(n)
    }
}

impl Shape {
    fn factor(&self, direction: Vec3A) -> Rgb {
        // Half-angle form: accurate for narrow cones, where the arc cosine is not.
        let angle = 2.0 * (direction - self.axis).length().atan2((direction + self.axis).length());
        self.factor_at(angle, direction.dot(self.axis))
    }

    fn factor_at(&self, angle: f32, cos: f32) -> Rgb {
        let mut factor = Rgb::ONE;
        if self.focus > 0.0 {
            let focus = cos.abs().min(1.0).powf(self.focus);
            factor = self.focus_tint.lerp(Vec3A::ONE, focus);
        }
        match self.cutoff {
            Some(cutoff) if angle > cutoff => Rgb::ZERO,
            Some(cutoff) if angle > self.smooth_start => {
                let x = ((angle - self.smooth_start) / (cutoff - self.smooth_start)).clamp(0.0, 1.0);
                factor * (1.0 - x * x * (3.0 - 2.0 * x))
            }
            _ => factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cone_focus_and_tint_follow_the_schema() {
        let at = |shaping: Shaping, degrees: f32| {
            let e = Emission::new(Rgb::ONE, &shaping, DVec3::NEG_Z);
            let (s, c) = degrees.to_radians().sin_cos();
            e.towards(Vec3A::new(s, 0.0, -c))
        };
        let hard = Shaping { cone_angle: 30.0, ..Shaping::default() };
        assert_eq!(at(hard, 29.9), Rgb::ONE);
        assert_eq!(at(hard, 30.1), Rgb::ZERO);
        let soft = Shaping { cone_angle: 40.0, cone_softness: 0.5, ..Shaping::default() };
        assert_eq!(at(soft, 19.9), Rgb::ONE);
        assert!((at(soft, 30.0).x - 0.5).abs() < 1e-4);
        let focus = Shaping { focus: 2.0, focus_tint: [1.0, 0.5, 0.0], ..Shaping::default() };
        assert!((at(focus, 60.0) - Rgb::new(1.0, 0.625, 0.25)).length() < 1e-5);
        assert!((at(focus, 120.0) - Rgb::new(1.0, 0.625, 0.25)).length() < 1e-5);
    }

    #[test]
    fn mean_of_a_hard_cone_is_its_share_of_the_sphere() {
        let shaping = Shaping { cone_angle: 60.0, ..Shaping::default() };
        let e = Emission::new(Rgb::ONE, &shaping, DVec3::NEG_Z);
        assert!((e.mean_factor() - 0.25).abs() < 2e-3);
    }
}

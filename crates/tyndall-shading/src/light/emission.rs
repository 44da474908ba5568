//! Emitted radiance and its restriction to directions.
//!
//! Formulas: UsdLuxShapingAPI, schema text of usd-core 26.11.

use super::bounds::Cone;
use glam::{DVec3, Vec3A};
use tyndall_math::Rgb;
use tyndall_scene::prim::{ConeProfile, Shaping};

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
    profile: ConeProfile,
}

impl Emission {
    /// `axis` is the world direction of the light's -z, of any length.
    pub(super) fn new(radiance: Rgb, shaping: &Shaping, axis: DVec3) -> Self {
        let is_honeycomb = shaping.cone_profile == ConeProfile::Honeycomb;
        let is_open = shaping.cone_angle >= 90.0 && (shaping.cone_softness <= 0.0 || is_honeycomb);
        let focus = shaping.focus.max(0.0);
        let shape = (!is_open || focus > 0.0).then(|| {
            let cutoff = shaping.cone_angle.clamp(0.0, 180.0).to_radians();
            Shape {
                axis: axis.normalize_or(DVec3::NEG_Z).as_vec3a(),
                focus,
                focus_tint: Vec3A::from_array(shaping.focus_tint).max(Vec3A::ZERO),
                cutoff: (!is_open).then_some(cutoff),
                smooth_start: smooth_start(shaping, cutoff),
                profile: shaping.cone_profile,
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

    /// The directions outside which shaping certainly leaves nothing.
    pub(super) fn cone(&self) -> Cone {
        match &self.shape {
            Some(Shape { axis, cutoff: Some(cutoff), smooth_start, .. }) => {
                Cone::beam(axis.as_dvec3(), f64::from(*smooth_start), f64::from(*cutoff))
            }
            _ => Cone::SPHERE,
        }
    }

    /// [`Self::cone`] for a card: shaping or the side of `normal`, whichever leaves less.
    pub(super) fn cone_of_card(&self, normal: Vec3A) -> Cone {
        let (side, shaped) = (Cone::hemisphere(normal), self.cone());
        if shaped.theta_o + shaped.theta_e < side.theta_o + side.theta_e { shaped } else { side }
    }

    /// Mean of the shaping over the directions inside [`Self::cone`], largest channel.
    pub(super) fn mean_factor(&self) -> f64 {
        let Some(shape) = &self.shape else { return 1.0 };
        // Half angles: 1 - cos of a narrow cone has no digits in f32.
        let height = 2.0 * (0.5 * shape.cutoff.map_or(std::f64::consts::PI, f64::from)).sin().powi(2);
        let n = 128;
        let mean: f64 = (0..n)
            .map(|i| {
                let h = (f64::from(i) + 0.5) * height / f64::from(n);
                let angle = 2.0 * (0.5 * h).sqrt().min(1.0).asin();
                f64::from(shape.factor_at(angle as f32, (1.0 - h) as f32).max_element())
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
            Some(cutoff) if angle > self.smooth_start => factor * self.fade(angle, cutoff),
            _ => factor,
        }
    }

    /// What is left between the start of the fade and the edge.
    fn fade(&self, angle: f32, cutoff: f32) -> f32 {
        let start = self.smooth_start;
        let x = match self.profile {
            ConeProfile::Angle => (angle - start) / (cutoff - start),
            // cos a - cos b without the loss of digits near the axis.
            ConeProfile::Cosine => {
                let below_start = |a: f32| (0.5 * (a + start)).sin() * (0.5 * (a - start)).sin();
                below_start(angle) / below_start(cutoff)
            }
            ConeProfile::Honeycomb => return honeycomb(angle, cutoff),
        };
        let x = x.clamp(0.0, 1.0);
        1.0 - x * x * (3.0 - 2.0 * x)
    }
}

/// Radians from the axis where the fade begins.
fn smooth_start(shaping: &Shaping, cutoff: f32) -> f32 {
    let softness = shaping.cone_softness.clamp(0.0, 1.0);
    match shaping.cone_profile {
        ConeProfile::Angle => cutoff * (1.0 - softness),
        // Where 1 - cos is the part 1 - softness of the edge's: half-angle form.
        ConeProfile::Cosine => 2.0 * ((0.5 * cutoff).sin() * (1.0 - softness).sqrt()).asin(),
        ConeProfile::Honeycomb => 0.0,
    }
}

/// The part that a honeycomb with its edge at `cutoff` lets through at `angle`, over the mean over directions weighted by
/// their cosine.
fn honeycomb(angle: f32, cutoff: f32) -> f32 {
    // Twice the integral of (tan c - tan a) sin a cos a over a in [0, c] is tan c - c.
    let (edge, at) = (f64::from(cutoff).tan(), f64::from(angle).tan());
    // The difference vanishes as c^3 / 3.
    let c = f64::from(cutoff);
    let mean = if c < 0.01 { c.powi(3) * (1.0 / 3.0 + c * c * (2.0 / 15.0)) } else { edge - c };
    if mean > 0.0 { ((edge - at).max(0.0) / mean) as f32 } else { 0.0 }
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
        let cosine = Shaping { cone_profile: ConeProfile::Cosine, ..soft };
        // Half-way between cos 40 and 1 it begins, half-way from there to cos 40 it is half.
        let degrees_at = |part: f32| (1.0 - part * (1.0 - 40f32.to_radians().cos())).acos().to_degrees();
        assert_eq!(at(cosine, degrees_at(0.499)), Rgb::ONE);
        assert!((at(cosine, degrees_at(0.75)).x - 0.5).abs() < 1e-4);
        assert_eq!(at(cosine, 40.1), Rgb::ZERO);
        let focus = Shaping { focus: 2.0, focus_tint: [1.0, 0.5, 0.0], ..Shaping::default() };
        assert!((at(focus, 60.0) - Rgb::new(1.0, 0.625, 0.25)).length() < 1e-5);
        assert!((at(focus, 120.0) - Rgb::new(1.0, 0.625, 0.25)).length() < 1e-5);
    }

    #[test]
    fn honeycombs_keep_the_power_of_a_card() {
        for cone_angle in [0.2_f32, 5.0, 45.0, 80.0] {
            let shaping = Shaping { cone_angle, cone_profile: ConeProfile::Honeycomb, ..Shaping::default() };
            let emission = Emission::new(Rgb::ONE, &shaping, DVec3::NEG_Z);
            let n = 20_000;
            let edge = f64::from(cone_angle).to_radians();
            let power: f64 = (0..n)
                .map(|i| {
                    let angle = (f64::from(i) + 0.5) / f64::from(n) * edge;
                    let (sin, cos) = angle.sin_cos();
                    let radiance = emission.towards(Vec3A::new(sin as f32, 0.0, -cos as f32)).x;
                    2.0 * f64::from(radiance) * sin * cos * edge / f64::from(n)
                })
                .sum();
            assert!((power - 1.0).abs() < 2e-3, "{cone_angle}: {power}");
        }
    }

    #[test]
    fn means_inside_cones() {
        let mean = |shaping: Shaping| Emission::new(Rgb::ONE, &shaping, DVec3::NEG_Z).mean_factor();
        for cone_angle in [0.01, 60.0, 120.0] {
            assert!((mean(Shaping { cone_angle, ..Shaping::default() }) - 1.0).abs() < 1e-3);
        }
        // The mean of |cos| over the sphere.
        let focus = Shaping { focus: 1.0, ..Shaping::default() };
        assert!((mean(focus) - 0.5).abs() < 1e-3);
        // Soft all the way: the mean of 1 - smoothstep over a narrow cone's area is 0.3.
        let soft = Shaping { cone_angle: 1.0, cone_softness: 1.0, ..Shaping::default() };
        assert!((mean(soft) - 0.3).abs() < 1e-2, "{}", mean(soft));
    }
}

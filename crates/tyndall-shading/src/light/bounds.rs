//! What the choice of a light knows of one light, or of a cluster of lights: where, which way and how much.

use glam::{DQuat, DVec3, Vec3A};
use std::f64::consts::{FRAC_PI_2, PI};

/// Largest intensity that is kept, W/sr: sums over 2^32 lights times squared f32 distances stay finite in f64.
const MAX_INTENSITY: f64 = 1e200;

/// How light leaves a light.
#[derive(Debug, Clone, Copy)]
pub(super) enum Outreach {
    /// From outside the scene. A guess of the irradiance on a surface that faces the light, W/m^2.
    Infinite { irradiance: f64 },
    /// From a place.
    Local(LightBounds),
}

/// A light or a cluster of lights. Outside the box and the cone there is certainly nothing; the intensity is a guess.
#[derive(Debug, Clone, Copy)]
pub(super) struct LightBounds {
    pub min: Vec3A,
    pub max: Vec3A,
    pub cone: Cone,
    /// Largest channel of the mean intensity inside the cone (for a card: along its normal), W/sr.
    pub intensity: f64,
}

/// The directions in which light leaves: at most `theta_e` from a direction that is at most `theta_o` from the axis
/// (Conty Estevez & Kulla 2018, section 4.1). Radians, `theta_e` at most pi / 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cone {
    /// Unit vector.
    pub axis: DVec3,
    pub theta_o: f64,
    pub theta_e: f64,
}

impl LightBounds {
    /// One light; an intensity that is not a number becomes 0, which leaves the light its defensive share.
    pub(super) fn new((min, max): (Vec3A, Vec3A), cone: Cone, intensity: f64) -> Self {
        let intensity = if intensity > 0.0 { intensity.min(MAX_INTENSITY) } else { 0.0 };
        Self { min, max, cone, intensity }
    }

    /// Middle of the box; halved before adding, so that boxes up to `f32::MAX` stay finite.
    pub(super) fn center(&self) -> Vec3A {
        self.min * 0.5 + self.max * 0.5
    }

    /// The term of one side of a split in the surface area orientation heuristic (equation 1 of the paper):
    /// energy times extent times orientation.
    ///
    /// The extent is the squared diagonal: the distance below which importance is clamped. The paper's surface area
    /// vanishes for lights on a line, where every split would then look alike.
    pub(super) fn cost(&self) -> f64 {
        let diagonal2 = (self.max.as_dvec3() - self.min.as_dvec3()).length_squared();
        self.intensity * diagonal2 * solid_angle(self.cone.theta_o, self.cone.theta_e)
    }
}

impl Cone {
    /// All directions.
    pub(super) const SPHERE: Self = Self { axis: DVec3::Z, theta_o: PI, theta_e: FRAC_PI_2 };

    /// A card that sends by the cosine law to the side of its `normal`.
    pub(super) fn hemisphere(normal: Vec3A) -> Self {
        Self { axis: normal.as_dvec3().normalize_or(DVec3::Z), theta_o: 0.0, theta_e: FRAC_PI_2 }
    }

    /// A beam that falls off from `start` to nothing at `cutoff`, both radians from the axis.
    pub(super) fn beam(axis: DVec3, start: f64, cutoff: f64) -> Self {
        let cutoff = cutoff.clamp(0.0, PI);
        let theta_e = (cutoff - start).clamp(0.0, FRAC_PI_2);
        Self { axis, theta_o: cutoff - theta_e, theta_e }
    }

    /// Whether it leaves no direction out.
    pub(super) fn is_sphere(&self) -> bool {
        self.theta_o >= PI
    }

    /// The cone around both (algorithm 1 of the paper).
    pub(super) fn union(&self, other: &Self) -> Self {
        let theta_e = self.theta_e.max(other.theta_e);
        let (a, b) = if self.theta_o >= other.theta_o { (self, other) } else { (other, self) };
        if a.is_sphere() {
            return Self { theta_e, ..*a };
        }
        let theta_d = angle_between(a.axis, b.axis);
        if theta_d + b.theta_o <= a.theta_o {
            return Self { theta_e, ..*a };
        }
        let theta_o = 0.5 * (a.theta_o + theta_d + b.theta_o);
        let turn_axis = a.axis.cross(b.axis).try_normalize();
        match turn_axis {
            Some(turn_axis) if theta_o < PI => {
                let turn = DQuat::from_axis_angle(turn_axis, theta_o - a.theta_o);
                Self { axis: (turn * a.axis).normalize(), theta_o, theta_e }
            }
            // Beyond a half turn, or two cones back to back: no single turn is the right one.
            _ => Self { theta_e, ..Self::SPHERE },
        }
    }
}

/// M_Omega of the paper's equation 1: the solid angle of a [`Cone`], the falloff beyond `theta_o` weighted by its cosine.
pub(super) fn solid_angle(theta_o: f64, theta_e: f64) -> f64 {
    if theta_o >= PI {
        return 4.0 * PI;
    }
    let theta_w = (theta_o + theta_e).min(PI);
    let (sin_o, cos_o) = theta_o.sin_cos();
    let falloff = 2.0 * theta_w * sin_o - (theta_o - 2.0 * theta_w).cos() - 2.0 * theta_o * sin_o;
    2.0 * PI * (1.0 - cos_o) + FRAC_PI_2 * (falloff + cos_o)
}

/// Angle between unit vectors; accurate for small angles, where the arc cosine is not.
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    2.0 * (a - b).length().atan2((a + b).length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cone() -> impl Strategy<Value = Cone> {
        let axis = (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64);
        (axis, 0.0..3.2f64, 0.0..1.6f64).prop_map(|((x, y, z), theta_o, theta_e)| Cone {
            axis: DVec3::new(x, y, z).normalize_or(DVec3::X),
            theta_o: theta_o.min(PI),
            theta_e: theta_e.min(FRAC_PI_2),
        })
    }

    proptest! {
        #[test]
        fn a_union_holds_both(a in cone(), b in cone()) {
            let both = a.union(&b);
            for it in [a, b] {
                let reach = angle_between(both.axis, it.axis) + it.theta_o;
                prop_assert!(both.is_sphere() || reach <= both.theta_o + 1e-9, "{it:?} in {both:?}");
                prop_assert!(both.theta_e >= it.theta_e);
            }
        }
    }

    #[test]
    fn cones_back_to_back_fill_the_sphere() {
        let card = Cone::hemisphere(Vec3A::Y);
        assert!(card.union(&Cone::hemisphere(-Vec3A::Y)).is_sphere());
        assert_eq!(card.union(&card), card);
    }

    #[test]
    fn measures_are_known_solid_angles() {
        assert!((solid_angle(PI - 1e-12, FRAC_PI_2) - 4.0 * PI).abs() < 1e-9);
        assert_eq!(solid_angle(PI, FRAC_PI_2), 4.0 * PI);
        // The cosine over the hemisphere.
        assert!((solid_angle(0.0, FRAC_PI_2) - PI).abs() < 1e-9);
        assert!((solid_angle(0.5, 0.0) - 2.0 * PI * (1.0 - 0.5f64.cos())).abs() < 1e-9);
    }
}

//! Points finer than the rounding of f32.

use crate::Ray;
use glam::{DVec3, Vec3A};

/// The point `high + low`, which no f32 vector holds: `low` is what rounding took from `high`.
///
/// In a medium of 1e8 per unit a free flight is shorter than the spacing of f32 at distance 1. A path that rounded its
/// vertices would start anew from the boundary at every collision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplitPoint {
    /// What everything but the boundaries of media takes for the point.
    pub high: Vec3A,
    /// The rest: a few units in the last place of `high`.
    pub low: Vec3A,
}

impl SplitPoint {
    /// The point at `t` on a ray whose true origin is `ray.origin + low`.
    #[inline]
    pub fn on(ray: &Ray, low: Vec3A, t: f64) -> Self {
        let origin = ray.origin.as_dvec3() + low.as_dvec3();
        Self::from(origin + ray.direction.as_dvec3() * t)
    }
}

impl From<DVec3> for SplitPoint {
    #[inline]
    fn from(point: DVec3) -> Self {
        let high = point.as_vec3a();
        Self { high, low: (point - high.as_dvec3()).as_vec3a() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_below_the_rounding_add_up() {
        let direction = Vec3A::new(0.6, -0.8, 0.0);
        let start = DVec3::new(1.7, -3.1, 0.3);
        let mut point = SplitPoint::from(start);
        for _ in 0..1000 {
            point = SplitPoint::on(&Ray::new(point.high, direction), point.low, 1e-11);
        }
        let moved = point.high.as_dvec3() + point.low.as_dvec3() - start;
        assert!((moved - direction.as_dvec3() * 1e-8).length() < 1e-11, "{moved}");
    }
}

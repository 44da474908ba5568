//! The analytic unit sphere.
//!
//! Solved in f64: the ray is f32, so its discriminant keeps 29 digits to spare and roots near zero have the right sign.
//! Form of Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection", which doesn't square distances.

use super::LocalHit;
use crate::accel::Crossing;
use glam::DVec3;
use tyndall_math::Ray;

/// Both parameters where the line meets the unit sphere, ascending; NaN if it doesn't (or only touches).
#[inline]
pub(crate) fn roots_f64(origin: DVec3, direction: DVec3) -> [f64; 2] {
    let a = direction.length_squared();
    let middle = -origin.dot(direction) / a;
    let closest = origin + direction * middle;
    let discriminant = 1.0 - closest.length_squared();
    // The square root of a negative number is NaN, which no interval contains.
    let half = (discriminant / a).sqrt();
    if half > 0.0 { [middle - half, middle + half] } else { [f64::NAN; 2] }
}

#[inline]
pub(super) fn roots(ray: &Ray) -> [f32; 2] {
    // Rounding keeps the sign: a positive f64 doesn't become a negative f32.
    roots_f64(ray.origin.as_dvec3(), ray.direction.as_dvec3()).map(|t| t as f32)
}

#[inline]
pub(super) fn nearest(ray: &Ray, best: &mut LocalHit) {
    for t in roots(ray) {
        if (0.0..=best.t).contains(&t) && (t < best.t || best.primitive > 0) {
            *best = LocalHit { t, primitive: 0, u: 0.0, v: 0.0 };
            return;
        }
    }
}

#[inline]
pub(super) fn all(ray: &Ray, instance: u32, out: &mut Vec<Crossing>) {
    for (t, entering) in roots(ray).into_iter().zip([true, false]) {
        if (0.0..=ray.t_max).contains(&t) {
            out.push(Crossing { t, instance, entering, primitive: 0 });
        }
    }
}

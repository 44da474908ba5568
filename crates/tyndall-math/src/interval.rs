//! Rounding bounds, and ray origins that leave a surface without an absolute epsilon.

use glam::Vec3A;

/// Bound on the relative error of `n` chained f32 operations (Higham 2002, lemma 3.1).
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * (f32::EPSILON * 0.5);
    e / (1.0 - e)
}

/// [`gamma`] of three operations: the slab test's bound.
pub const GAMMA_3: f32 = gamma(3);

/// A ray origin that is certainly on the side of the surface to which `direction` points.
///
/// `position_error` bounds the absolute rounding error of `position` per axis. The point moves along the geometric
/// `normal` just past the error box, then every coordinate is rounded away from the surface
/// (Pharr, Jakob, Humphreys 2023, section 6.8.6).
#[inline]
pub fn offset_ray_origin(position: Vec3A, position_error: Vec3A, normal: Vec3A, direction: Vec3A) -> Vec3A {
    let distance = normal.abs().dot(position_error);
    let offset = if direction.dot(normal) < 0.0 { normal * -distance } else { normal * distance };
    let moved = position + offset;
    let round = |value: f32, offset: f32| match offset {
        o if o > 0.0 => value.next_up(),
        o if o < 0.0 => value.next_down(),
        _ => value,
    };
    Vec3A::new(round(moved.x, offset.x), round(moved.y, offset.y), round(moved.z, offset.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_the_plane_at_every_scale() {
        for scale in [1e-6f32, 1.0, 1e6] {
            let n = Vec3A::new(0.3, 0.8, -0.2).normalize();
            let p = Vec3A::new(0.7, -0.1, 0.4) * scale;
            let error = p.abs() * gamma(6);
            let above = offset_ray_origin(p, error, n, n);
            let below = offset_ray_origin(p, error, n, -n);
            assert!((above - p).dot(n) > 0.0 && (below - p).dot(n) < 0.0);
            assert!((above - p).length() < 1e-5 * scale);
        }
    }
}

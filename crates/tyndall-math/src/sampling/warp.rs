//! Closed-form warps. All take `u` in [0, 1)^2; directions are unit vectors around local +z.

use crate::INV_PI;
use glam::{Vec2, Vec3A};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// Uniform point on the unit disk, keeping neighbours together (Shirley & Chiu 1997).
#[inline]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = u * 2.0 - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, theta) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    radius * Vec2::new(theta.cos(), theta.sin())
}

/// Direction with density cos(theta)/pi on the upper hemisphere.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3A {
    let d = concentric_disk(u);
    Vec3A::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] per steradian; zero below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * INV_PI
}

/// Uniform direction on the sphere, density 1/(4 pi).
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3A {
    let z = 1.0 - 2.0 * u.x;
    let r = (4.0 * u.x * (1.0 - u.x)).max(0.0).sqrt();
    let phi = TAU * u.y;
    Vec3A::new(r * phi.cos(), r * phi.sin(), z)
}

/// Uniform direction inside the cone around +z; `one_minus_cos` = 1 - cos(half angle), given directly because it
/// cancels for narrow cones.
#[inline]
pub fn uniform_cone(u: Vec2, one_minus_cos: f32) -> Vec3A {
    let h = u.x * one_minus_cos;
    let r = (h * (2.0 - h)).max(0.0).sqrt();
    let phi = TAU * u.y;
    Vec3A::new(r * phi.cos(), r * phi.sin(), 1.0 - h)
}

/// Density of [`uniform_cone`] per steradian.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric coordinates (of the second and third corner) of a uniform point in a triangle (Heitz 2019).
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.x < u.y { Vec2::new(0.5 * u.x, u.y - 0.5 * u.x) } else { Vec2::new(u.x - 0.5 * u.y, 0.5 * u.y) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg;

    fn mean(f: impl Fn(Vec2) -> f32) -> f32 {
        let mut rng = Pcg::new(&[7]);
        let n = 200_000;
        (0..n).map(|_| f(Vec2::new(rng.next_f32(), rng.next_f32())) as f64).sum::<f64>() as f32 / n as f32
    }

    #[test]
    fn moments_match_closed_forms() {
        assert!((mean(|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 2e-3);
        assert!(mean(|u| uniform_sphere(u).z).abs() < 5e-3);
        assert!((mean(|u| uniform_sphere(u).z.powi(2)) - 1.0 / 3.0).abs() < 3e-3);
        assert!((mean(|u| concentric_disk(u).length_squared()) - 0.5).abs() < 3e-3);
        assert!((mean(|u| uniform_triangle(u).x) - 1.0 / 3.0).abs() < 2e-3);
        assert!((mean(|u| uniform_cone(u, 0.5).z) - 0.75).abs() < 2e-3);
    }

    #[test]
    fn directions_are_unit_at_the_corners_of_the_square() {
        for u in [Vec2::ZERO, Vec2::splat(0.999_999_9), Vec2::new(0.0, 0.999_999_9), Vec2::splat(0.5)] {
            for d in [cosine_hemisphere(u), uniform_sphere(u), uniform_cone(u, 1e-9)] {
                assert!((d.length() - 1.0).abs() < 1e-5, "{u}");
            }
        }
    }
}

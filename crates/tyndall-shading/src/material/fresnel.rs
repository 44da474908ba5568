//! Fresnel reflectances.

use tyndall_math::Rgb;

/// What happens to a ray at the boundary of a dielectric.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interface {
    /// Reflected fraction.
    pub reflectance: f32,
    /// Cosine of the refracted ray; 0 under total reflection.
    pub cos_t: f32,
}

/// Unpolarised reflectance for `cos_i` >= 0 and `eta` = index on the far side over the near side
/// (Born & Wolf 1999, section 1.5).
#[inline]
pub(super) fn dielectric(cos_i: f32, eta: f32) -> Interface {
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return Interface { reflectance: 1.0, cos_t: 0.0 };
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    Interface { reflectance: 0.5 * (parallel * parallel + perpendicular * perpendicular), cos_t }
}

/// Unpolarised reflectance of a metal with refractive index `n` and extinction coefficient `k`, per channel
/// (Born & Wolf 1999, section 14.2).
#[inline]
pub(super) fn conductor(cos_i: f32, n: Rgb, k: Rgb) -> Rgb {
    let cos2 = cos_i * cos_i;
    let sin2 = Rgb::splat(1.0 - cos2);
    let (n2, k2) = (n * n, k * k);
    let t0 = n2 - k2 - sin2;
    let sqrt = |v: Rgb| Rgb::new(v.x.max(0.0).sqrt(), v.y.max(0.0).sqrt(), v.z.max(0.0).sqrt());
    let a2_plus_b2 = sqrt(t0 * t0 + 4.0 * n2 * k2);
    let a = sqrt(0.5 * (a2_plus_b2 + t0));
    let t1 = a2_plus_b2 + Rgb::splat(cos2);
    let t2 = 2.0 * a * cos_i;
    let perpendicular = (t1 - t2) / (t1 + t2).max(Rgb::splat(f32::MIN_POSITIVE));
    let t3 = a2_plus_b2 * cos2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let parallel = perpendicular * (t3 - t4) / (t3 + t4).max(Rgb::splat(f32::MIN_POSITIVE));
    0.5 * (perpendicular + parallel)
}

/// `(1 - cos)^5`.
#[inline]
pub(super) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Reflectance at normal incidence of an index `ior`.
#[inline]
pub(super) fn normal_reflectance(ior: f32) -> f32 {
    let r = (ior - 1.0) / (ior + 1.0);
    r * r
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert!((dielectric(1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
        assert!((dielectric(1.0, 1.0 / 1.5).reflectance - 0.04).abs() < 1e-6);
        assert!((dielectric(0.0, 1.5).reflectance - 1.0).abs() < 1e-6);
        // Critical angle of glass: sin = 1 / 1.5.
        assert_eq!(dielectric(0.7, 1.0 / 1.5).reflectance, 1.0);
        assert!(dielectric(0.76, 1.0 / 1.5).reflectance < 1.0);
        // Brewster's angle: tan = 1.5, half of the perpendicular part is left: ((1 - 2.25) / (1 + 2.25))^2 / 2.
        let brewster = (1.0 / (1.0f32 + 2.25)).sqrt();
        assert!((dielectric(brewster, 1.5).reflectance - 0.5 * (1.25f32 / 3.25).powi(2)).abs() < 1e-6);
    }

    #[test]
    fn a_metal_without_extinction_is_a_dielectric() {
        for i in 0..=20 {
            let cos = i as f32 / 20.0;
            let metal = conductor(cos, Rgb::splat(1.5), Rgb::ZERO).x;
            assert!((metal - dielectric(cos, 1.5).reflectance).abs() < 1e-5, "cos {cos}");
        }
        let gold_green = conductor(1.0, Rgb::splat(0.42), Rgb::splat(2.35)).x;
        let expected =
            ((0.42f32 - 1.0).powi(2) + 2.35f32.powi(2)) / ((0.42f32 + 1.0).powi(2) + 2.35f32.powi(2));
        assert!((gold_green - expected).abs() < 1e-5);
    }
}

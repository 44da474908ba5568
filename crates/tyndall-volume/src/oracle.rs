//! Slow, obviously right twins in f64: for tests, here and in other crates.

use crate::medium::{Medium, Span};
use tyndall_math::Ray;

/// Coefficients at a point: extinction, scattering, emission, per channel.
#[derive(Debug, Clone, Copy, Default)]
pub struct PointSums {
    /// Extinction per stage unit.
    pub sigma_t: [f64; 3],
    /// Scattering per stage unit.
    pub sigma_s: [f64; 3],
    /// Emission per stage unit.
    pub emission: [f64; 3],
}

/// The sums of all media at `t`.
pub fn sums_at(media: &[Medium], spans: &[Span], ray: &Ray, t: f64) -> PointSums {
    let mut sums = PointSums::default();
    for span in spans.iter().filter(|span| span.t0 <= t && t < span.t1 && t <= f64::from(ray.t_max)) {
        let medium = &media[span.medium as usize];
        let point = ray.at(t as f32);
        let density = medium.density.as_ref().map_or(1.0, |density| {
            f64::from(density.grid.density(density.index_from_world.transform_point3a(point)))
        });
        let (mut c, mut emission) = (medium.coefficients(), medium.emission.usable().at(density as f32));
        if let Some(tint) = &medium.tint {
            let color = tint.color(point, density as f32);
            c = medium.tinted(tint, color);
            emission += tint.glow * color * density as f32;
        }
        for i in 0..3 {
            sums.sigma_t[i] += f64::from(c.sigma_t[i]) * density;
            sums.sigma_s[i] += f64::from(c.sigma_s[i]) * density;
            sums.emission[i] += f64::from(emission[i]);
        }
    }
    sums
}

/// What ray marching over `[0, t_max]` finds, per channel.
#[derive(Debug, Clone, Copy, Default)]
pub struct March {
    /// Transmittance of the whole segment.
    pub transmittance: [f64; 3],
    /// ∫ T(t) emission(t) dt.
    pub emission: [f64; 3],
    /// ∫ T(t) σ_s(t) f(t) dt.
    pub scattered: [f64; 3],
}

/// Marches the segment in `n` equal steps (midpoint rule, exact attenuation within a step); `t_max` must be finite.
pub fn march(media: &[Medium], spans: &[Span], ray: &Ray, n: u32, f: impl Fn(f64) -> f64) -> March {
    let dt = f64::from(ray.t_max) / f64::from(n);
    let mut result = March { transmittance: [1.0; 3], ..Default::default() };
    for i in 0..n {
        let t = (f64::from(i) + 0.5) * dt;
        let sums = sums_at(media, spans, ray, t);
        for c in 0..3 {
            let tau = sums.sigma_t[c] * dt;
            let inside = if tau > 1e-12 { -(-tau).exp_m1() / tau } else { 1.0 };
            let seen = result.transmittance[c] * inside * dt;
            result.emission[c] += seen * sums.emission[c];
            result.scattered[c] += seen * sums.sigma_s[c] * f(t);
            result.transmittance[c] *= (-tau).exp();
        }
    }
    result
}

/// Transmittance of the segment by ray marching.
pub fn transmittance(media: &[Medium], spans: &[Span], ray: &Ray, n: u32) -> [f64; 3] {
    march(media, spans, ray, n, |_| 0.0).transmittance
}

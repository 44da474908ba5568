//! Quadrature over the sphere and Pearson's test.

use glam::Vec3A;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;

/// Midpoints of cells of equal solid angle, `n_z` rings of `n_phi`, ring by ring from z = -1.
pub(crate) fn grid(n_z: usize, n_phi: usize) -> Vec<Vec3A> {
    let direction = |i: usize| {
        let z = -1.0 + 2.0 * ((i / n_phi) as f64 + 0.5) / n_z as f64;
        let phi = 2.0 * PI * ((i % n_phi) as f64 + 0.5) / n_phi as f64;
        let r = (1.0 - z * z).sqrt();
        Vec3A::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)
    };
    (0..n_z * n_phi).map(direction).collect()
}

/// The cell of [`grid`] in which the unit vector `d` lies.
pub(crate) fn cell(d: Vec3A, n_z: usize, n_phi: usize) -> usize {
    let z = ((f64::from(d.z) + 1.0) * 0.5 * n_z as f64) as usize;
    let phi = (f64::from(d.y).atan2(f64::from(d.x)) / (2.0 * PI) + 1.0).fract();
    z.min(n_z - 1) * n_phi + ((phi * n_phi as f64) as usize).min(n_phi - 1)
}

/// ∫ f dΩ for functions without features below a degree.
pub(crate) fn integrate_sphere(f: impl Fn(Vec3A) -> f64) -> f64 {
    // Midpoints are exact to second order in z, to all orders around the circle.
    let directions = grid(800, 400);
    directions.iter().map(|&d| f(d)).sum::<f64>() * 4.0 * PI / directions.len() as f64
}

/// Probability of a deviation at least this large, cells of fewer than five expected samples pooled.
pub(crate) fn chi_square_p_value(counts: &[f64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells, mut rest) = (0.0, 0u32, (0.0, 0.0));
    for (&count, &mean) in counts.iter().zip(expected) {
        if mean < 5.0 {
            rest = (rest.0 + count, rest.1 + mean);
        } else {
            statistic += (count - mean).powi(2) / mean;
            cells += 1;
        }
    }
    if rest.1 >= 5.0 {
        statistic += (rest.0 - rest.1).powi(2) / rest.1;
        cells += 1;
    }
    1.0 - ChiSquared::new(f64::from(cells - 1)).unwrap().cdf(statistic)
}

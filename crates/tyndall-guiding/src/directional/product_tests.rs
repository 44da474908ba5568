//! Products against pointwise multiplication and quadrature.

use super::super::test_support::{cell, chi_square_p_value, grid};
use super::*;
use glam::Vec2;
use tyndall_math::random::Pcg;

fn mixture() -> VmfMixture {
    VmfMixture::from_lobes([
        (0.1, VmfLobe::new(Vec3A::Z, 0.0)),
        (0.4, VmfLobe::new(Vec3A::new(0.6, 0.0, 0.8), 30.0)),
        (0.3, VmfLobe::new(Vec3A::NEG_Y, 5.0)),
        (0.2, VmfLobe::new(Vec3A::new(0.0, -0.8, -0.6), 150.0)),
    ])
}

/// ∫ f dΩ for functions without features below three degrees.
fn integrate(f: impl Fn(Vec3A) -> f64) -> f64 {
    let directions = grid(160, 320);
    directions.iter().map(|&d| f(d)).sum::<f64>() * 4.0 * std::f64::consts::PI / directions.len() as f64
}

fn hg(cos: f64, g: f64) -> f64 {
    (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5) / (4.0 * std::f64::consts::PI)
}

#[test]
fn products_with_lobes_are_exact() {
    for (axis, kappa) in
        [(Vec3A::X, 0.0), (Vec3A::X, 3.0), (Vec3A::NEG_Z, 12.0), (Vec3A::new(0.6, 0.0, 0.8), 80.0)]
    {
        let other = VmfLobe::new(axis, kappa);
        let mixture = mixture();
        let (product, integral) = mixture.product(&other);
        let want = integrate(|d| f64::from(mixture.pdf(d) * other.pdf(d)));
        assert!((f64::from(integral) / want - 1.0).abs() < 2e-3, "{integral} not {want}");
        for d in grid(30, 60) {
            let (got, want) = (integral * product.pdf(d), mixture.pdf(d) * other.pdf(d));
            assert!((got - want).abs() < 1e-4 * (got + want) + 1e-12, "{got} not {want} at {d}");
        }
        // Lobe by lobe, they are those of `VmfLobe::product`.
        for ((_, got), (_, lobe)) in product.lobes().zip(mixture.lobes()) {
            let want = lobe.product(&other).0;
            assert!((got.kappa() - want.kappa()).abs() <= 1e-4 * want.kappa());
            assert!(want.kappa() < 1e-3 || got.mean().dot(want.mean()) > 1.0 - 1e-5);
        }
    }
}

/// ∫ f of the exact product of the mixture with `factor`, and the relative variance of sampling it with `pdf`.
fn integral_and_variance(factor: impl Fn(Vec3A) -> f64, pdf: impl Fn(Vec3A) -> f64) -> (f64, f64) {
    let mixture = mixture();
    let wanted = |d: Vec3A| f64::from(mixture.pdf(d)) * factor(d);
    let total = integrate(wanted);
    (total, integrate(|d| (wanted(d) / total).powi(2) / pdf(d)) - 1.0)
}

#[test]
fn products_with_cosines_are_close() {
    for normal in [Vec3A::Z, Vec3A::X, Vec3A::new(0.0, -0.6, 0.8)] {
        let (product, integral) = mixture().product_with_cosine(normal);
        let cosine = |d: Vec3A| f64::from(normal.dot(d).max(0.0));
        let mixture = mixture();
        let (want, with) = integral_and_variance(cosine, |d| product.pdf(d).into());
        let (_, without) = integral_and_variance(cosine, |d| mixture.pdf(d).into());
        assert!((f64::from(integral) / want - 1.0).abs() < 0.25, "{integral} not {want}");
        assert!(with < 0.3 && with < 0.6 * without, "{with} with, {without} without");
    }
}

#[test]
fn products_with_phase_functions_are_close() {
    let mixture = mixture();
    for (wo, g) in [(Vec3A::Z, 0.0), (Vec3A::X, 0.6), (Vec3A::X, -0.6), (Vec3A::Y, 0.9), (Vec3A::Z, -0.9)] {
        let (product, integral) = mixture.product_with_hg(wo, g);
        let phase = |d: Vec3A| hg(-f64::from(wo.dot(d)), g.into());
        // Lobes have no tails, so half of all directions are drawn from the phase function, as renderers do.
        let (want, variance) = integral_and_variance(phase, |d| 0.5 * (f64::from(product.pdf(d)) + phase(d)));
        let exact = |d: Vec3A| f64::from(mixture.pdf(d)) * phase(d) / want;
        let (_, least) = integral_and_variance(phase, |d| 0.5 * (exact(d) + phase(d)));
        assert!(variance < least + 0.3, "g = {g}: {variance}, {least} with the exact product");
        assert!((0.5..2.0).contains(&(f64::from(integral) / want)), "g = {g}: {integral} not {want}");
        for ((got, _), (weight, lobe)) in product.lobes().zip(mixture.lobes()) {
            let share = integrate(|d| f64::from(weight * lobe.pdf(d)) * phase(d)) / want;
            let ratio = f64::from(got) / share;
            assert!((0.45..2.2).contains(&ratio), "g = {g}: {got} not {share}");
        }
    }
}

fn unchanged(_: usize, lobes: Group) -> Group {
    lobes
}

#[test]
fn light_from_everywhere_needs_no_guide_and_a_lamp_needs_one() {
    let uniform = VmfMixture::from_lobes([(1.0, VmfLobe::new(Vec3A::Z, 0.0))]);
    let lamp = VmfMixture::from_lobes([(1.0, VmfLobe::new(Vec3A::Z, 1e4))]);
    for g in [-0.8, 0.0, 0.5, 0.95] {
        assert_eq!(uniform.narrower_than_hg(Vec3A::X, g, unchanged).1, 0.0, "g = {g}");
        assert!(lamp.narrower_than_hg(Vec3A::NEG_Z, g, unchanged).1 > 0.85, "g = {g}");
    }
    assert_eq!(uniform.narrower_than_cosine(Vec3A::X, unchanged).1, 0.0);
    assert!(lamp.narrower_than_cosine(Vec3A::Z, unchanged).1 > 0.99);
}

#[test]
fn narrower_parts_beside_the_phase_function_are_close_to_the_product() {
    let mixture = mixture();
    for (wo, g) in [(Vec3A::Z, 0.0), (Vec3A::X, 0.6), (Vec3A::X, -0.6), (Vec3A::Y, 0.9), (Vec3A::Z, -0.9)] {
        let phase = |d: Vec3A| hg(-f64::from(wo.dot(d)), g.into());
        let (narrow, share) = mixture.narrower_than_hg(wo, g, unchanged);
        let share = f64::from(share.min(0.75));
        let beside = |d: Vec3A| share * f64::from(narrow.pdf(d)) + (1.0 - share) * phase(d);
        let (_, variance) = integral_and_variance(phase, beside);
        let (_, alone) = integral_and_variance(phase, phase);
        let product = mixture.product_with_hg(wo, g).0;
        let (_, half) = integral_and_variance(phase, |d| 0.5 * (f64::from(product.pdf(d)) + phase(d)));
        assert!(
            variance < alone && variance < half + 0.1,
            "g = {g}: {variance}; {alone} alone, {half} halved"
        );
    }
}

#[test]
fn samples_of_products_follow_their_density() {
    for product in [mixture().product_with_cosine(Vec3A::X).0, mixture().product_with_hg(Vec3A::Y, 0.7).0] {
        let (n_z, n_phi, n) = (16, 16, 100_000);
        let mut rng = Pcg::new(&[41]);
        let mut counts = vec![0.0; n_z * n_phi];
        for _ in 0..n {
            let drawn = product.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
            counts[cell(drawn.direction, n_z, n_phi)] += 1.0;
        }
        // Each cell is integrated with 24² points.
        let mut expected = vec![0.0; n_z * n_phi];
        let fine = grid(24 * n_z, 24 * n_phi);
        let scale = f64::from(n) * 4.0 * std::f64::consts::PI / fine.len() as f64;
        fine.iter().for_each(|&d| expected[cell(d, n_z, n_phi)] += scale * f64::from(product.pdf(d)));
        let p = chi_square_p_value(&counts, &expected);
        assert!(p > 1e-3, "{p}");
    }
}

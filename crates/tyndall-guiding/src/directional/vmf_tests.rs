//! Normalisation, moments, inverse, sampling and products against quadrature and closed forms.

use super::super::test_support::{chi_square_p_value, grid, integrate_sphere};
use super::*;
use proptest::prelude::*;
use std::f64::consts::PI;
use tyndall_math::random::Pcg;

const KAPPAS: [f32; 10] = [0.0, 1e-7, 1e-4, 0.05, 0.5, 3.0, 20.0, 700.0, 2e4, MAX_CONCENTRATION];

/// ∫ f(h) p(h) dΩ over the lobe, h = 1 - cosθ, in f64, on a grid that follows the lobe.
fn integrate_lobe(lobe: &VmfLobe, f: impl Fn(f64) -> f64) -> f64 {
    let kappa = f64::from(lobe.kappa());
    let end = if kappa > 20.0 { 40.0 / kappa } else { 2.0 };
    let n = 20_000;
    let h = |i: usize| (i as f64 + 0.5) / n as f64 * end;
    (0..n).map(|i| f(h(i)) * f64::from(lobe.peak()) * (-kappa * h(i)).exp()).sum::<f64>() * 2.0 * PI * end
        / n as f64
}

#[test]
fn published_values() {
    let lobe = VmfLobe::new(Vec3A::Z, 20.0);
    assert!((lobe.peak() - 3.183_098_9).abs() < 1e-6);
    assert!((mean_cosine(20.0) - 0.95).abs() < 1e-6);
    assert!((VmfLobe::new(Vec3A::Z, 0.0).pdf(Vec3A::X) - INV_4PI).abs() < 1e-8);
}

#[test]
fn lobes_integrate_to_one_and_have_their_mean_cosine() {
    for kappa in KAPPAS {
        let lobe = VmfLobe::new(Vec3A::Z, kappa);
        assert!((integrate_lobe(&lobe, |_| 1.0) - 1.0).abs() < 1e-5, "κ = {kappa}");
        let cosine = integrate_lobe(&lobe, |h| 1.0 - h);
        assert!((cosine - f64::from(mean_cosine(kappa))).abs() < 1e-5, "κ = {kappa}");
    }
}

#[test]
fn the_inverse_inverts() {
    for i in 0..=2000 {
        let kappa = 10f32.powf(-4.0 + 9.4 * i as f32 / 2000.0).min(MAX_CONCENTRATION);
        // The mean cosine as an f32 determines κ only to κ · 6e-8 relative.
        let tolerance = 1e-5 + kappa * 2e-7;
        let back = concentration_from_mean_cosine(mean_cosine(kappa));
        assert!((back / kappa - 1.0).abs() < tolerance, "{kappa} became {back}");
    }
    for (r, kappa) in
        [(0.0, 0.0), (-1.0, 0.0), (f32::NAN, 0.0), (1.0, MAX_CONCENTRATION), (7.0, MAX_CONCENTRATION)]
    {
        assert_eq!(concentration_from_mean_cosine(r), kappa);
    }
}

#[test]
fn samples_follow_the_density() {
    for (i, kappa) in KAPPAS.into_iter().enumerate() {
        let mean = Vec3A::new(0.3, -0.8, -0.52).normalize();
        let lobe = VmfLobe::new(mean, kappa);
        let frame = Frame::from_normal(mean);
        let mut rng = Pcg::new(&[11, i as u64]);
        let (n_theta, n_phi, n) = (16, 8, 64_000);
        let mut counts = vec![0.0; n_theta * n_phi];
        for _ in 0..n {
            let d = lobe.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
            assert!((d.length() - 1.0).abs() < 1e-5);
            // The cumulative distribution makes every ring equally likely.
            let h = f64::from(one_minus_cos(mean, d));
            let k = f64::from(kappa);
            let cdf = if k < 1e-3 { 0.5 * h } else { (-k * h).exp_m1() / (-2.0 * k).exp_m1() };
            let local = frame.local_from_world(d);
            let phi = (f64::from(local.y).atan2(f64::from(local.x)) / (2.0 * PI) + 1.0).fract();
            let ring = ((cdf * n_theta as f64) as usize).min(n_theta - 1);
            counts[ring * n_phi + ((phi * n_phi as f64) as usize).min(n_phi - 1)] += 1.0;
        }
        let expected = vec![f64::from(n) / counts.len() as f64; counts.len()];
        let p = chi_square_p_value(&counts, &expected);
        // Ten fixed-seed tests: one in a thousand would fail by chance with an unlucky seed.
        assert!(p > 1e-4, "κ = {kappa}: p = {p}");
    }
}

#[test]
fn the_corners_of_the_square_are_finite() {
    for kappa in KAPPAS {
        let lobe = VmfLobe::new(Vec3A::NEG_Z, kappa);
        for u in [Vec2::ZERO, Vec2::splat(0.999_999_94), Vec2::new(0.999_999_94, 0.0)] {
            let d = lobe.sample(u);
            assert!((d.length() - 1.0).abs() < 1e-5 && lobe.pdf(d).is_finite(), "κ = {kappa}, u = {u}");
        }
    }
    assert_eq!(VmfLobe::new(Vec3A::Z, f32::NAN).kappa(), 0.0);
    assert_eq!(VmfLobe::new(Vec3A::Z, f32::INFINITY).kappa(), MAX_CONCENTRATION);
}

#[test]
fn sharp_lobes_are_precise_near_their_peak() {
    // At 1 - cosθ = 1/κ the density is the peak over e; cosθ in f32 would be wrong by two per cent.
    let lobe = VmfLobe::new(Vec3A::Z, MAX_CONCENTRATION);
    let h = 1.0 / f64::from(MAX_CONCENTRATION);
    let sin = (h * (2.0 - h)).sqrt();
    let ratio = lobe.pdf(Vec3A::new(sin as f32, 0.0, (1.0 - h) as f32)) / lobe.peak();
    assert!((ratio * std::f32::consts::E - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn products_integrate_and_are_proportional() {
    let directions = grid(60, 120);
    for (k1, k2, angle) in
        [(0.0, 0.0, 1.0f32), (2.0, 5.0, 0.7), (10.0, 10.0, 3.0), (1.0, 0.0, 2.0), (30.0, 8.0, 0.1)]
    {
        let a = VmfLobe::new(Vec3A::Z, k1);
        let b = VmfLobe::new(Vec3A::new(angle.sin(), 0.0, angle.cos()), k2);
        let (lobe, integral) = a.product(&b);
        let reference = integrate_sphere(|d| f64::from(a.pdf(d)) * f64::from(b.pdf(d)));
        assert!((f64::from(integral) / reference - 1.0).abs() < 2e-3, "{integral} not {reference}");
        for &d in &directions {
            let (left, right) = (a.pdf(d) * b.pdf(d), integral * lobe.pdf(d));
            assert!((left - right).abs() <= 1e-4 * left.abs().max(right.abs()), "at {d}");
        }
    }
    // Equal sharp lobes: ∫ p² = κ/4π.
    let sharp = VmfLobe::new(Vec3A::X, 1e5);
    assert!((sharp.product(&sharp).1 / (1e5 * INV_4PI) - 1.0).abs() < 1e-4);
}

proptest! {
    #[test]
    fn nothing_is_ever_not_finite(k1 in any::<f32>(), k2 in any::<f32>(), x in -1f32..1.0, y in -1f32..1.0) {
        let d = Vec3A::new(x, y, 0.3).normalize();
        let (a, b) = (VmfLobe::new(Vec3A::Z, k1), VmfLobe::new(d, k2));
        let (lobe, integral) = a.product(&b);
        prop_assert!(integral.is_finite() && integral >= 0.0);
        prop_assert!((lobe.mean().length() - 1.0).abs() < 1e-4);
        prop_assert!(lobe.pdf(d).is_finite() && lobe.sample(Vec2::splat(0.3)).is_finite());
        prop_assert!((0.0..=1.0).contains(&mean_cosine(k1)) || k1.is_nan());
    }
}

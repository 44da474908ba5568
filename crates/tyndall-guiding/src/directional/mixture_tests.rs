//! Density and sampling of mixtures.

use super::super::test_support::{cell, chi_square_p_value, grid, integrate_sphere};
use super::*;
use proptest::prelude::*;
use tyndall_math::random::Pcg;

fn three_lobes() -> VmfMixture {
    VmfMixture::from_lobes([
        (3.0, VmfLobe::new(Vec3A::new(0.6, 0.0, 0.8), 40.0)),
        (1.0, VmfLobe::new(Vec3A::NEG_Y, 4.0)),
        (1.0, VmfLobe::new(Vec3A::NEG_Z, 0.0)),
    ])
}

#[test]
fn density_is_the_weighted_sum_and_integrates_to_one() {
    for mixture in [three_lobes(), VmfMixture::spread(8), VmfMixture::spread(0), VmfMixture::spread(99)] {
        assert!((integrate_sphere(|d| f64::from(mixture.pdf(d))) - 1.0).abs() < 1e-3);
        for d in grid(8, 8) {
            let sum: f32 = mixture.lobes().map(|(w, lobe)| w * lobe.pdf(d)).sum();
            let sum = if mixture.is_empty() { INV_4PI } else { sum };
            assert!((mixture.pdf(d) - sum).abs() <= 1e-5 * sum);
        }
    }
    assert_eq!(VmfMixture::spread(99).len(), MAX_LOBES);
    assert!((three_lobes().lobe(0).0 - 0.6).abs() < 1e-7);
}

#[test]
fn a_new_mixture_is_about_uniform() {
    let mixture = VmfMixture::with_background(MAX_LOBES);
    for d in grid(20, 20) {
        assert!((0.45..1.5).contains(&(mixture.pdf(d) / INV_4PI)), "{}", mixture.pdf(d) / INV_4PI);
    }
}

#[test]
fn samples_follow_the_density() {
    for (seed, mixture) in
        [three_lobes(), VmfMixture::spread(8), VmfMixture::spread(0)].into_iter().enumerate()
    {
        let (n_z, n_phi, fine, n) = (16, 24, 8, 200_000);
        let mut expected = vec![0.0; n_z * n_phi];
        let cells = grid(n_z * fine, n_phi * fine);
        for &d in &cells {
            expected[cell(d, n_z, n_phi)] +=
                f64::from(n) * f64::from(mixture.pdf(d)) * 4.0 * std::f64::consts::PI / cells.len() as f64;
        }
        let mut rng = Pcg::new(&[12, seed as u64]);
        let mut counts = vec![0.0; n_z * n_phi];
        for _ in 0..n {
            let s = mixture.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
            assert!((s.pdf / mixture.pdf(s.direction) - 1.0).abs() < 1e-6);
            counts[cell(s.direction, n_z, n_phi)] += 1.0;
        }
        let p = chi_square_p_value(&counts, &expected);
        assert!(p > 1e-4, "mixture {seed}: p = {p}");
    }
}

#[test]
fn useless_weights_are_left_out() {
    let lobe = VmfLobe::new(Vec3A::X, 3.0);
    let weights = [0.0, -1.0, f32::NAN, f32::INFINITY, 3e38, 3e38];
    let mixture = VmfMixture::from_lobes(weights.map(|w| (w, lobe)));
    assert_eq!(mixture.len(), 2);
    assert!((mixture.lobe(1).0 - 0.5).abs() < 1e-7);
}

proptest! {
    #[test]
    fn any_mixture_samples_finite_directions(
        lobes in prop::collection::vec((any::<f32>(), any::<f32>(), -1f32..1.0, -1f32..1.0), 0..40),
        x in 0f32..1.0, y in 0f32..1.0,
    ) {
        let lobe = |&(w, kappa, a, b): &(f32, f32, f32, f32)| {
            (w, VmfLobe::new(Vec3A::new(a, b, 0.5).normalize(), kappa))
        };
        let s = VmfMixture::from_lobes(lobes.iter().map(lobe)).sample(Vec2::new(x, y));
        prop_assert!((s.direction.length() - 1.0).abs() < 1e-4 && s.pdf.is_finite() && s.pdf >= 0.0);
    }
}

//! Known mixtures are found again from samples and from weights.

use super::super::VmfLobe;
use super::super::test_support::integrate_sphere;
use super::*;
use glam::{Vec2, Vec3A};
use proptest::prelude::*;
use tyndall_math::random::Pcg;
use tyndall_math::{INV_4PI, sampling::uniform_sphere};

fn truth() -> VmfMixture {
    VmfMixture::from_lobes([
        (0.5, VmfLobe::new(Vec3A::new(0.0, 0.6, 0.8), 60.0)),
        (0.3, VmfLobe::new(Vec3A::NEG_X, 15.0)),
        (0.2, VmfLobe::new(Vec3A::new(0.6, 0.0, -0.8), 200.0)),
    ])
}

fn u2(rng: &mut Pcg) -> Vec2 {
    Vec2::new(rng.next_f32(), rng.next_f32())
}

/// Samples drawn from the mixture itself.
fn drawn(mixture: &VmfMixture, n: usize) -> Vec<DirectionSample> {
    let mut rng = Pcg::new(&[21]);
    (0..n)
        .map(|_| DirectionSample {
            direction: mixture.sample(u2(&mut rng)).direction,
            weight: 1.0,
            inverse_distance: 0.0,
        })
        .collect()
}

/// Uniform samples weighted by the mixture's density.
fn weighted(mixture: &VmfMixture, n: usize) -> Vec<DirectionSample> {
    let mut rng = Pcg::new(&[22]);
    let sample = |_| {
        let direction = uniform_sphere(u2(&mut rng));
        DirectionSample { direction, weight: mixture.pdf(direction) / INV_4PI, inverse_distance: 0.0 }
    };
    (0..n).map(sample).collect()
}

#[test]
fn the_narrowest_lobes_are_recovered_and_stay_finite() {
    for kappa in [2e3, 3e4, 3e5] {
        let mean = Vec3A::new(0.48, -0.6, 0.64);
        let sharp =
            VmfMixture::from_lobes([(0.7, VmfLobe::new(mean, kappa)), (0.3, VmfLobe::new(Vec3A::X, 2.0))]);
        let samples = drawn(&sharp, 20_000);
        let start = [
            (0.5, VmfLobe::new((mean + Vec3A::splat(0.02)).normalize(), 300.0)),
            (0.5, VmfLobe::new(Vec3A::X, 5.0)),
        ];
        let mut fitted = VmfMixture::from_lobes(start);
        for _ in 0..40 {
            fitted = SufficientStatistics::from_samples(&fitted, &samples).maximise(&fitted);
        }
        let (weight, lobe) = fitted.lobe(0);
        assert!((weight - 0.7).abs() < 0.02, "κ = {kappa}: weight {weight}");
        assert!(
            (lobe.mean() - mean).length() < 4.0 / (kappa * 14_000.0).sqrt() + 1e-6,
            "κ = {kappa}: {}",
            lobe.mean()
        );
        // 1/κ is one less the mean cosine. The prior adds 0.2 of 14,000 samples that point nowhere; sums in f32 know the
        // rest to 1e-5, which is a factor of two for the narrowest lobe.
        let expected = 1.0 / kappa + 0.2 / 14_000.0;
        let found = 1.0 / lobe.kappa();
        assert!((found - expected).abs() < 1.2e-5 + 0.05 * expected, "κ = {kappa}: {found} for {expected}");
        assert!(fitted.pdf(mean).is_finite() && fitted.pdf(-mean) > 0.0);
    }
}

/// A start near the truth: one broad lobe per true one.
fn near() -> VmfMixture {
    let truth = truth();
    let lobes = truth
        .lobes()
        .map(|(_, lobe)| (1.0, VmfLobe::new((lobe.mean() + Vec3A::new(0.2, -0.2, 0.1)).normalize(), 5.0)));
    VmfMixture::from_lobes(lobes)
}

/// Kullback–Leibler divergence of `fitted` from the truth, in nats.
fn divergence(fitted: &VmfMixture) -> f64 {
    let truth = truth();
    integrate_sphere(|d| {
        let (p, q) = (f64::from(truth.pdf(d)), f64::from(fitted.pdf(d)));
        if p > 1e-12 { p * (p / q.max(1e-30)).ln() } else { 0.0 }
    })
}

#[test]
fn the_parameters_of_three_lobes_are_recovered() {
    for samples in [drawn(&truth(), 30_000), weighted(&truth(), 200_000)] {
        let mut mixture = near();
        // Two fits: the second polishes past the stopping tolerance.
        fit(&mut mixture, &samples);
        for _ in 0..20 {
            mixture = SufficientStatistics::from_samples(&mixture, &samples).maximise(&mixture);
        }
        for ((w, lobe), (true_w, true_lobe)) in mixture.lobes().zip(truth().lobes()) {
            assert!((w - true_w).abs() < 0.01, "weight {w} for {true_w}");
            assert!(lobe.mean().dot(true_lobe.mean()) > 0.9995, "{:?}", lobe.mean());
            assert!(
                (lobe.kappa() / true_lobe.kappa() - 1.0).abs() < 0.05,
                "κ {} for {}",
                lobe.kappa(),
                true_lobe.kappa()
            );
        }
        assert!(divergence(&mixture) < 2e-3, "{}", divergence(&mixture));
    }
}

#[test]
fn a_spread_mixture_finds_the_shape() {
    let samples = drawn(&truth(), 30_000);
    let mut mixture = VmfMixture::spread(8);
    let before = divergence(&mixture);
    let report = fit(&mut mixture, &samples);
    assert!(report.converged && report.n_iterations < MAX_ITERATIONS, "{report:?}");
    assert!(before > 1.0 && divergence(&mixture) < 0.05, "{before} -> {}", divergence(&mixture));
    assert_eq!(mixture.len(), 8);
}

#[test]
fn the_likelihood_never_falls() {
    let samples = weighted(&truth(), 20_000);
    let mut mixture = VmfMixture::spread(8);
    let mut before = f32::NEG_INFINITY;
    for _ in 0..30 {
        let statistics = SufficientStatistics::from_samples(&mixture, &samples);
        let now = statistics.mean_log_likelihood();
        // The priors of 8 lobes may cost a little of what they add to.
        assert!(now > before - 1e-3, "{now} after {before}");
        before = now;
        mixture = statistics.maximise(&mixture);
    }
}

#[test]
fn radiance_has_no_unit() {
    let samples = weighted(&truth(), 5000);
    let scaled: Vec<_> =
        samples.iter().map(|s| DirectionSample { weight: s.weight * 1024.0, ..*s }).collect();
    let start = VmfMixture::spread(8);
    let one_step = |s: &[DirectionSample]| SufficientStatistics::from_samples(&start, s).maximise(&start);
    assert_eq!(one_step(&samples), one_step(&scaled), "a power of two changes no rounding");
}

#[test]
fn statistics_of_parts_add_up() {
    let samples = drawn(&truth(), 3 * 4096);
    let start = VmfMixture::spread(8);
    let whole = SufficientStatistics::from_samples(&start, &samples);
    let mut parts = SufficientStatistics::default();
    for part in samples.chunks(4096) {
        parts.merge(&SufficientStatistics::from_samples(&start, part));
    }
    assert_eq!(whole, parts);
    assert_eq!(whole.n_samples(), 3.0 * 4096.0);

    let mut decayed = whole.clone();
    decayed.decay(0.25);
    assert_eq!(decayed.n_samples(), whole.n_samples() / 4.0);
    let (a, b) = (whole.maximise(&start), decayed.maximise(&start));
    for ((wa, la), (wb, lb)) in a.lobes().zip(b.lobes()) {
        assert!((wa - wb).abs() < 1e-3 && (la.kappa() / lb.kappa() - 1.0).abs() < 0.05);
    }
}

#[test]
fn without_samples_nothing_changes_and_one_sample_is_doubted() {
    let start = VmfMixture::spread(4);
    let mut mixture = start.clone();
    let useless = [f32::NAN, 0.0, -1.0, f32::INFINITY]
        .map(|weight| DirectionSample { direction: Vec3A::X, weight, inverse_distance: 0.0 })
        .into_iter()
        .chain([DirectionSample { direction: Vec3A::NAN, weight: 1.0, inverse_distance: 0.0 }])
        .collect::<Vec<_>>();
    let report = fit(&mut mixture, &useless);
    assert_eq!((&mixture, report.n_iterations), (&start, 1));

    fit(&mut mixture, &[DirectionSample { direction: Vec3A::X, weight: 3.0, inverse_distance: 0.0 }]);
    let sharpest = mixture.lobes().map(|(_, lobe)| lobe.kappa()).fold(0.0, f32::max);
    // One sample against a fiftieth of one: eight degrees.
    assert!((sharpest - 51.0).abs() < 0.1, "{sharpest}");
}

#[test]
fn samples_far_from_every_lobe_are_not_lost() {
    let sharp =
        VmfMixture::from_lobes([(1.0, VmfLobe::new(Vec3A::Z, 3.2e5)), (1.0, VmfLobe::new(Vec3A::X, 3.2e5))]);
    let far = DirectionSample {
        direction: Vec3A::new(-0.1, 0.0, -1.0).normalize(),
        weight: 1.0,
        inverse_distance: 0.0,
    };
    let statistics = SufficientStatistics::from_samples(&sharp, &[far]);
    assert_eq!(statistics.n_samples(), 1.0);
    assert!(statistics.maximise(&sharp).pdf(far.direction) > 0.0);
}

proptest! {
    #[test]
    fn a_fit_is_always_a_distribution(
        samples in prop::collection::vec((-1f32..1.0, -1f32..1.0, any::<f32>()), 0..60), n in 0usize..33,
    ) {
        let samples: Vec<_> = samples
            .into_iter()
            .map(|(x, y, weight)| DirectionSample { direction: Vec3A::new(x, y, 0.1).normalize(), weight, inverse_distance: 0.0 })
            .collect();
        let mut mixture = VmfMixture::spread(n);
        let report = fit(&mut mixture, &samples);
        prop_assert!(report.n_iterations <= MAX_ITERATIONS);
        let total: f32 = mixture.lobes().map(|(w, _)| w).sum();
        prop_assert!(mixture.is_empty() || (total - 1.0).abs() < 1e-5);
        prop_assert!(mixture.lobes().all(|(_, l)| l.kappa().is_finite() && (l.mean().length() - 1.0).abs() < 1e-4));
    }
}

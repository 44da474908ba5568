//! Every phase function: normalised, sampled as evaluated, mean cosine g, alive at the extremes.

use super::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use tyndall_math::random::Pcg;

const GS: [f32; 14] =
    [0.0, 1e-9, -1e-9, 1e-4, -1e-4, 0.1, -0.3, 0.5, 0.8, -0.9, 0.99, 0.999, -0.999, 0.99999];

fn all() -> Vec<Phase> {
    let lobes = GS.iter().map(|&g| Phase::HenyeyGreenstein { g });
    lobes.chain([Phase::Isotropic]).collect()
}

fn mixes() -> Vec<PhaseMix> {
    let hg = |g| Phase::HenyeyGreenstein { g };
    vec![
        PhaseMix::new([(1.0, hg(0.8)), (3.0, Phase::Isotropic)]).unwrap(),
        PhaseMix::new([(1e-3, hg(0.9)), (2.0, hg(-0.5)), (1.0, hg(0.2)), (0.5, Phase::Isotropic)]).unwrap(),
    ]
}

/// Probability of cos_theta in [a, b], by the midpoint rule in f64.
fn probability(eval: &dyn Fn(f32) -> f32, a: f64, b: f64) -> f64 {
    let n = 20_000;
    (0..n)
        .map(|i| {
            let mu = a + (b - a) * (f64::from(i) + 0.5) / f64::from(n);
            f64::from(eval(mu as f32)) * std::f64::consts::TAU * (b - a) / f64::from(n)
        })
        .sum()
}

fn chi_square(name: &str, sample: &dyn Fn(Vec2) -> PhaseSample, eval: &dyn Fn(f32) -> f32, travel: Vec3A) {
    let frame = Frame::from_normal(travel);
    let (n, n_cos, n_phi) = (200_000, 20usize, 8usize);
    let mut counts = vec![0f64; n_cos * n_phi];
    let mut rng = Pcg::new(&[11]);
    for _ in 0..n {
        let s = sample(Vec2::new(rng.next_f32(), rng.next_f32()));
        assert!((s.direction.length() - 1.0).abs() < 1e-5);
        assert!(s.value == s.pdf && s.pdf.is_finite() && s.pdf > 0.0);
        let local = frame.local_from_world(s.direction);
        let row = ((f64::from(local.z) + 1.0) / 2.0 * n_cos as f64) as usize;
        let turn = f64::from(local.y).atan2(f64::from(local.x)) / std::f64::consts::TAU + 0.5;
        counts[row.min(n_cos - 1) * n_phi + ((turn * n_phi as f64) as usize).min(n_phi - 1)] += 1.0;
    }
    let (mut statistic, mut cells) = (0.0, 0.0);
    let (mut rare_count, mut rare_expected) = (0.0, 0.0);
    for row in 0..n_cos {
        let edge = |i: usize| -1.0 + 2.0 * i as f64 / n_cos as f64;
        let expected = f64::from(n) * probability(eval, edge(row), edge(row + 1)) / n_phi as f64;
        for count in &counts[row * n_phi..(row + 1) * n_phi] {
            if expected > 5.0 {
                statistic += (count - expected).powi(2) / expected;
                cells += 1.0;
            } else {
                rare_count += count;
                rare_expected += expected;
            }
        }
    }
    if rare_expected > 5.0 {
        statistic += (rare_count - rare_expected).powi(2) / rare_expected;
        cells += 1.0;
    }
    let p = 1.0 - ChiSquared::new(cells - 1.0).unwrap().cdf(statistic);
    assert!(p > 1e-4, "{name}: chi^2 {statistic} in {cells} cells, p = {p}");
}

#[test]
fn sampling_follows_the_density() {
    for travel in [Vec3A::Z, Vec3A::NEG_Z, Vec3A::new(0.48, -0.6, 0.64)] {
        for phase in all().into_iter().filter(|phase| phase.mean_cosine().abs() < 0.985) {
            let eval = |mu: f32| phase.eval(mu);
            chi_square(&format!("{phase:?}"), &|u| phase.sample(travel, u), &eval, travel);
        }
        for mix in mixes() {
            chi_square(&format!("{mix:?}"), &|u| mix.sample(travel, u), &|mu| mix.eval(mu), travel);
        }
    }
}

#[test]
fn integrates_to_one() {
    for phase in all() {
        // Integrate over log(c + d), d the width of the peak, c = 1 - |cos| towards the lobe.
        let g = phase.mean_cosine();
        let d = f64::from((1.0 - g.abs()).powi(2));
        let (lo, hi) = (d.ln(), (2.0 + d).ln());
        let n = 100_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let e = (lo + (hi - lo) * (f64::from(i) + 0.5) / f64::from(n)).exp();
                let c = (e - d) as f32;
                let one_minus_cos = if g < 0.0 { 2.0 - c } else { c };
                let value = match phase {
                    Phase::Isotropic => phase.eval(1.0 - c),
                    Phase::HenyeyGreenstein { g } if g < 0.0 => henyey_greenstein::eval(-g, c),
                    Phase::HenyeyGreenstein { g } => henyey_greenstein::eval(g, one_minus_cos),
                };
                f64::from(value) * e * std::f64::consts::TAU * (hi - lo) / f64::from(n)
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-4, "{phase:?} integrates to {sum}");
    }
}

#[test]
fn mean_cosine_is_g() {
    for phase in all() {
        // Strata in u.x rather than random numbers: the tails of narrow lobes are rare and decide the mean.
        let (travel, n) = (Vec3A::new(0.6, 0.0, -0.8), 1 << 22);
        let cosine = |i: u32| {
            let u = Vec2::new((i as f32 + 0.5) / n as f32, (i % 97) as f32 / 97.0);
            f64::from(phase.sample(travel, u).direction.dot(travel))
        };
        let mean = (0..n).map(cosine).sum::<f64>() / f64::from(n);
        let g = f64::from(phase.mean_cosine());
        assert!((mean - g).abs() < 0.05 * (1.0 - g.abs()).min(2e-5) + 1e-6, "{phase:?}: {mean}");
    }
}

#[test]
fn values_of_samples_match_evaluation_between_directions() {
    let mut rng = Pcg::new(&[13]);
    for phase in all() {
        // Unit vectors are rounded to 6e-8; the narrowest lobe (1e-5 wide) changes by a few per cent over that.
        let tolerance = if phase.mean_cosine().abs() > 0.9999 { 0.1 } else { 2e-3 };
        for _ in 0..1000 {
            let s = phase.sample(Vec3A::X, Vec2::new(rng.next_f32(), rng.next_f32()));
            let again = phase.eval_between(Vec3A::X, s.direction);
            assert!((again / s.value - 1.0).abs() < tolerance, "{phase:?}: {again} for {}", s.value);
        }
    }
}

#[test]
fn extremes_are_finite_and_clamped() {
    for g in [1.0, -1.0, 2.0, -7.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let phase = Phase::HenyeyGreenstein { g };
        assert!(phase.mean_cosine().abs() <= henyey_greenstein::G_MAX);
        for mu in [-1.0, -0.5, 0.0, 1.0, 1.000_001] {
            assert!(phase.eval(mu).is_finite() && phase.eval(mu) >= 0.0);
        }
        for u in [Vec2::ZERO, Vec2::splat(0.999_999_9), Vec2::splat(0.5)] {
            let s = phase.sample(Vec3A::Y, u);
            assert!(s.direction.is_finite() && s.pdf.is_finite() && s.pdf > 0.0);
        }
    }
    assert!(Phase::HenyeyGreenstein { g: 0.9 }.eval(1.0) > Phase::HenyeyGreenstein { g: 0.9 }.eval(-1.0));
}

#[test]
fn near_isotropic_is_isotropic() {
    for g in [1e-9, 0.0] {
        let phase = Phase::HenyeyGreenstein { g };
        let u = Vec2::new(0.3, 0.7);
        let (a, b) = (phase.sample(Vec3A::Z, u), Phase::Isotropic.sample(Vec3A::Z, u));
        assert!((a.direction.z - b.direction.z).abs() < 1e-6 && (a.pdf / b.pdf - 1.0).abs() < 1e-6);
    }
}

#[test]
fn mixtures_merge_and_refuse_what_they_cannot_hold() {
    let hg = |g| Phase::HenyeyGreenstein { g };
    let mix =
        PhaseMix::new([(1.0, hg(0.5)), (0.0, hg(0.1)), (2.0, hg(0.5)), (1.0, Phase::Isotropic)]).unwrap();
    assert_eq!(mix.lobes(), &[(0.75, hg(0.5)), (0.25, Phase::Isotropic)]);
    assert!((mix.mean_cosine() - 0.375).abs() < 1e-6);
    assert!(PhaseMix::new((0..5).map(|i| (1.0, hg(0.1 * i as f32)))).is_none());
    assert!(PhaseMix::new([(0.0, Phase::Isotropic)]).is_none());
    assert!(PhaseMix::new([]).is_none());
}

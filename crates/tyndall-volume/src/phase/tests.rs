//! Every phase function: normalised, sampled as evaluated, mean cosine g, alive at the extremes.

use super::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use tyndall_math::random::Pcg;

const GS: [f32; 14] =
    [0.0, 1e-9, -1e-9, 1e-4, -1e-4, 0.1, -0.3, 0.5, 0.8, -0.9, 0.99, 0.999, -0.999, 0.99999];

/// Cosine-squared strengths of Draine's function.
const ALPHAS: [f32; 5] = [0.0, 1e-6, 1.0, 30.0, 250.0];

const ISOTROPIC: Phase = Phase::Isotropic(Isotropic);

fn all() -> Vec<Phase> {
    let lobes = GS.iter().map(|&g| Phase::henyey_greenstein(g));
    let draine = GS.iter().flat_map(|&g| ALPHAS.map(|alpha| Draine { g, alpha }.into()));
    lobes.chain([Isotropic.into(), Rayleigh.into()]).chain(draine).collect()
}

/// The g that decides how narrow the peak is.
fn peak(phase: Phase) -> f32 {
    match phase {
        Phase::Isotropic(_) | Phase::Rayleigh(_) => 0.0,
        Phase::HenyeyGreenstein(HenyeyGreenstein { g }) | Phase::Draine(Draine { g, .. }) => g,
    }
}

/// The function with before and after turned round, so that its peak is forward.
fn turned_forward(phase: Phase) -> Phase {
    match phase {
        Phase::HenyeyGreenstein(HenyeyGreenstein { g }) => Phase::henyey_greenstein(g.abs()),
        Phase::Draine(Draine { g, alpha }) => Draine { g: g.abs(), alpha }.into(),
        symmetric => symmetric,
    }
}

fn mixes() -> Vec<PhaseMix> {
    let hg = Phase::henyey_greenstein;
    vec![
        PhaseMix::new([(1.0, hg(0.8)), (3.0, ISOTROPIC)]).unwrap(),
        PhaseMix::new([(1e-3, hg(0.9)), (2.0, hg(-0.5)), (1.0, hg(0.2)), (0.5, ISOTROPIC)]).unwrap(),
        PhaseMix::two_lobes(0.7, -0.3, 0.2),
        PhaseMix::droplets(0.05),
        PhaseMix::droplets(1.0),
        PhaseMix::droplets(3.0),
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
        for phase in all().into_iter().filter(|&phase| peak(phase).abs() < 0.985) {
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
        // Integrate over log(c + d), d the width of the peak.
        let phase = turned_forward(phase);
        let d = f64::from((1.0 - peak(phase)).powi(2));
        let (lo, hi) = (d.ln(), (2.0 + d).ln());
        let n = 100_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let e = (lo + (hi - lo) * (f64::from(i) + 0.5) / f64::from(n)).exp();
                let value = phase.eval_one_minus_cos((e - d) as f32);
                f64::from(value) * e * std::f64::consts::TAU * (hi - lo) / f64::from(n)
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-4, "{phase:?} integrates to {sum}");
    }
}

#[test]
fn the_mean_cosine_is_that_of_the_samples() {
    for phase in all() {
        // Strata in u.x rather than random numbers: the tails of narrow lobes are rare and decide the mean.
        let (travel, n) = (Vec3A::new(0.6, 0.0, -0.8), 1 << 20);
        let cosine = |i: u32| {
            let u = Vec2::new((i as f32 + 0.5) / n as f32, (i % 97) as f32 / 97.0);
            f64::from(phase.sample(travel, u).direction.dot(travel))
        };
        let mean = (0..n).map(cosine).sum::<f64>() / f64::from(n);
        let g = f64::from(phase.mean_cosine());
        assert!((mean - g).abs() < 0.05 * (1.0 - g.abs()).min(2e-5) + 1e-6, "{phase:?}: {mean} for {g}");
    }
}

#[test]
fn values_of_samples_match_evaluation_between_directions() {
    let mut rng = Pcg::new(&[13]);
    for phase in all() {
        // Unit vectors are rounded to 6e-8; the narrowest lobe (1e-5 wide) changes by a few per cent over that.
        let tolerance = if peak(phase).abs() > 0.9999 { 0.1 } else { 2e-3 };
        for _ in 0..1000 {
            let s = phase.sample(Vec3A::X, Vec2::new(rng.next_f32(), rng.next_f32()));
            let again = phase.eval_between(Vec3A::X, s.direction);
            assert!((again / s.value - 1.0).abs() < tolerance, "{phase:?}: {again} for {}", s.value);
        }
    }
}

#[test]
fn extremes_are_finite_and_clamped() {
    let wild = [1.0, -1.0, 2.0, -7.0, 0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let lobes = wild.map(Phase::henyey_greenstein);
    let draine = wild.iter().flat_map(|&g| wild.map(|alpha| Phase::from(Draine { g, alpha })));
    for phase in lobes.into_iter().chain(draine).chain(wild.map(|d| PhaseMix::droplets(d).lobes()[0].1)) {
        assert!(phase.mean_cosine().abs() <= 1.0);
        for mu in [-1.0, -0.5, 0.0, 1.0, 1.000_001] {
            assert!(phase.eval(mu).is_finite() && phase.eval(mu) >= 0.0);
        }
        for u in [Vec2::ZERO, Vec2::splat(0.999_999_9), Vec2::splat(0.5)] {
            let s = phase.sample(Vec3A::Y, u);
            assert!(s.direction.is_finite() && s.pdf.is_finite() && s.pdf > 0.0);
        }
    }
    assert!(Phase::henyey_greenstein(0.9).eval(1.0) > Phase::henyey_greenstein(0.9).eval(-1.0));
}

#[test]
fn near_isotropic_is_isotropic() {
    for g in [1e-9, 0.0] {
        let phase = Phase::henyey_greenstein(g);
        let u = Vec2::new(0.3, 0.7);
        let (a, b) = (phase.sample(Vec3A::Z, u), ISOTROPIC.sample(Vec3A::Z, u));
        assert!((a.direction.z - b.direction.z).abs() < 1e-6 && (a.pdf / b.pdf - 1.0).abs() < 1e-6);
    }
}

#[test]
fn mixtures_merge_and_refuse_what_they_cannot_hold() {
    let hg = Phase::henyey_greenstein;
    let mix = PhaseMix::new([(1.0, hg(0.5)), (0.0, hg(0.1)), (2.0, hg(0.5)), (1.0, ISOTROPIC)]).unwrap();
    assert_eq!(mix.lobes(), &[(0.75, hg(0.5)), (0.25, ISOTROPIC)]);
    assert!((mix.mean_cosine() - 0.375).abs() < 1e-6);
    assert!(PhaseMix::new((0..5).map(|i| (1.0, hg(0.1 * i as f32)))).is_none());
    assert!(PhaseMix::new([(0.0, ISOTROPIC)]).is_none());
    assert!(PhaseMix::new([]).is_none());
}

#[test]
fn limits_of_draine_are_the_others() {
    for cos in [-1.0, -0.3, 0.0, 0.7, 1.0] {
        let eval = |g, alpha| Phase::from(Draine { g, alpha }).eval(cos);
        assert!((eval(0.6, 0.0) / Phase::henyey_greenstein(0.6).eval(cos) - 1.0).abs() < 1e-6);
        assert!((eval(0.0, 1.0) / Phase::from(Rayleigh).eval(cos) - 1.0).abs() < 1e-6);
        assert!((eval(0.0, 0.0) / ISOTROPIC.eval(cos) - 1.0).abs() < 1e-6);
    }
}

/// A droplet's peak is resolved: half of its light lies within a degree or two.
#[test]
fn the_peak_of_large_droplets_survives_single_precision() {
    let mix = PhaseMix::droplets(MAX_DROPLET_DIAMETER);
    let mut rng = Pcg::new(&[17]);
    let travel = Vec3A::new(0.48, -0.6, 0.64);
    let (n, mut within) = (200_000, 0u32);
    for _ in 0..n {
        let s = mix.sample(travel, Vec2::new(rng.next_f32(), rng.next_f32()));
        assert!((mix.eval_between(travel, s.direction) / s.value - 1.0).abs() < 1e-3);
        within += u32::from((s.direction - travel).length() < 0.02);
    }
    // The part within the cone, by quadrature over the chord.
    let steps = 200_000;
    let expected: f64 = (0..steps)
        .map(|i| {
            let chord = 0.02 * (f64::from(i) + 0.5) / f64::from(steps);
            let weighted = mix.lobes().iter().map(|(w, phase)| {
                f64::from(*w) * f64::from(phase.eval_one_minus_cos((0.5 * chord * chord) as f32))
            });
            weighted.sum::<f64>() * std::f64::consts::TAU * chord * 0.02 / f64::from(steps)
        })
        .sum();
    let error = (expected * (1.0 - expected) / f64::from(n)).sqrt();
    let found = f64::from(within) / f64::from(n);
    assert!((found - expected).abs() < 4.0 * error, "{found} within the cone, expected {expected}");
}

//! Closed forms and a one-dimensional tracker: density σ(t) on [0, 1] under a constant majorant.

use super::*;
use proptest::prelude::*;
use tyndall_math::random::Pcg;

/// What the toy tracker of one ray finds.
struct Candidates {
    w: f32,
    t_hat: f32,
    /// A candidate chosen with probability w_i/W.
    t: f32,
    depth: f32,
}

/// Resampled tracking on [0, 1], with the majorant scaled so that its depth is `depth`.
fn track(rng: &mut Pcg, sigma: impl Fn(f32) -> f32, depth: f32) -> Candidates {
    let (mut t, mut chosen, mut w, mut t_hat) = (0.0, 0.0, 0.0, 1.0f32);
    loop {
        t += rng.next_exponential() / depth;
        if t >= 1.0 {
            return Candidates { w, t_hat, t: chosen, depth };
        }
        let p = sigma(t) / depth;
        let w_i = t_hat * p;
        w += w_i;
        t_hat *= 1.0 - p;
        if w_i > 0.0 && rng.next_f32() * w < w_i {
            chosen = t;
        }
    }
}

struct Estimate {
    mean: f64,
    standard_error: f64,
}

impl Estimate {
    fn of(n: u32, mut sample: impl FnMut() -> f64) -> Self {
        let (mut sum, mut sum2) = (0.0, 0.0);
        for _ in 0..n {
            let x = sample();
            sum += x;
            sum2 += x * x;
        }
        let (n, mean) = (f64::from(n), sum / f64::from(n));
        Self { mean, standard_error: ((sum2 / n - mean * mean).max(0.0) / n).sqrt() }
    }

    /// Fixed seeds make this deterministic; four standard errors is the project's acceptance.
    fn assert_is(&self, expected: f64, what: &str) {
        let tolerance = 4.0 * self.standard_error + 1e-6;
        assert!((self.mean - expected).abs() < tolerance, "{what}: {} ± {}", self.mean, self.standard_error);
    }
}

/// Probability of the target form to scatter, averaged over candidates.
fn achieved(sigma: impl Fn(f32) -> f32 + Copy, majorant: f32, target: f32, alpha: f32) -> Estimate {
    let mut rng = Pcg::new(&[1, u64::from(target.to_bits()), u64::from(alpha.to_bits())]);
    let target = TargetProbability::new(target);
    let depth = headroom_depth(majorant, target.target());
    Estimate::of(400_000, || {
        let c = track(&mut rng, sigma, depth);
        f64::from(target.select_probability(c.w, c.t_hat, c.depth, alpha))
    })
}

#[test]
fn achieved_probabilities_match_the_closed_forms() {
    // α P* + (1-α)(1-T), T = e^{-1}.
    for (target, alpha, expected) in
        [(0.2, 1.0, 0.2), (0.2, 0.75, 0.308_030), (0.9, 0.75, 0.833_030), (0.05, 0.75, 0.195_530)]
    {
        achieved(|_| 1.0, 2.0, target, alpha).assert_is(expected, &format!("P* {target}, α {alpha}"));
    }
    // Empty second half: P*' (1 - e^{-1}), since candidates there have no weight.
    achieved(|t| if t < 0.5 { 1.0 } else { 0.0 }, 2.0, 0.5, 1.0).assert_is(0.365_529, "half empty");
    // Tight majorant: the first candidate absorbs everything, 1 - e^{-1} whatever the target.
    achieved(|_| 1.0, 1.0, 0.2, 1.0).assert_is(0.632_121, "tight majorant");
}

#[test]
fn every_probability_gives_the_same_mean() {
    // E[1_vol (W/P_v) t] = ∫ t e^{-t} dt and E[1_surf T̂/(1-P_v)] = e^{-1}, for σ = L = 1.
    let (volume, surface) = (0.264_241_1, (-1f64).exp());
    for alpha in [0.0, 0.75, 1.0] {
        for (i, p) in [1e-3f32, 0.03, 0.5, 0.9, 0.999].into_iter().enumerate() {
            for form in ["odds", "target"] {
                let mut rng = Pcg::new(&[2, i as u64, u64::from(form == "odds"), (alpha * 4.0) as u64]);
                let (odds, target) = (ScatteringOdds::new(p / (1.0 - p)), TargetProbability::new(p));
                let depth = headroom_depth(2.0, p);
                let mut hits = Vec::new();
                let estimate = Estimate::of(300_000, || {
                    let c = track(&mut rng, |_| 1.0, depth);
                    let s = match form {
                        "odds" => odds.select(c.w, c.t_hat, alpha),
                        _ => target.select(c.w, c.t_hat, c.depth, alpha),
                    };
                    let scatter = rng.next_f32() < s.probability;
                    hits.push(if scatter { 0.0 } else { s.surface_weight });
                    if scatter { f64::from(s.volume_weight * c.t) } else { 0.0 }
                });
                let what = format!("{form} {p} α {alpha}");
                estimate.assert_is(volume, &format!("volume, {what}"));
                let mut hits = hits.into_iter();
                let n = hits.len() as u32;
                let surface_estimate = Estimate::of(n, || f64::from(hits.next().unwrap()));
                surface_estimate.assert_is(surface, &format!("surface, {what}"));
            }
        }
    }
}

#[test]
fn two_strategies_have_the_published_optimum() {
    // E[Lv²] = 2, E[Lv] = Ls = 1: variance E[Lv²]/P + Ls²/(1-P) - (E[Lv] + Ls)².
    let variance = |p: f64| 2.0 / p + 1.0 / (1.0 - p) - 4.0;
    let contribution = f64::from(optimal_probability(1.0, 1.0));
    let second_moment = f64::from(optimal_probability(2f32.sqrt(), 1.0));
    assert!((contribution - 0.5).abs() < 1e-6 && (variance(contribution) - 2.0).abs() < 1e-6);
    assert!((second_moment - 0.585_786_4).abs() < 1e-6);
    assert!((variance(second_moment) - 1.828_427_1).abs() < 1e-6);
    for p in [0.4, 0.55, 0.62, 0.8] {
        assert!(variance(p) > variance(second_moment));
    }
}

#[test]
fn the_right_odds_minimise_the_variance_of_a_segment() {
    // Second moment of W Lv / P_v or T̂ Ls / (1-P_v) given W, T̂: smallest where P_v follows the RMS ratio.
    let (w, t, lv, ls) = (0.3f32, 0.7f32, 5.0f32, 0.5f32);
    let second_moment = |kappa: f32| {
        let p = ScatteringOdds::new(kappa).select_probability(w, t, 1.0);
        (w * lv).powi(2) / p + (t * ls).powi(2) / (1.0 - p)
    };
    let best = second_moment(lv / ls);
    for kappa in [1e-3, 0.1, 1.0, 5.0, 9.0, 11.0, 30.0, 1e3] {
        assert!(second_moment(kappa) > best, "κ = {kappa}");
    }
}

#[test]
fn neutral_odds_are_delta_tracking_and_headroom_has_its_bounds() {
    let neutral = ScatteringOdds::default();
    for w in [0.01, 0.5, 0.99] {
        assert!((neutral.select_probability(w, 1.0 - w, 0.75) - w).abs() < 1e-6);
    }
    for depth in [0.0, -0.0, -1.0, f32::NAN, 1e-30] {
        assert_eq!(TargetProbability::new(0.2).compensated(depth), 0.999);
    }
    assert_eq!(headroom_depth(7.0, 0.5), 7.0);
    assert!((headroom_depth(0.0, 1.0) - 4.382_027).abs() < 1e-4);
    assert_eq!(headroom_depth(0.1, 0.0), 0.1);
    assert!((headroom_depth(0.0, 0.4) - std::f32::consts::LN_2).abs() < 1e-6);
    assert_eq!(neutral.predicted_probability(0.0, 0.0), 0.5);
    assert!((ScatteringOdds::new(3.0).predicted_probability(0.5, 0.5) - 0.75).abs() < 1e-6);
}

fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![any::<f32>(), 0f32..1.0, Just(0.0), Just(1.0), Just(f32::MIN_POSITIVE), Just(f32::NAN)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]
    #[test]
    fn no_input_loses_energy_or_is_not_finite(
        w in any_f32(), t in any_f32(), alpha in any_f32(), k in any_f32(), depth in any_f32(),
    ) {
        let odds = ScatteringOdds::new(k);
        prop_assert!((1e-3..=1e3).contains(&odds.kappa()));
        let target = TargetProbability::new(k);
        prop_assert!((1e-3..=0.999).contains(&target.target()));
        for s in [odds.select(w, t, alpha), target.select(w, t, depth, alpha)] {
            prop_assert!((0.0..=1.0).contains(&s.probability));
            prop_assert!(s.volume_weight.is_finite() && s.surface_weight.is_finite());
            prop_assert!(s.probability > 0.0 || w.is_nan() || w <= 0.0);
            prop_assert!(s.probability < 1.0 || t.is_nan() || t <= 0.0);
        }
        prop_assert!((0.0..=1.0).contains(&odds.predicted_probability(w, t)));
        prop_assert!((0.0..=1.0).contains(&optimal_probability(w, t)));
        prop_assert!(depth.is_nan() || headroom_depth(depth, k) >= depth);
        prop_assert!(!headroom_depth(depth, k).is_nan());
    }
}

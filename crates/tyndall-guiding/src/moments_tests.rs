//! κ is recovered under changing probabilities; sums behave as sums.

use super::*;
use proptest::prelude::*;
use tyndall_math::random::Pcg;

/// Segments with W uniform in [0.1, 0.6], RMS radiances `lv` and `ls`, chosen under `odds`.
fn teach(moments: &mut Moments, rng: &mut Pcg, n: u32, odds: ScatteringOdds, (lv, ls): (f32, f32)) {
    for _ in 0..n {
        let w = 0.1 + 0.5 * rng.next_f32();
        let s = odds.select(w, 1.0 - w, 0.75);
        let scatter = rng.next_f32() < s.probability;
        // Uniform in [0, √3 L] has RMS L.
        let noise = rng.next_f32() * 3f32.sqrt();
        let sample = SegmentSample {
            class: if scatter { EventClass::Volume } else { EventClass::Surface },
            value: noise * if scatter { lv * s.volume_weight } else { ls * s.surface_weight },
            probability: if scatter { s.probability } else { 1.0 - s.probability },
            w,
            t_hat: 1.0 - w,
            volume_depth: 2.0,
            surface_depth: 6.0,
        };
        moments.add(&sample, f32::INFINITY);
    }
}

#[test]
fn kappa_is_recovered_whatever_the_guide_was() {
    for (lv, ls) in [(1.0, 1.0), (10.0, 0.5), (0.02, 1.0)] {
        let mut rng = Pcg::new(&[3, (lv * 100.0) as u64]);
        let mut moments = Moments::default();
        for kappa in [1.0, 0.01, 50.0, 3.0] {
            teach(&mut moments, &mut rng, 50_000, ScatteringOdds::new(kappa), (lv, ls));
        }
        let (estimate, truth) = (moments.odds().kappa(), lv / ls);
        assert!((estimate / truth - 1.0).abs() < 0.03, "{estimate} for {truth}");
        assert!((moments.mean_volume_depth().unwrap() - 2.0).abs() < 1e-2);
        assert!((moments.mean_surface_depth().unwrap() - 6.0).abs() < 3e-2);
        let p = moments.odds().predicted_probability(moments.w, moments.t);
        assert!((p - truth * 0.35 / (truth * 0.35 + 0.65)).abs() < 0.01, "{p}");
    }
}

#[test]
fn targets_follow_their_criteria() {
    let mut moments = Moments::default();
    teach(&mut moments, &mut Pcg::new(&[4]), 200_000, ScatteringOdds::default(), (4.0, 1.0));
    // E[W] = 0.35 and E[T̂] = 0.65 times the mean radiance, RMS √3/2.
    let contribution = 0.35 * 4.0 / (0.35 * 4.0 + 0.65);
    assert!((moments.contribution_target().unwrap() - contribution).abs() < 0.01);
    let (w2, t2) = (0.35f32.powi(2) + 0.25 / 12.0, 0.65f32.powi(2) + 0.25 / 12.0);
    let variance = 4.0 * w2.sqrt() / (4.0 * w2.sqrt() + t2.sqrt());
    assert!((moments.variance_target().unwrap() - variance).abs() < 0.01);
    assert_eq!(Moments::default().contribution_target(), None);
    assert_eq!(Moments::default().variance_target(), None);
}

#[test]
fn few_samples_stay_near_one_and_many_do_not() {
    let estimate = |n: u32| {
        let mut moments = Moments::default();
        teach(&mut moments, &mut Pcg::new(&[5]), n, ScatteringOdds::default(), (100.0, 1.0));
        moments.odds().kappa()
    };
    assert_eq!(estimate(0), 1.0);
    assert!((0.1..5.0).contains(&estimate(1)));
    assert!((90.0..110.0).contains(&estimate(10_000)));
    // Never seen in 12 samples: doubted, not excluded.
    let mut moments = Moments::default();
    for _ in 0..12 {
        let w = 0.5;
        let s = SegmentSample {
            class: EventClass::Surface,
            value: 1.0,
            probability: 0.5,
            w,
            t_hat: 1.0 - w,
            volume_depth: 0.0,
            surface_depth: f32::INFINITY,
        };
        moments.add(&s, f32::INFINITY);
    }
    assert!((0.3..0.5).contains(&moments.odds().kappa()), "{}", moments.odds().kappa());
    assert!((moments.mean_surface_depth().unwrap() / 1e9 - 1.0).abs() < 1e-6);
}

#[test]
fn outliers_are_cut_and_decay_keeps_estimates() {
    let mut moments = Moments::default();
    let mut rng = Pcg::new(&[6]);
    teach(&mut moments, &mut rng, 1000, ScatteringOdds::default(), (1.0, 1.0));
    let limit = moments.outlier_limit();
    assert!((3.0..30.0).contains(&limit), "{limit}");
    let firefly = SegmentSample {
        class: EventClass::Volume,
        value: 1e10,
        probability: 0.5,
        w: 0.3,
        t_hat: 0.7,
        volume_depth: 1.0,
        surface_depth: 1.0,
    };
    let before = moments.odds().kappa();
    let mut cut = moments;
    cut.add(&firefly, limit);
    assert!((cut.odds().kappa() / before - 1.0).abs() < 0.15);
    moments.add(&firefly, f32::INFINITY);
    assert!(moments.odds().kappa() > 100.0);

    let mut decayed = cut;
    decayed.decay(0.25);
    assert_eq!(decayed.n, cut.n * 0.25);
    assert!((decayed.odds().kappa() / cut.odds().kappa() - 1.0).abs() < 0.02);
    assert_eq!(Moments::default().outlier_limit(), f32::INFINITY);
    assert_eq!(size_of::<Moments>(), 44);
}

fn any_sample() -> impl Strategy<Value = SegmentSample> {
    let number = || prop_oneof![any::<f32>(), 0f32..1.0, Just(f32::NAN), Just(f32::INFINITY), Just(0.0)];
    (any::<bool>(), number(), number(), number(), number(), number(), number()).prop_map(
        |(volume, value, probability, w, t_hat, volume_depth, surface_depth)| SegmentSample {
            class: if volume { EventClass::Volume } else { EventClass::Surface },
            value,
            probability,
            w,
            t_hat,
            volume_depth,
            surface_depth,
        },
    )
}

proptest! {
    #[test]
    fn no_sample_spoils_the_sums(
        samples in prop::collection::vec(any_sample(), 0..40), limit in any::<f32>(), factor in any::<f32>(),
    ) {
        let mut moments = Moments::default();
        samples.iter().for_each(|s| moments.add(s, limit));
        moments.decay(factor);
        prop_assert!((1e-3..=1e3).contains(&moments.odds().kappa()));
        prop_assert!(moments.outlier_limit() > 0.0);
        for p in [moments.contribution_target(), moments.variance_target()].into_iter().flatten() {
            prop_assert!((0.0..=1.0).contains(&p));
        }
        for d in [moments.mean_volume_depth(), moments.mean_surface_depth()].into_iter().flatten() {
            prop_assert!((0.0..=1e9).contains(&d), "{d}");
        }
    }

    #[test]
    fn merging_is_addition(seed in any::<u64>()) {
        // Whole numbers below 2^24 add without rounding: merging is associative and commutative to the last bit.
        let mut rng = Pcg::new(&[seed]);
        let mut part = || {
            let mut v = || (rng.next_u32() % 1000) as f32;
            Moments { volume_x2: v(), volume_x: v(), surface_x2: v(), surface_x: v(), w2: v(), t2: v(), w: v(),
                t: v(), w_depth: v(), t_depth: v(), n: v() }
        };
        let (a, b, c) = (part(), part(), part());
        let merged = |x: Moments, y: Moments| { let mut m = x; m.merge(&y); m };
        prop_assert_eq!(merged(merged(a, b), c), merged(a, merged(b, c)));
        prop_assert_eq!(merged(a, b), merged(b, a));
    }
}

//! Odds by cost, candidates enough, and nothing absurd.

use super::*;
use crate::{EventClass, SegmentSample};
use tyndall_math::random::Pcg;

const EQUAL_COSTS: ClassCosts = ClassCosts { volume: (300, 100), surface: (300, 100) };

/// Segments of W = `w` whose classes have these mean radiances, with noise of `spread` times the mean.
fn moments(w: f32, lv: f32, ls: f32, spread: f32) -> Moments {
    let mut rng = Pcg::new(&[8]);
    let mut moments = Moments::default();
    for _ in 0..20_000 {
        let scatter = rng.next_f32() < w;
        let noise = 1.0 + spread * (2.0 * rng.next_f32() - 1.0) * 3f32.sqrt();
        moments.add(
            &SegmentSample {
                class: if scatter { EventClass::Volume } else { EventClass::Surface },
                value: (noise * if scatter { lv } else { ls }).max(0.0),
                probability: if scatter { w } else { 1.0 - w },
                w,
                t_hat: 1.0 - w,
                volume_depth: 1.0,
                surface_depth: 2.0,
            },
            f32::INFINITY,
        );
    }
    moments
}

#[test]
fn dear_paths_are_chosen_less() {
    let moments = moments(0.3, 2.0, 1.0, 0.5);
    let p = |volume: u64, surface: u64| {
        let costs = ClassCosts { volume: (volume * 100, 100), surface: (surface * 100, 100) };
        SegmentGuide::of_pixel(&moments, Strategy::Odds, &costs).select_probability(0.3, 0.7, 1.0)
    };
    assert!(p(9, 1) < p(3, 3) && p(3, 3) < p(1, 9));
    // κ = 2 divided by the root of 16 / 4.
    let kappa = ScatteringOdds::new(2.0 * (4f32 / 16.0).sqrt());
    assert!((p(15, 3) - kappa.select_probability(0.3, 0.7, 0.75)).abs() < 0.01);
}

#[test]
fn thin_media_get_candidates_enough() {
    for (w, lv) in [(0.01f32, 1000.0), (0.2, 30.0), (0.9, 1.0)] {
        let guide = SegmentGuide::of_pixel(&moments(w, lv, 1.0, 0.1), Strategy::Odds, &EQUAL_COSTS);
        let depth = -(1.0 - w).ln() * guide.majorant_scale();
        let wanted = ScatteringOdds::new(lv).predicted_probability(w, 1.0 - w);
        assert!(depth >= -(1.0 - wanted.min(0.79) / 0.8).ln() * 0.9, "{w}: depth {depth} for {wanted}");
        assert!((SLACK..=MAX_SCALE).contains(&guide.majorant_scale()));
    }
}

#[test]
fn any_sums_give_probabilities_inside() {
    let absurd = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-30, 1e30];
    for a in absurd {
        for b in absurd {
            let moments =
                Moments { volume_x2: a, w2: b, surface_x2: b, t2: a, w: b, t: a, n: b, ..Moments::default() };
            for strategy in [Strategy::Odds, Strategy::Target] {
                let guide = SegmentGuide::of_pixel(&moments, strategy, &ClassCosts::default());
                let p = guide.select_probability(0.3, 0.7, 2.0);
                assert!(p > 0.0 && p < 1.0, "{p} of {moments:?}");
                assert!((1.0..=MAX_SCALE).contains(&guide.majorant_scale()) && guide.faint() <= FAINT);
            }
        }
    }
}

#[test]
fn normalised_flights_aim_at_the_same_probability_and_never_lower_it() {
    // Scattered light is twice as bright as the surface, and a quarter of the segments scatter by themselves.
    let one = Moments { volume_x2: 4.0, volume_x: 2.0, w: 1.0, w2: 1.0, n: 1.0, ..Moments::default() };
    let other = Moments { surface_x2: 3.0, surface_x: 3.0, t: 3.0, t2: 3.0, n: 3.0, ..Moments::default() };
    let mut moments = Moments::default();
    for _ in 0..1000 {
        moments.merge(&one);
        moments.merge(&other);
    }
    let guide_of = |strategy| SegmentGuide::of_pixel(&moments, strategy, &ClassCosts::default());
    assert_eq!(guide_of(Strategy::Target).normalized_flights(), None);
    assert_eq!(SegmentGuide::default().normalized_flights(), None);
    let nds = guide_of(Strategy::Normalized).normalized_flights().unwrap();
    // κW̄/(κW̄+T̄) with κ = 2.
    assert!((nds.target - 0.4).abs() < 1e-3, "{nds:?}");
    assert_eq!(nds.exponent, 1.0);
    let plus = guide_of(Strategy::NormalizedPlus);
    let flights = plus.normalized_flights().unwrap();
    assert_eq!(flights.target, nds.target);
    assert!((flights.exponent - 1.0 / 1.75).abs() < 1e-6, "{flights:?}");
    assert_eq!(plus.majorant_scale(), 1.0);
    // In closed form: the target where tracking is below it, tracking where it is above.
    let probability = |w: f32| plus.select_probability(w, 1.0 - w, f32::INFINITY);
    assert!((probability(0.2) - (0.75 * flights.target + 0.25 * 0.2)).abs() < 1e-6);
    assert!((probability(0.9) - 0.9).abs() < 1e-6);
    assert_eq!((probability(0.0), probability(1.0)), (0.0, 1.0));
}

#[test]
fn further_segments_choose_where_that_pays() {
    let further = FurtherSegments::new(Strategy::Odds, &EQUAL_COSTS);
    let chooses = |w, lv, ls| further.guide(&moments(w, lv, ls, 0.3)).is_some();
    assert!(!chooses(0.3, 1.0, 1.0), "both are as bright");
    assert!(!chooses(1.0, 1.0, 1.0), "nothing passes");
    assert!(!chooses(0.0, 1.0, 1.0), "nothing scatters");
    assert!(chooses(0.1, 10.0, 0.1), "thin mist before darkness");
    assert!(chooses(0.95, 0.1, 10.0), "a lamp behind smoke");
    assert!(further.guide(&Moments::default()).is_none(), "nothing is known");
}

#[test]
fn pixels_walk_to_all_candidates_where_that_pays() {
    let walks = |strategy, w, lv, ls| {
        SegmentGuide::of_pixel(&moments(w, lv, ls, 0.3), strategy, &EQUAL_COSTS).is_worth_walking()
    };
    assert!(!walks(Strategy::Odds, 0.9, 1.0, 1.0), "both are as noisy");
    assert!(walks(Strategy::Odds, 0.1, 10.0, 0.1), "thin mist before darkness");
    assert!(walks(Strategy::Target, 0.9, 1.0, 1.0), "the paper's strategies always choose");
    assert!(!SegmentGuide::default().is_worth_walking(), "nothing is known");
}

//! A synthetic image is learned pass by pass.

use super::*;
use crate::{EventClass, SegmentSample};
use tyndall_math::random::Pcg;

const SIZES: [(usize, usize); 4] = [(1, 1), (1, 77), (77, 1), (24, 16)];

/// One pass of `spp` samples a pixel: W = 0.3, volume `lv(x)` and surface 1, guided by the frozen `guide`.
fn pass(
    guide: &ImageGuide,
    spp: u32,
    number: u64,
    lv: impl Fn(usize) -> f32,
    surface_depth: impl Fn(usize) -> f32,
) -> Vec<Moments> {
    let mut moments = vec![Moments::default(); guide.width() * guide.height()];
    for (i, sum) in moments.iter_mut().enumerate() {
        let (x, y) = (i % guide.width(), i / guide.width());
        let told = guide.lookup(x as i32 + guide.origin[0], y as i32 + guide.origin[1]);
        let mut rng = Pcg::new(&[number, i as u64]);
        for _ in 0..spp {
            let p = told.select_probability(0.3, 0.7, f32::INFINITY);
            let scatter = rng.next_f32() < p;
            let noise = rng.next_f32() * 3f32.sqrt();
            let value = noise * if scatter { 0.3 / p * lv(x) } else { 0.7 / (1.0 - p) };
            let sample = SegmentSample {
                class: if scatter { EventClass::Volume } else { EventClass::Surface },
                value,
                probability: if scatter { p } else { 1.0 - p },
                w: 0.3,
                t_hat: 0.7,
                volume_depth: 1.0,
                surface_depth: surface_depth(x),
            };
            sum.add(&sample, told.outlier_limit());
        }
    }
    moments
}

/// κ of P_v = α κW/(κW+T̂) + (1-α) W/(W+T̂).
fn kappa(guide: &SegmentGuide) -> f32 {
    let guided = (guide.select_probability(0.3, 0.7, f32::INFINITY) - 0.25 * 0.3) / 0.75;
    guided * 0.7 / (0.3 * (1.0 - guided))
}

#[test]
fn passes_learn_the_odds_at_any_size() {
    for (w, h) in SIZES {
        let mut guide = ImageGuide::new([-3, 5], w, h, Strategy::Odds);
        assert_eq!(guide.lookup(-3, 5), SegmentGuide::default());
        for (number, spp) in [1, 1, 2, 4, 8, 16, 32, 64, 128].into_iter().enumerate() {
            let new = pass(&guide, spp, number as u64, |_| 6.0, |_| 2.0);
            guide.learn(&new, &ClassCosts::default()).unwrap();
        }
        let told = guide.lookup(-3, 5);
        assert!((kappa(&told) / 6.0 - 1.0).abs() < 0.25, "{w}x{h}: κ = {}", kappa(&told));
        assert!(told.outlier_limit().is_finite());
        for (x, y) in [(-4, 5), (-3, 4), (-3 + w as i32, 5), (-3, 5 + h as i32), (i32::MIN, i32::MAX)] {
            assert_eq!(guide.lookup(x, y), SegmentGuide::default());
        }
    }
}

#[test]
fn edges_of_depth_separate_the_odds() {
    let (w, h) = (24, 16);
    let mut guide = ImageGuide::new([0, 0], w, h, Strategy::Odds);
    let lv = |x: usize| if x < 12 { 0.05 } else { 20.0 };
    for number in 0..6 {
        let new = pass(&guide, 8, number, lv, |x| if x < 12 { 3.0 } else { 9.0 });
        guide.learn(&new, &ClassCosts::default()).unwrap();
    }
    let (left, right) = (kappa(&guide.lookup(11, 8)), kappa(&guide.lookup(12, 8)));
    assert!((0.035..0.1).contains(&left) && (12.0..30.0).contains(&right), "{left} {right}");
}

#[test]
fn learning_is_deterministic_and_checked() {
    let learned = || {
        let mut guide = ImageGuide::new([0, 0], 7, 5, Strategy::Odds);
        for number in 0..3 {
            let new = pass(&guide, 4, number, |x| x as f32, |_| 2.0);
            guide.learn(&new, &ClassCosts::default()).unwrap();
        }
        guide
    };
    let mut guide = learned();
    assert_eq!(guide, learned());
    assert!(guide.learn(&[Moments::default(); 34], &ClassCosts::default()).is_err());
    assert_eq!(guide, learned());
    guide.decay(0.25);
    assert_eq!(guide.moments()[0].n, 3.0);
    ImageGuide::new([0, 0], 0, 9, Strategy::Odds).learn(&[], &ClassCosts::default()).unwrap();
}

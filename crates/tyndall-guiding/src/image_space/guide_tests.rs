//! A synthetic image is learned pass by pass.

use super::*;
use crate::{EventClass, SegmentSample};
use tyndall_math::random::Pcg;

const SIZES: [(usize, usize); 4] = [(1, 1), (1, 77), (77, 1), (24, 16)];

/// One pass of `spp` samples a pixel: W = 0.3, volume `lv(x)` and surface 1, guided by the frozen `guide`.
fn pass(guide: &ImageGuide, spp: u32, number: u64, lv: impl Fn(usize) -> f32) -> Vec<Moments> {
    let mut moments = vec![Moments::default(); guide.width() * guide.height()];
    for (i, sum) in moments.iter_mut().enumerate() {
        let (x, y) = (i % guide.width(), i / guide.width());
        let told = guide.lookup(x as i32 + guide.origin[0], y as i32 + guide.origin[1]);
        let mut rng = Pcg::new(&[number, i as u64]);
        for _ in 0..spp {
            let s = told.odds.select(0.3, 0.7, 0.75);
            let scatter = rng.next_f32() < s.probability;
            let noise = rng.next_f32() * 3f32.sqrt();
            let value = noise * if scatter { s.volume_weight * lv(x) } else { s.surface_weight };
            let sample = SegmentSample {
                class: if scatter { EventClass::Volume } else { EventClass::Surface },
                value,
                probability: if scatter { s.probability } else { 1.0 - s.probability },
                w: 0.3,
                t_hat: 0.7,
                volume_depth: 1.0,
                surface_depth: 2.0,
            };
            sum.add(&sample, told.outlier_limit);
        }
    }
    moments
}

#[test]
fn passes_learn_the_odds_at_any_size() {
    for (w, h) in SIZES {
        let mut guide = ImageGuide::new([-3, 5], w, h);
        assert_eq!(guide.lookup(-3, 5), PixelGuide::default());
        for (number, spp) in [1, 1, 2, 4, 8, 16, 32, 64, 128].into_iter().enumerate() {
            let new = pass(&guide, spp, number as u64, |_| 6.0);
            guide.learn(&new, None).unwrap();
        }
        let told = guide.lookup(-3, 5);
        assert!((told.odds.kappa() / 6.0 - 1.0).abs() < 0.25, "{w}x{h}: κ = {}", told.odds.kappa());
        assert!((told.predicted - 6.0 * 0.3 / (6.0 * 0.3 + 0.7)).abs() < 0.06);
        assert!(told.outlier_limit.is_finite());
        for (x, y) in [(-4, 5), (-3, 4), (-3 + w as i32, 5), (-3, 5 + h as i32), (i32::MIN, i32::MAX)] {
            assert_eq!(guide.lookup(x, y), PixelGuide::default());
        }
    }
}

#[test]
fn edges_in_the_features_separate_the_odds() {
    let (w, h) = (24, 16);
    let mut guide = ImageGuide::new([0, 0], w, h);
    let lv = |x: usize| if x < 12 { 0.05 } else { 20.0 };
    let features: Vec<_> = (0..w * h)
        .map(|i| PixelFeatures { depth: if i % w < 12 { 3.0 } else { 9.0 }, normal: glam::Vec3::Z })
        .collect();
    for number in 0..6 {
        let new = pass(&guide, 8, number, lv);
        guide.learn(&new, Some(&features)).unwrap();
    }
    let (left, right) = (guide.lookup(11, 8).odds.kappa(), guide.lookup(12, 8).odds.kappa());
    assert!((0.035..0.1).contains(&left) && (12.0..30.0).contains(&right), "{left} {right}");
}

#[test]
fn learning_is_deterministic_and_checked() {
    let learned = || {
        let mut guide = ImageGuide::new([0, 0], 7, 5);
        for number in 0..3 {
            let new = pass(&guide, 4, number, |x| x as f32);
            guide.learn(&new, None).unwrap();
        }
        guide
    };
    let mut guide = learned();
    assert_eq!(guide, learned());
    assert!(guide.learn(&[Moments::default(); 34], None).is_err());
    assert_eq!(guide, learned());
    guide.decay(0.25);
    assert_eq!(guide.moments()[0].n, 3.0);
    ImageGuide::new([0, 0], 0, 9).learn(&[], None).unwrap();
}

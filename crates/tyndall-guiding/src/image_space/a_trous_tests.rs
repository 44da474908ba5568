//! Against a direct double loop, at edges, and split into rows.

use super::*;
use proptest::prelude::*;
use tyndall_math::random::Pcg;

fn noise(n: usize) -> Vec<Moments> {
    let mut rng = Pcg::new(&[9, n as u64]);
    (0..n)
        .map(|_| Moments { volume_x2: rng.next_f32(), w2: rng.next_f32(), n: 1.0, ..Default::default() })
        .collect()
}

#[test]
fn three_levels_equal_their_composed_kernel() {
    // An impulse in the middle spreads as the outer product of the composed one-dimensional kernel.
    let n = 41;
    let mut source = vec![Moments::default(); n * n];
    source[20 * n + 20].n = 1.0;
    let filtered = ATrous::new(n, n).filter(&source, None).unwrap();
    let mut kernel = vec![0.0f64; n];
    kernel[20] = 1.0;
    for level in 0..3 {
        let step = 1isize << level;
        let at = |k: &[f64], i: isize| usize::try_from(i).ok().and_then(|i| k.get(i).copied()).unwrap_or(0.0);
        kernel = (0..n as isize)
            .map(|i| {
                (-2..=2isize).map(|d| f64::from(TAPS[d.unsigned_abs()]) * at(&kernel, i + d * step)).sum()
            })
            .collect();
    }
    for y in 0..n {
        for x in 0..n {
            let expected = kernel[x] * kernel[y];
            assert!((f64::from(filtered[y * n + x].n) - expected).abs() < 1e-5 * (1.0 + expected), "{x} {y}");
        }
    }
    assert_eq!(filtered[20 * n + 5].n, 0.0, "reaches 14 pixels");
    assert!(filtered[20 * n + 6].n > 0.0);
}

#[test]
fn counts_grow_to_the_effective_number_of_pixels() {
    let source = vec![Moments { n: 1.0, ..Default::default() }; 64 * 64];
    let filtered = ATrous::new(64, 64).filter(&source, None).unwrap();
    assert!((filtered[32 * 64 + 32].n - (64f32 / 9.0).powi(3)).abs() < 0.1);
    assert!(filtered[0].n > 1.0 && filtered[0].n < filtered[32 * 64 + 32].n);
}

#[test]
fn edges_of_depth_and_normal_are_kept() {
    let (w, h) = (32, 8);
    let moments: Vec<_> = (0..w * h)
        .map(|i| Moments { volume_x2: if i % w < 16 { 1.0 } else { 100.0 }, n: 1.0, ..Default::default() })
        .collect();
    let left = PixelFeatures { depth: 10.0, normal: Vec3::X };
    for right in [
        PixelFeatures { depth: 25.0, normal: Vec3::X },
        PixelFeatures { depth: 10.0, normal: Vec3::Y },
        PixelFeatures { depth: f32::INFINITY, normal: Vec3::ZERO },
        PixelFeatures { depth: f32::NAN, normal: Vec3::NAN },
    ] {
        let features: Vec<_> = (0..w * h).map(|i| if i % w < 16 { left } else { right }).collect();
        let filtered = ATrous::new(w, h).filter(&moments, Some(&features)).unwrap();
        for (i, m) in filtered.iter().enumerate() {
            let expected = if i % w < 16 { 1.0 } else { 100.0 };
            assert!((m.volume_x2 / m.n / expected - 1.0).abs() < 1e-2, "pixel {i}, {right:?}");
        }
    }
    // A slanted floor and a curved wall are not edges.
    let ramp: Vec<_> = (0..w * h)
        .map(|i| PixelFeatures {
            depth: 10.0 + 0.05 * (i % w) as f32,
            normal: Vec3::new(1.0, 0.01 * (i % w) as f32, 0.0),
        })
        .collect();
    let filtered = ATrous::new(w, h).filter(&moments, Some(&ramp)).unwrap();
    assert!(filtered[4 * w + 8].n > 30.0);
}

#[test]
fn buffers_of_the_wrong_size_are_refused() {
    let filter = ATrous::new(3, 3);
    let error = filter.filter(&noise(8), None).unwrap_err();
    assert!(error.to_string().contains("8 entries, but the guide has 9 pixels"), "{error}");
    let features = [PixelFeatures { depth: 1.0, normal: Vec3::X }; 4];
    assert!(filter.filter(&noise(9), Some(&features)).is_err());
    assert!(ATrous::new(0, 5).filter(&[], None).unwrap().is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn rows_are_independent_and_weight_is_never_lost(w in 1usize..40, h in 1usize..40, cut in any::<prop::sample::Index>()) {
        let source = noise(w * h);
        let filter = ATrous::new(w, h);
        let (mut whole, mut parts) = (vec![Moments::default(); w * h], vec![Moments::default(); w * h]);
        let cut = cut.index(h);
        for level in 0..3 {
            filter.filter_rows(&source, None, level, 0..h, &mut whole);
            let (top, bottom) = parts.split_at_mut(cut * w);
            filter.filter_rows(&source, None, level, cut..h, bottom);
            filter.filter_rows(&source, None, level, 0..cut, top);
            prop_assert_eq!(&whole, &parts);
        }
        let filtered = filter.filter(&source, None).unwrap();
        prop_assert!(filtered.iter().zip(&source).all(|(f, s)| f.n >= s.n && f.volume_x2 >= s.volume_x2));
    }
}

//! Against a direct double loop, and at edges.

use super::*;
use proptest::prelude::*;
use tyndall_math::random::Pcg;

fn noise(n: usize) -> Vec<Moments> {
    let mut rng = Pcg::new(&[9, n as u64]);
    (0..n)
        .map(|_| Moments { volume_x2: rng.next_f32(), w2: rng.next_f32(), n: 1.0, ..Default::default() })
        .collect()
}

/// A pixel that sees a surface at `depth`.
fn at_depth(depth: f32, volume_x2: f32) -> Moments {
    Moments { volume_x2, t: 1.0, t_depth: depth, n: 1.0, ..Default::default() }
}

#[test]
fn three_levels_equal_their_composed_kernel() {
    // An impulse in the middle spreads as the outer product of the composed one-dimensional kernel.
    let n = 41;
    let mut source = vec![Moments::default(); n * n];
    source[20 * n + 20].n = 1.0;
    let filtered = filter(&source, n);
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
    let filtered = filter(&source, 64);
    assert!((filtered[32 * 64 + 32].n - (64f32 / 9.0).powi(3)).abs() < 0.1);
    assert!(filtered[0].n > 1.0 && filtered[0].n < filtered[32 * 64 + 32].n);
}

#[test]
fn edges_of_depth_are_kept() {
    let (w, h) = (32, 8);
    for right in [25.0, 4.0, 1e9] {
        let pixel = |i: usize| if i % w < 16 { at_depth(10.0, 1.0) } else { at_depth(right, 100.0) };
        let moments: Vec<_> = (0..w * h).map(pixel).collect();
        for (i, m) in filter(&moments, w).iter().enumerate() {
            let expected = if i % w < 16 { 1.0 } else { 100.0 };
            assert!((m.volume_x2 / m.n / expected - 1.0).abs() < 1e-5, "pixel {i}, depth {right}");
        }
    }
    // A slanted floor is not an edge.
    let ramp: Vec<_> = (0..w * h).map(|i| at_depth(10.0 + 0.05 * (i % w) as f32, 1.0)).collect();
    assert!(filter(&ramp, w)[4 * w + 8].n > 30.0);
}

#[test]
fn images_without_pixels_or_of_one_are_fine() {
    assert!(filter(&[], 0).is_empty() && filter(&[], 5).is_empty());
    assert_eq!(filter(&noise(1), 1), noise(1));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn weight_is_never_lost_and_rows_are_like_columns(w in 1usize..40, h in 1usize..40) {
        let source = noise(w * h);
        let filtered = filter(&source, w);
        prop_assert!(filtered.iter().zip(&source).all(|(f, s)| f.n >= s.n && f.volume_x2 >= s.volume_x2));
        let transposed: Vec<_> = (0..w * h).map(|i| source[i % h * w + i / h]).collect();
        let back = filter(&transposed, h);
        for (i, f) in filtered.iter().enumerate() {
            let other = back[i % w * h + i / w];
            prop_assert!((f.volume_x2 - other.volume_x2).abs() <= 1e-4 * f.volume_x2);
        }
    }
}

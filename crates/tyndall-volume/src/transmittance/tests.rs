//! Shadow rays against closed forms and ray marching.

use super::*;
use crate::grid::DenseGrid;
use crate::oracle;
use crate::testing::{
    RgbMean, albedo_tint, cloud, dye_tint, glow_tint, homogeneous, placement, relative_tint, with_grid,
};
use crate::{BrickGrid, SparseVoxels};
use glam::{Affine3A, IVec3, Vec3A};

fn span(t0: f32, t1: f32, medium: u32) -> Span {
    Span { t0: t0.into(), t1: t1.into(), medium }
}

fn along_x(t_max: f32) -> Ray {
    Ray { origin: Vec3A::ZERO, direction: Vec3A::X, t_max }
}

fn mean(media: &[Medium], spans: &[Span], ray: &Ray, n: u32) -> (RgbMean, WalkStats) {
    let (mut mean, mut stats) = (RgbMean::default(), WalkStats::default());
    let mut rng = Pcg::new(&[99]);
    for _ in 0..n {
        mean.add(transmittance(media, spans, ray, &mut rng, &mut stats));
    }
    assert_eq!(stats.majorant_violations, 0);
    (mean, stats)
}

#[test]
fn homogeneous_is_exact_over_24_decades() {
    let mut rng = Pcg::new(&[1]);
    for sigma in [1e-12f32, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6, 1e12] {
        for distance in [1e-6f32, 1e-3, 1.0, 1e3, 1e6] {
            let media = [homogeneous(Rgb::splat(0.25 * sigma), Rgb::splat(0.75 * sigma))];
            let spans = [span(0.0, f32::INFINITY, 0)];
            let got =
                transmittance(&media, &spans, &along_x(distance), &mut rng, &mut WalkStats::default()).x;
            let exact = (-f64::from(sigma) * f64::from(distance)).exp();
            // exp in f32 of an exponent with relative rounding 2^-23.
            let tolerance = 1e-6 * exact * (1.0 + f64::from(sigma) * f64::from(distance)) + 1e-38;
            assert!((f64::from(got) - exact).abs() <= tolerance, "{sigma} {distance}: {got} for {exact}");
        }
    }
}

#[test]
fn overlapping_homogeneous_media_multiply() {
    let media = [homogeneous(Rgb::new(0.5, 1.0, 0.0), Rgb::ZERO), homogeneous(Rgb::ZERO, Rgb::splat(1.3))];
    let spans = [span(0.0, 2.0, 1), span(1.0, 3.0, 0), span(5.0, 9.0, 0)];
    let got = transmittance(&media, &spans, &along_x(6.0), &mut Pcg::new(&[1]), &mut WalkStats::default());
    for (c, depth) in [2.6 + 1.5, 2.6 + 3.0, 2.6].into_iter().enumerate() {
        assert!((got[c] - (-depth as f32).exp()).abs() < 1e-7);
    }
}

#[test]
fn colours_that_vary_are_unbiased_per_channel() {
    for role in [albedo_tint, dye_tint, glow_tint, relative_tint] {
        let (medium, ray) = role();
        let media = [medium, homogeneous(Rgb::ZERO, Rgb::new(0.2, 0.1, 0.0))];
        let spans = [span(0.0, f32::INFINITY, 0), span(0.1, 0.7, 1)];
        let (mean, _) = mean(&media, &spans, &ray, 100_000);
        mean.assert_near(oracle::transmittance(&media, &spans, &ray, 60_000), "transmittance");
    }
}

#[test]
fn grids_are_unbiased_per_channel() {
    let (index_from_world, ray) = placement();
    for strength in [0.1, 1.0, 6.0] {
        let colour = Rgb::new(1.0, 0.4, 0.05) * strength;
        let medium =
            with_grid(homogeneous(0.3 * colour, 0.7 * colour), cloud(30.0).to_bricks(), index_from_world);
        let media = [medium, homogeneous(Rgb::splat(0.1), Rgb::ZERO)];
        let spans = [span(0.0, 50.0, 0), span(1.0, 2.0, 1), span(0.5, 4.0, 0)];
        let (mean, _) = mean(&media, &spans, &ray, 200_000);
        mean.assert_near(oracle::transmittance(&media, &spans, &ray, 100_000), "transmittance");
    }
}

/// algorithm.md §8: sigma = 2 exp(-t / .5) over 3 has transmittance .3687925.
#[test]
fn exponential_profile_on_a_fine_grid() {
    let step = 3.0 / 600.0;
    let dense = DenseGrid::from_fn(IVec3::new(-8, -16, -16), IVec3::new(640, 32, 32), |v| {
        2.0 * (-(v.x as f32) * step / 0.5).exp()
    });
    let index_from_world = Affine3A::from_scale(glam::Vec3::new(1.0 / step, 1.0, 1.0));
    let media =
        [with_grid(homogeneous(Rgb::splat(0.5), Rgb::splat(0.5)), dense.to_bricks(), index_from_world)];
    let (mean, stats) = mean(&media, &[span(0.0, 3.0, 0)], &along_x(3.0), 300_000);
    mean.assert_near([0.368_792_5; 3], "exponential profile");
    // Density falls by 8 % across a brick: the control is nearly all of it.
    assert!(stats.lookups < 100_000, "{}", stats.lookups);
}

#[test]
fn uniform_bricks_are_exact_and_free() {
    let values = [2f32; 512];
    let leaves = (0..36).map(|i| ([(i >> 2) * 8, (i >> 1 & 1) * 8, (i & 1) * 8], &values[..])).collect();
    let grid = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0;
    let media = [with_grid(homogeneous(Rgb::splat(0.01), Rgb::splat(0.02)), grid, Affine3A::IDENTITY)];
    let ray = Ray { origin: Vec3A::new(0.0, 3.0, 3.0), direction: Vec3A::X, t_max: 56.0 };
    let mut stats = WalkStats::default();
    let got = transmittance(&media, &[span(0.0, 56.0, 0)], &ray, &mut Pcg::new(&[1]), &mut stats);
    assert!((got.x / (-0.06f32 * 56.0).exp() - 1.0).abs() < 1e-4, "{got}");
    assert_eq!(stats.lookups, 0);
}

#[test]
fn dense_clouds_cost_few_lookups_and_stay_unbiased() {
    let (index_from_world, ray) = placement();
    let medium = with_grid(homogeneous(Rgb::ZERO, Rgb::splat(4.0)), cloud(1.0).to_bricks(), index_from_world);
    let (media, spans) = ([medium], [span(0.0, 50.0, 0)]);
    let (mean, stats) = mean(&media, &spans, &ray, 300_000);
    mean.assert_near(oracle::transmittance(&media, &spans, &ray, 100_000), "dense");
    assert!(stats.lookups < 300_000 * 12, "{} look-ups a ray", stats.lookups as f64 / 3e5);
}

#[test]
fn extremes_are_finite() {
    let (index_from_world, ray) = placement();
    let mut rng = Pcg::new(&[1]);
    for exponent in [-40, -12, -6, 0, 4, 8, 12, 20, 38] {
        let sigma = Rgb::new(1.0, 1e-6, 0.0) * 10f32.powi(exponent);
        let media = [with_grid(homogeneous(sigma, sigma), cloud(1e6).to_bricks(), index_from_world)];
        let (mut stats, n) = (WalkStats::default(), if exponent <= 4 { 100 } else { 20 });
        for _ in 0..n {
            let t = transmittance(&media, &[span(0.0, 50.0, 0)], &ray, &mut rng, &mut stats);
            assert!(t.is_finite() && t.min_element() >= 0.0);
        }
        // Entering a voxel whose density rises from 0 takes about the root of its optical depth.
        let limit = n * if exponent <= 4 { 2000 } else { 4 * u64::from(LONG_WALK) };
        assert!(stats.lookups < limit, "{} at 1e{exponent}", stats.lookups);
    }
}

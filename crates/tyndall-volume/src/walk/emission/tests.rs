//! Fire against quadrature and closed forms: in smoke, behind it, and where there is none.

use super::*;
use crate::grid::DenseGrid;
use crate::oracle;
use crate::testing::{RgbMean, cloud, homogeneous, placement, with_grid};
use crate::walk::sample_collision;
use crate::{BrickGrid, GridDensity};
use crate::{Emission, SparseVoxels};
use glam::{Affine3A, IVec3, Vec3, Vec3A};

const EVERYWHERE: [f32; 2] = [0.0, f32::INFINITY];

fn span([t0, t1]: [f32; 2], medium: u32) -> Span {
    Span { t0: t0.into(), t1: t1.into(), medium }
}

fn along_x(t_max: f32) -> Ray {
    Ray { origin: Vec3A::ZERO, direction: Vec3A::X, t_max }
}

/// A medium that only emits, by a grid of its own.
fn fire(emission: Emission, grid: BrickGrid, index_from_world: Affine3A) -> Medium {
    Medium { emission, ..with_grid(homogeneous(Rgb::ZERO, Rgb::ZERO), grid, index_from_world) }
}

/// A wrinkled sheet of hot gas, one or two voxels thin, across half of [`cloud`] and beyond its end.
fn flames() -> DenseGrid {
    DenseGrid::from_fn(IVec3::new(10, -4, -12), IVec3::new(48, 36, 30), |v| {
        let p = v.as_vec3();
        let d = (p.y - 9.0 - 3.0 * (0.3 * p.x).sin() * (0.2 * p.z).cos()).abs();
        if d < 1.5 { (1.5 - d) * (0.7 + 0.3 * (0.5 * p.x).cos()) } else { 0.0 }
    })
}

/// The mean emission of `n` walks, and what they cost.
fn mean(media: &[Medium], spans: &[Span], ray: &Ray, n: u32) -> (RgbMean, WalkStats) {
    let (mut mean, mut stats, mut rng) = (RgbMean::default(), WalkStats::default(), Pcg::new(&[2025]));
    for _ in 0..n {
        mean.add(sample_collision(media, spans, ray, Rgb::ONE, &mut rng, &mut stats).emission);
    }
    assert_eq!(stats.majorant_violations, 0);
    (mean, stats)
}

fn assert_unbiased(media: &[Medium], spans: &[Span], ray: &Ray, n: u32, what: &str) {
    let expected = oracle::march(media, spans, ray, 200_000, |_| 0.0).emission;
    assert!(expected.iter().any(|x| *x > 0.0), "{what}: the ray meets fire");
    mean(media, spans, ray, n).0.assert_near(expected, what);
}

#[test]
fn fire_of_another_grid_than_density_is_unbiased() {
    let (index_from_world, ray) = placement();
    // Elsewhere, turned and of another resolution.
    let flames_from_world =
        Affine3A::from_rotation_z(-0.05) * Affine3A::from_scale(Vec3::splat(1.1)) * index_from_world;
    let kinds = [
        Emission::Glow(Rgb::new(2.0, 1.0, 0.1)),
        Emission::Blackbody { kelvin: 1800.0, intensity: Rgb::new(1.0, 0.9, 0.8) },
    ];
    for (emission, strength) in
        [(kinds[0], 0.0), (kinds[0], 0.3), (kinds[1], 0.3), (kinds[0], 4.0), (kinds[1], 30.0)]
    {
        for colour in [Rgb::ONE, Rgb::new(1.0, 0.4, 0.05)] {
            let smoke = homogeneous(0.3 * strength * colour, 0.7 * strength * colour);
            let smoke = with_grid(smoke, cloud(3.0).to_bricks(), index_from_world);
            let media = [smoke, fire(emission, flames().to_bricks(), flames_from_world)];
            let spans = [span(EVERYWHERE, 0), span(EVERYWHERE, 1)];
            assert_unbiased(&media, &spans, &ray, 100_000, &format!("{emission:?} in {strength} {colour}"));
        }
    }
}

#[test]
fn fire_in_fog_and_behind_an_absorber_is_unbiased() {
    let (index_from_world, ray) = placement();
    let media = [
        fire(Emission::Glow(Rgb::new(1.0, 0.5, 0.2)), flames().to_bricks(), index_from_world),
        homogeneous(Rgb::splat(0.3), Rgb::new(0.1, 0.4, 0.9)),
        homogeneous(Rgb::new(0.5, 0.0, 1.0), Rgb::ZERO),
    ];
    let spans = [span(EVERYWHERE, 0), span(EVERYWHERE, 1), span([0.5, 2.0], 2)];
    assert_unbiased(&media, &spans, &ray, 100_000, "fog");
}

/// Smoke that glows by its own density, and uniform light inside smoke.
#[test]
fn glowing_smoke_is_unbiased() {
    let (index_from_world, ray) = placement();
    for strength in [0.1, 5.0, 100.0] {
        let smoke = with_grid(
            homogeneous(Rgb::splat(0.2 * strength), Rgb::splat(0.8 * strength)),
            cloud(20.0).to_bricks(),
            index_from_world,
        );
        let glowing = Medium { emission: Emission::Glow(Rgb::ONE), ..smoke.clone() };
        assert_unbiased(&[glowing], &[span(EVERYWHERE, 0)], &ray, 100_000, "glowing smoke");
        let light = Medium { emission: Emission::Glow(Rgb::ONE), ..homogeneous(Rgb::ZERO, Rgb::ZERO) };
        let spans = [span(EVERYWHERE, 0), span([0.2, 3.0], 1)];
        assert_unbiased(&[smoke, light], &spans, &ray, 100_000, "light in smoke");
    }
}

#[test]
fn a_uniform_fire_in_a_uniform_smoke_has_the_radiance_of_a_slab() {
    let values = [1f32; 512];
    let uniform = || {
        let leaves = (0..64).map(|i| ([(i & 3) * 8, (i >> 2 & 3) * 8, (i >> 4) * 8], &values[..])).collect();
        BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0
    };
    let ray = Ray { origin: Vec3A::new(2.0, 12.3, 9.1), direction: Vec3A::X, t_max: 20.0 };
    for sigma in [0.0f32, 0.01, 0.2, 3.0, 40.0] {
        let smoke = with_grid(homogeneous(Rgb::splat(sigma), Rgb::ZERO), uniform(), Affine3A::IDENTITY);
        let media = [smoke, fire(Emission::Glow(Rgb::splat(2.0)), uniform(), Affine3A::IDENTITY)];
        let (mean, _) = mean(&media, &[span(EVERYWHERE, 0), span(EVERYWHERE, 1)], &ray, 20_000);
        let tau = f64::from(sigma) * 20.0;
        let expected = if sigma > 0.0 { 2.0 * -(-tau).exp_m1() / f64::from(sigma) } else { 40.0 };
        mean.assert_near([expected; 3], &format!("slab of {sigma}"));
        assert!(sigma > 0.3 || mean.0[0].relative_variance() < 0.02, "{}", mean.0[0].relative_variance());
    }
}

/// A homogeneous hot gas has the light of Planck's law, in closed form.
#[test]
fn a_hot_slab_shines_by_its_temperature() {
    let emission = Emission::Blackbody { kelvin: 1500.0, intensity: Rgb::splat(3.0) };
    let gas = Medium { emission, ..homogeneous(Rgb::splat(0.7), Rgb::ZERO) };
    let mut rng = Pcg::new(&[1]);
    let walk = sample_collision(
        &[gas],
        &[span([0.0, 2.0], 0)],
        &along_x(2.0),
        Rgb::ONE,
        &mut rng,
        &mut WalkStats::default(),
    );
    let expected = 3.0 * tyndall_math::blackbody_radiance(1500.0) * (1.0 - (-1.4f32).exp()) / 0.7;
    assert!((walk.emission - expected).abs().max_element() < 1e-6 * expected.max_element());
}

/// What this module is for: few samples suffice for a thin flame, in clear air, behind and inside smoke.
#[test]
fn thin_flames_are_not_lost() {
    let (index_from_world, ray) = placement();
    for (strength, most) in [(0.0, 0.1), (0.3, 0.3), (3.0, 3.0)] {
        let smoke = homogeneous(Rgb::splat(0.2 * strength), Rgb::splat(0.8 * strength));
        let media = [
            with_grid(smoke, cloud(1.0).to_bricks(), index_from_world),
            fire(Emission::Glow(Rgb::ONE), flames().to_bricks(), index_from_world),
        ];
        let (mean, stats) = mean(&media, &[span(EVERYWHERE, 0), span(EVERYWHERE, 1)], &ray, 20_000);
        let variance = mean.0[0].relative_variance();
        assert!(variance < most, "relative variance {variance} in smoke of {strength}");
        assert!(stats.lookups < 100 * 20_000, "{} look-ups", stats.lookups / 20_000);
    }
}

#[test]
fn fire_costs_nothing_where_none_is() {
    let (index_from_world, ray) = placement();
    let smoke = with_grid(homogeneous(Rgb::ONE, Rgb::ONE), cloud(1.0).to_bricks(), index_from_world);
    let media = [smoke, fire(Emission::Glow(Rgb::ONE), flames().to_bricks(), index_from_world)];
    let (_, with) = mean(&media, &[span(EVERYWHERE, 0)], &ray, 1000);
    let (_, without) = mean(&media[..1], &[span(EVERYWHERE, 0)], &ray, 1000);
    assert_eq!(with, without, "a fire elsewhere");
}

#[test]
fn fire_in_anything_ends_in_time() {
    let (index_from_world, ray) = placement();
    for exponent in [-40, -6, 0, 3, 6, 12, 20, 38] {
        let sigma = 10f32.powi(exponent);
        for colour in [Rgb::ONE, Rgb::new(1.0, 1e-3, 1e-9), Rgb::new(0.0, 1.0, 0.5)] {
            let smoke = with_grid(
                homogeneous(sigma * colour, sigma * colour),
                cloud(1e6).to_bricks(),
                index_from_world,
            );
            let bricks = || flames().to_bricks();
            let media = [
                smoke,
                homogeneous(sigma * colour, sigma * colour),
                fire(Emission::Glow(Rgb::splat(f32::MAX)), bricks(), index_from_world),
                fire(
                    Emission::Blackbody { kelvin: 1e30, intensity: Rgb::splat(1e30) },
                    bricks(),
                    index_from_world,
                ),
                fire(
                    Emission::Blackbody { kelvin: f32::NAN, intensity: Rgb::ONE },
                    bricks(),
                    index_from_world,
                ),
            ];
            let spans = [0, 1, 2, 3, 4].map(|i| span(EVERYWHERE, i));
            for spans in [&spans[..], &spans[1..], &spans[2..3], &[spans[0], spans[2]]] {
                let (mut stats, mut rng) = (WalkStats::default(), Pcg::new(&[5]));
                for _ in 0..10 {
                    let walk = sample_collision(&media, spans, &ray, Rgb::ONE, &mut rng, &mut stats);
                    assert!(
                        walk.emission.is_finite() && walk.emission.min_element() >= 0.0,
                        "{}",
                        walk.emission
                    );
                }
                assert!(stats.candidates < 40 * u64::from(LONG_WALK), "{}", stats.candidates);
            }
        }
    }
}

/// A hole in a singular placement or an empty grid is no fire and no hang.
#[test]
fn absent_fire_is_dark() {
    let empty = || BrickGrid::build(&SparseVoxels::default()).0;
    let flat =
        GridDensity { grid: std::sync::Arc::new(flames().to_bricks()), index_from_world: Affine3A::ZERO };
    let singular =
        Medium { density: Some(flat), ..fire(Emission::Glow(Rgb::ONE), empty(), Affine3A::IDENTITY) };
    let media = [fire(Emission::Glow(Rgb::ONE), empty(), Affine3A::IDENTITY), singular];
    let (mean, _) = mean(&media, &[span(EVERYWHERE, 0), span(EVERYWHERE, 1)], &along_x(9.0), 10);
    assert_eq!(mean.0[0].value(), 0.0);
}

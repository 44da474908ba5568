//! Every walk against f64 quadrature, in standard errors.

use super::*;
use crate::grid::DenseGrid;
use crate::oracle;
use crate::testing::{
    Mean, RgbMean, albedo_tint, cloud, dye_tint, glow_tint, homogeneous, placement, relative_tint, with_grid,
};
use crate::{BrickGrid, Emission, Phase, SparseVoxels, Tint};
use glam::{Affine3A, IVec3, Vec3, Vec3A};

mod normalized;
mod resample;

const WHITE: Rgb = Rgb::ONE;

fn along_x(t_max: f32) -> Ray {
    Ray { origin: Vec3A::ZERO, direction: Vec3A::X, t_max }
}

fn span(t0: f32, t1: f32, medium: u32) -> Span {
    Span { t0: t0.into(), t1: t1.into(), medium }
}

/// Means over `n` walks: pass weight, scatter weight, scatter weight times t, emission.
#[derive(Default)]
struct Moments {
    pass: RgbMean,
    scatter: RgbMean,
    scatter_t: RgbMean,
    emission: RgbMean,
    stats: WalkStats,
}

fn moments(media: &[Medium], spans: &[Span], ray: &Ray, beta: Rgb, n: u32) -> Moments {
    moments_of(ray, n, |rng, stats| sample_collision(media, spans, ray, beta, rng, stats))
}

fn moments_of(ray: &Ray, n: u32, mut walk: impl FnMut(&mut Pcg, &mut WalkStats) -> Walk) -> Moments {
    let mut m = Moments::default();
    let mut rng = Pcg::new(&[2024, 7]);
    for _ in 0..n {
        let walk = walk(&mut rng, &mut m.stats);
        let (passed, scattered, t) = match walk.event {
            Event::Pass => (walk.weight, Rgb::ZERO, 0.0),
            Event::Scatter { t, .. } => (Rgb::ZERO, walk.weight, t as f32),
        };
        assert!((0.0..=ray.t_max).contains(&t));
        m.pass.add(passed);
        m.scatter.add(scattered);
        m.scatter_t.add(scattered * t);
        m.emission.add(walk.emission);
    }
    m
}

/// The walk's means agree with ray marching.
fn assert_unbiased(media: &[Medium], spans: &[Span], ray: &Ray, beta: Rgb, n: u32) -> Moments {
    let m = moments(media, spans, ray, beta, n);
    m.assert_matches(media, spans, ray);
    assert_eq!(m.stats.majorant_violations, 0);
    m
}

/// What ray marching finds.
struct Exact {
    sums: oracle::March,
    scattered_t: [f64; 3],
}

impl Exact {
    fn march(media: &[Medium], spans: &[Span], ray: &Ray) -> Self {
        const STEPS: u32 = 60_000;
        Self {
            sums: oracle::march(media, spans, ray, STEPS, |_| 1.0),
            scattered_t: oracle::march(media, spans, ray, STEPS, |t| t).scattered,
        }
    }
}

impl Moments {
    fn assert_matches(&self, media: &[Medium], spans: &[Span], ray: &Ray) {
        self.assert_near(&Exact::march(media, spans, ray));
    }

    fn assert_near(&self, exact: &Exact) {
        self.pass.assert_near(exact.sums.transmittance, "pass");
        self.scatter.assert_near(exact.sums.scattered, "scatter");
        self.emission.assert_near(exact.sums.emission, "emission");
        self.scatter_t.assert_near(exact.scattered_t, "scatter at t");
    }
}

fn emissive(medium: Medium, emission: Rgb) -> Medium {
    Medium { emission: Emission::Glow(emission), ..medium }
}

/// [`cloud`] in its sheared placement.
fn cloudy(sigma_a: Rgb, sigma_s: Rgb, spike: f32) -> (Medium, Ray) {
    let (index_from_world, ray) = placement();
    (with_grid(homogeneous(sigma_a, sigma_s), cloud(spike).to_bricks(), index_from_world), ray)
}

#[test]
fn grey_homogeneous_has_the_albedo_as_weight() {
    let media = [emissive(homogeneous(Rgb::splat(0.5), Rgb::new(1.5, 1.0, 0.5)), WHITE)];
    // Grey extinction: absorb what is not scattered.
    let media = [Medium { sigma_a: Rgb::splat(2.0) - media[0].sigma_s, ..media[0].clone() }];
    let spans = [span(0.25, 1.5, 0)];
    assert_unbiased(&media, &spans, &along_x(2.0), WHITE, 100_000);
    let mut rng = Pcg::new(&[1]);
    for _ in 0..100 {
        let walk =
            sample_collision(&media, &spans, &along_x(2.0), WHITE, &mut rng, &mut WalkStats::default());
        match walk.event {
            Event::Scatter { t, .. } => {
                assert!((0.25..=1.5).contains(&t));
                assert_eq!(walk.weight, Rgb::new(0.75, 0.5, 0.25));
            }
            Event::Pass => assert_eq!(walk.weight, WHITE),
        }
        let exact = 0.5 * -(-2.0f32 * 1.25).exp_m1();
        assert!((walk.emission - Rgb::splat(exact)).abs().max_element() < 1e-6);
    }
}

#[test]
fn chromatic_homogeneous_is_unbiased() {
    let media =
        [emissive(homogeneous(Rgb::new(0.1, 0.0, 2.0), Rgb::new(3.0, 0.5, 1.0)), Rgb::new(1.0, 2.0, 0.5))];
    for beta in [WHITE, Rgb::new(0.01, 1.0, 0.2), Rgb::new(5.0, 1.0, 30.0)] {
        assert_unbiased(&media, &[span(0.0, 1.0, 0)], &along_x(1.5), beta, 200_000);
    }
}

#[test]
fn overlapping_homogeneous_media_add() {
    let media = [
        homogeneous(Rgb::new(0.1, 0.3, 0.0), Rgb::new(0.5, 1.0, 2.0)),
        emissive(homogeneous(Rgb::splat(1.0), Rgb::ZERO), Rgb::new(0.3, 1.0, 2.0)),
        Medium {
            phase: Phase::henyey_greenstein(0.7).into(),
            ..homogeneous(Rgb::ZERO, Rgb::new(2.0, 0.1, 0.4))
        },
    ];
    let spans = [span(1.0, 3.0, 0), span(0.2, 1.4, 1), span(1.2, 2.0, 2), span(2.9, 3.5, 1)];
    assert_unbiased(&media, &spans, &along_x(4.0), WHITE, 300_000);
    assert_unbiased(&media, &spans, &along_x(1.9), Rgb::new(1.0, 0.2, 3.0), 300_000);
}

#[test]
fn colours_that_vary_are_unbiased_in_every_role() {
    for role in [albedo_tint, dye_tint, glow_tint, relative_tint] {
        let (medium, ray) = role();
        let spans = [span(0.0, f32::INFINITY, 0)];
        for beta in [WHITE, Rgb::new(0.2, 1.0, 3.0)] {
            assert_unbiased(std::slice::from_ref(&medium), &spans, &ray, beta, 50_000);
        }
        let among_others = [medium, homogeneous(Rgb::splat(0.1), Rgb::new(0.3, 0.0, 0.5))];
        assert_unbiased(&among_others, &[spans[0], span(0.2, 0.9, 1)], &ray, WHITE, 50_000);
    }
}

#[test]
fn a_colour_above_what_absorption_can_give_is_cut() {
    let (medium, ray) = albedo_tint();
    let bright = Medium { sigma_a: medium.sigma_a * 0.4, ..medium.clone() };
    let tint = medium.tint.map(|tint| Tint { most: 0.4, ..tint });
    let m =
        assert_unbiased(&[Medium { tint, ..bright }], &[span(0.0, f32::INFINITY, 0)], &ray, WHITE, 50_000);
    assert_eq!(m.stats.majorant_violations, 0);
}

#[test]
fn a_pure_absorber_is_exact() {
    let media = [homogeneous(Rgb::new(0.5, 1.0, 2.0), Rgb::ZERO), homogeneous(Rgb::splat(1.3), Rgb::ZERO)];
    let mut rng = Pcg::new(&[1]);
    let mut walk = |spans: &[Span], t: f32| {
        sample_collision(&media, spans, &along_x(t), WHITE, &mut rng, &mut WalkStats::default())
    };
    let one = walk(&[span(0.0, 2.0, 1)], 9.0);
    assert!(matches!(one.event, Event::Pass));
    // algorithm.md: sigma = 1.3 over 2.
    assert!((one.weight.x - 0.074_273_6).abs() < 1e-7);
    let both = walk(&[span(0.0, 2.0, 1), span(1.0, 3.0, 0)], 9.0);
    assert!((both.weight.y - (-2.6f32 - 2.0).exp()).abs() < 1e-8);
}

#[test]
fn emissive_absorbing_slabs_have_the_table_s_radiance() {
    // algorithm.md: Le = 3, sigma_a = .7, L = 2, with and without sigma_s = .6.
    for (sigma_s, expected) in [(0.0, 2.260_209), (0.6, 1.495_404_2)] {
        let medium = emissive(homogeneous(Rgb::splat(0.7), Rgb::splat(sigma_s)), Rgb::splat(2.1));
        let mut rng = Pcg::new(&[1]);
        let walk = sample_collision(
            &[medium],
            &[span(0.0, 2.0, 0)],
            &along_x(2.0),
            WHITE,
            &mut rng,
            &mut WalkStats::default(),
        );
        assert!((walk.emission.x - expected).abs() < 1e-6, "{}", walk.emission);
    }
}

#[test]
fn grey_grid_is_unbiased() {
    for strength in [0.05, 1.0, 12.0] {
        let (medium, ray) = cloudy(Rgb::splat(0.2 * strength), Rgb::splat(strength), 20.0);
        let spans = [span(0.0, f32::INFINITY, 0)];
        assert_unbiased(std::slice::from_ref(&medium), &spans, &ray, WHITE, 200_000);
        let glowing = emissive(medium, Rgb::new(1.0, 0.5, 0.0));
        assert_unbiased(&[glowing], &[span(0.3, 3.1, 0)], &ray, WHITE, 200_000);
    }
}

#[test]
fn chromatic_grid_is_unbiased() {
    let (medium, ray) = cloudy(Rgb::new(0.1, 2.0, 0.0), Rgb::new(3.0, 0.3, 0.05), 20.0);
    let medium = emissive(medium, Rgb::new(0.1, 0.2, 0.7));
    for beta in [WHITE, Rgb::new(0.02, 1.0, 4.0)] {
        assert_unbiased(std::slice::from_ref(&medium), &[span(0.0, f32::INFINITY, 0)], &ray, beta, 300_000);
    }
}

#[test]
fn grids_and_homogeneous_media_overlap() {
    let (grid, ray) = cloudy(Rgb::new(0.1, 0.2, 0.0), Rgb::new(1.0, 0.3, 0.5), 5.0);
    let (other, _) = cloudy(Rgb::splat(0.4), Rgb::splat(0.2), 0.0);
    let mut shifted = other.density.unwrap();
    shifted.index_from_world =
        Affine3A::from_scale(Vec3::splat(9.0)) * Affine3A::from_translation(Vec3::splat(-0.4));
    let other = Medium { density: Some(shifted), ..homogeneous(Rgb::splat(0.4), Rgb::splat(0.9)) };
    let media = [
        grid,
        other,
        emissive(homogeneous(Rgb::new(0.3, 0.0, 0.1), Rgb::new(0.0, 0.2, 0.1)), WHITE),
        homogeneous(Rgb::splat(0.3), Rgb::ZERO),
    ];
    let spans = [span(0.5, 3.0, 2), span(0.0, 10.0, 0), span(1.0, 9.0, 1), span(2.5, 5.0, 3)];
    assert_unbiased(&media, &spans, &ray, WHITE, 300_000);
}

#[test]
fn flames_without_extinction_are_seen() {
    let (smoke, ray) = cloudy(Rgb::ZERO, Rgb::ZERO, 5.0);
    let flame = emissive(smoke, Rgb::new(2.0, 1.0, 0.1));
    let spans = [span(0.0, 10.0, 0), span(1.0, 3.0, 1)];
    assert_unbiased(std::slice::from_ref(&flame), &spans[..1], &ray, WHITE, 100_000);
    let fog = homogeneous(Rgb::splat(0.2), Rgb::splat(0.5));
    assert_unbiased(&[flame, fog], &spans, &ray, WHITE, 200_000);
}

#[test]
fn an_absorbing_grid_passes_with_its_transmittance() {
    let (medium, ray) = cloudy(Rgb::new(1.0, 3.0, 0.2), Rgb::ZERO, 20.0);
    let m = assert_unbiased(&[medium], &[span(0.0, 10.0, 0)], &ray, WHITE, 200_000);
    assert_eq!(m.scatter.0[0].value(), 0.0);
}

#[test]
fn violated_majorants_are_counted_and_stay_unbiased() {
    let (medium, ray) = cloudy(Rgb::new(0.1, 0.2, 0.3), Rgb::new(1.0, 0.8, 0.5), 2.0);
    let (media, spans) = ([medium], [span(0.0, 10.0, 0)]);
    let m = moments_of(&ray, 400_000, |rng, stats| {
        let channels = channels::channel_weights(WHITE).unwrap();
        track::sample(&mut Segment::new(&media, &spans, &ray), channels, 0.6, rng, stats)
    });
    assert!(m.stats.majorant_violations > 10_000);
    m.assert_matches(&media, &spans, &ray);
}

#[test]
fn slack_majorants_stay_unbiased() {
    let (medium, ray) = cloudy(Rgb::new(0.1, 0.2, 0.3), Rgb::new(1.0, 0.8, 0.5), 2.0);
    let (media, spans) = ([medium], [span(0.0, 10.0, 0)]);
    let m = moments_of(&ray, 200_000, |rng, stats| {
        let channels = channels::channel_weights(WHITE).unwrap();
        track::sample(&mut Segment::new(&media, &spans, &ray), channels, 3.0, rng, stats)
    });
    assert_eq!(m.stats.majorant_violations, 0);
    m.assert_matches(&media, &spans, &ray);
}

#[test]
fn twenty_nested_media_are_all_counted() {
    let media: Vec<_> = (0..20).map(|i| homogeneous(Rgb::ZERO, Rgb::splat(0.02 * (i + 1) as f32))).collect();
    let spans: Vec<_> = (0..20).map(|i| span(0.1 * i as f32, 4.0 - 0.1 * i as f32, i)).collect();
    let m = assert_unbiased(&media, &spans, &along_x(4.0), WHITE, 200_000);
    // Albedo 1: both weights are 1 up to the rounding of the sums.
    assert!(m.pass.0[0].relative_variance() > 0.0);
    let mut rng = Pcg::new(&[1]);
    for _ in 0..1000 {
        let walk =
            sample_collision(&media, &spans, &along_x(4.0), WHITE, &mut rng, &mut WalkStats::default());
        assert!((walk.weight - WHITE).abs().max_element() < 1e-5);
    }
}

#[test]
fn coefficients_of_any_size_end_in_time_and_in_order() {
    let (_, ray) = cloudy(WHITE, WHITE, 0.0);
    for exponent in [-40, -12, -6, -3, 0, 3, 6, 9, 12, 20, 38] {
        let sigma = 10f32.powi(exponent);
        let n = if exponent <= 6 { 100 } else { 10 };
        for colour in [WHITE, Rgb::new(1.0, 1e-3, 1e-9), Rgb::new(0.0, 1.0, 0.5)] {
            let (grid, _) = cloudy(WHITE * sigma * colour, WHITE * sigma * colour, 1e6);
            let media = [grid, homogeneous(sigma * colour, sigma * colour)];
            for spans in
                [&[span(0.0, 9.0, 0)][..], &[span(0.0, 9.0, 1)], &[span(0.0, 9.0, 0), span(1.0, 9.0, 1)]]
            {
                let mut rng = Pcg::new(&[5]);
                let mut stats = WalkStats::default();
                for _ in 0..n {
                    let walk = sample_collision(&media, spans, &ray, WHITE, &mut rng, &mut stats);
                    assert!(walk.weight.is_finite() && walk.weight.min_element() >= 0.0);
                }
                // Entering a voxel whose density rises from 0 takes about the root of its optical depth.
                let limit = n * if exponent <= 6 { 4000 } else { 4 * u64::from(LONG_WALK) };
                assert!(stats.candidates < limit, "{} candidates at {sigma} {colour}", stats.candidates);
            }
        }
    }
}

#[test]
fn an_opaque_medium_scatters_at_its_entry() {
    for sigma in [1e8f32, 1e12, 1e20, 1e38, f32::INFINITY] {
        let media = [homogeneous(Rgb::splat(sigma * 0.5), Rgb::splat(sigma * 0.5))];
        let mut rng = Pcg::new(&[5]);
        for t0 in [0.0, 0.1, 1000.0] {
            let spans = [span(t0, t0 + 1.0, 0)];
            for spans in [&spans[..], &[spans[0], spans[0]]] {
                let walk = sample_collision(
                    &media,
                    spans,
                    &along_x(f32::INFINITY),
                    WHITE,
                    &mut rng,
                    &mut WalkStats::default(),
                );
                let Event::Scatter { t, .. } = walk.event else { panic!("escaped {sigma} at {t0}") };
                let depth = t - f64::from(t0);
                assert!((0.0..=1e-5).contains(&depth));
                assert!((walk.weight - Rgb::splat(0.5)).abs().max_element() < 1e-5);
            }
        }
    }
}

#[test]
fn nothing_is_nothing() {
    let mut rng = Pcg::new(&[5]);
    for sigma in [0.0, 1e-40, -1.0, f32::NAN] {
        let media = [homogeneous(Rgb::splat(sigma), Rgb::splat(sigma))];
        for spans in [&[span(0.0, f32::INFINITY, 0)][..], &[span(2.0, 1.0, 0)], &[span(0.0, 1.0, 7)], &[]] {
            let ray = along_x(f32::INFINITY);
            let walk = sample_collision(&media, spans, &ray, WHITE, &mut rng, &mut WalkStats::default());
            assert!(matches!(walk.event, Event::Pass) && walk.weight == WHITE && walk.emission == Rgb::ZERO);
        }
    }
    let media = [homogeneous(WHITE, WHITE)];
    let spans = [span(0.0, 1.0, 0)];
    let walk =
        sample_collision(&media, &spans, &along_x(1.0), Rgb::ZERO, &mut rng, &mut WalkStats::default());
    assert!(matches!(walk.event, Event::Pass) && walk.weight == Rgb::ZERO);
}

#[test]
fn unbounded_media_scatter_or_end() {
    let ray = along_x(f32::INFINITY);
    let media = [homogeneous(Rgb::splat(0.1), Rgb::new(0.5, 1.0, 2.0)), homogeneous(WHITE, Rgb::ZERO)];
    let media = media.map(|medium| emissive(medium, WHITE));
    let mut rng = Pcg::new(&[5]);
    let spans = [span(3.0, f32::INFINITY, 0), span(5.0, f32::INFINITY, 1)];
    let mut mean = Mean::default();
    for _ in 0..100_000 {
        let walk = sample_collision(&media, &spans[..1], &ray, WHITE, &mut rng, &mut WalkStats::default());
        assert!(matches!(walk.event, Event::Scatter { .. }));
        mean.add(walk.weight.x);
        assert!((walk.emission - (media[0].sigma_a + media[0].sigma_s).recip()).abs().max_element() < 1e-5);
    }
    mean.assert_near(0.5 / 0.6, "scattered in an unbounded medium");
    let absorbed = sample_collision(&media, &spans[1..], &ray, WHITE, &mut rng, &mut WalkStats::default());
    assert!(matches!(absorbed.event, Event::Pass) && absorbed.weight == Rgb::ZERO);
    assert_eq!(absorbed.emission, WHITE);
}

/// Overlapping media with different phase functions and colours: E[weight * phase(cos)] is the sum of σ_s phase.
#[test]
fn mixed_phase_functions_are_unbiased_per_channel() {
    let hg = |g: f32, sigma_s| Medium {
        phase: Phase::henyey_greenstein(g).into(),
        ..homogeneous(Rgb::ZERO, sigma_s)
    };
    let grey = [hg(0.8, Rgb::splat(0.5)), hg(-0.3, Rgb::splat(1.0)), hg(0.8, Rgb::splat(0.2))];
    let coloured =
        [hg(0.8, Rgb::new(1.0, 0.1, 0.0)), hg(-0.3, Rgb::new(0.2, 1.0, 0.5)), hg(0.1, Rgb::splat(0.2))];
    let many: Vec<_> = (0..7).map(|i| hg(0.1 * i as f32, Rgb::splat(0.3))).collect();
    for media in [&grey[..], &coloured, &many] {
        let spans: Vec<_> = (0..media.len()).map(|i| span(0.0, 2.0, i as u32)).collect();
        let mut rng = Pcg::new(&[6]);
        let mut value = RgbMean::default();
        for _ in 0..200_000 {
            let walk =
                sample_collision(media, &spans, &along_x(2.0), WHITE, &mut rng, &mut WalkStats::default());
            value.add(match walk.event {
                Event::Scatter { phase, .. } => walk.weight * phase.eval(0.9),
                Event::Pass => Rgb::ZERO,
            });
        }
        let sums = oracle::march(media, &spans, &along_x(2.0), 20_000, |_| 1.0);
        let expected = std::array::from_fn(|c| {
            let total: f64 = media.iter().map(|m| f64::from(m.sigma_s[c])).sum();
            let phase: f64 = media.iter().map(|m| f64::from(m.sigma_s[c] * m.phase.eval(0.9))).sum();
            sums.scattered[c] * phase / total
        });
        value.assert_near(expected, "weight times phase");
    }
}

#[test]
fn a_spike_costs_only_the_rays_that_meet_it() {
    let (index_from_world, ray) = placement();
    let look_ups = |spike: f32| {
        // The spike shares a brick with the ray, which passes four voxels beside it.
        let grid = DenseGrid::from_fn(IVec3::splat(-16), IVec3::splat(64), |v| {
            if v == IVec3::new(20, 14, -3) { spike } else { 1e-3 }
        });
        let medium = with_grid(homogeneous(Rgb::ZERO, WHITE), grid.to_bricks(), index_from_world);
        moments(&[medium], &[span(0.0, 100.0, 0)], &ray, WHITE, 20_000).stats.lookups
    };
    let (with, without) = (look_ups(1e6), look_ups(1e-3));
    assert!(with < 20_000 && without < 100, "{with} with the spike, {without} without");
}

#[test]
fn thick_clouds_take_few_lookups() {
    let (medium, ray) = cloudy(Rgb::ZERO, Rgb::splat(30.0), 1.0);
    let stats = moments(&[medium], &[span(0.0, 100.0, 0)], &ray, WHITE, 20_000).stats;
    assert!(stats.lookups < 3 * 20_000, "{} look-ups", stats.lookups as f64 / 2e4);
}

#[test]
fn a_uniform_grid_is_a_homogeneous_medium() {
    let values = [1f32; 512];
    let leaves = (0..64).map(|i| ([(i & 3) * 8, (i >> 2 & 3) * 8, (i >> 4) * 8], &values[..])).collect();
    let grid = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0;
    let medium = with_grid(homogeneous(Rgb::splat(0.05), Rgb::splat(0.1)), grid, Affine3A::IDENTITY);
    let ray = Ray { origin: Vec3A::new(0.0, 12.3, 9.1), direction: Vec3A::X, t_max: 23.9 };
    let m = moments(std::slice::from_ref(&medium), &[span(0.0, 31.0, 0)], &ray, WHITE, 200_000);
    m.pass.assert_near([(-0.15f64 * 23.9).exp(); 3], "pass");
    // Below the brick's minimum no voxel is read; its rounding leaves one candidate in a million.
    assert!(m.stats.lookups < 10, "{}", m.stats.lookups);
}

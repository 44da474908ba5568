//! Resampled candidates: whatever probability is asked for, the means are those of ray marching.

use super::*;

/// How a caller may choose.
#[derive(Debug, Clone, Copy)]
enum Choice {
    /// P_v = α P + (1-α) W/(W+T̂).
    Target(f32, f32),
    /// P_v = κW/(κW+T̂).
    Odds(f32),
}

const CHOICES: [Choice; 8] = [
    Choice::Target(0.001, 0.75),
    Choice::Target(0.5, 0.75),
    Choice::Target(0.999, 0.75),
    Choice::Target(0.5, 1.0),
    Choice::Target(0.3, 0.0),
    Choice::Odds(0.05),
    Choice::Odds(1.0),
    Choice::Odds(30.0),
];

impl Choice {
    fn probability(self, sums: &CandidateSums) -> f32 {
        let CandidateSums { w, t_hat, .. } = *sums;
        match self {
            Self::Target(target, alpha) => alpha * target + (1.0 - alpha) * w / (w + t_hat),
            Self::Odds(kappa) => kappa * w / (kappa * w + t_hat),
        }
    }
}

fn resampled(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    beta: Rgb,
    n: u32,
    choice: Choice,
    options: ResampleOptions,
) -> Moments {
    let choose = |sums: &CandidateSums| choice.probability(sums);
    let mut u = Pcg::new(&[17]);
    moments_of(ray, n, |rng, stats| {
        resample_collision(media, spans, ray, beta, options, choose, u.next_f32(), rng, stats).walk
    })
}

fn options(majorant_scale: f32, faint: f32) -> ResampleOptions {
    ResampleOptions { majorant_scale, faint, normalization: None, keeps_candidate: false }
}

/// Every choice, with and without slack and roulette.
fn assert_all_unbiased(media: &[Medium], spans: &[Span], ray: &Ray, beta: Rgb, n: u32) {
    let exact = Exact::march(media, spans, ray);
    for choice in CHOICES {
        for how in [options(1.0, 0.0), options(1.05, 0.05), options(4.0, 0.3)] {
            let m = resampled(media, spans, ray, beta, n, choice, how);
            m.assert_near(&exact);
            assert_eq!(m.stats.majorant_violations, 0, "{choice:?} {how:?}");
        }
    }
}

#[test]
fn homogeneous_media_are_unbiased() {
    let chromatic =
        emissive(homogeneous(Rgb::new(0.1, 0.0, 2.0), Rgb::new(3.0, 0.5, 1.0)), Rgb::new(1.0, 2.0, 0.5));
    let grey = homogeneous(Rgb::splat(0.2), Rgb::splat(0.7));
    for medium in [chromatic, grey] {
        for beta in [WHITE, Rgb::new(5.0, 1.0, 30.0)] {
            let media = std::slice::from_ref(&medium);
            assert_all_unbiased(media, &[span(0.25, 1.25, 0)], &along_x(1.5), beta, 30_000);
        }
    }
}

#[test]
fn overlapping_media_are_one_segment() {
    let media = [
        homogeneous(Rgb::new(0.1, 0.3, 0.0), Rgb::new(0.5, 1.0, 2.0)),
        homogeneous(Rgb::splat(1.0), Rgb::ZERO),
        Medium {
            phase: Phase::henyey_greenstein(0.7).into(),
            ..homogeneous(Rgb::ZERO, Rgb::new(2.0, 0.0, 0.4))
        },
    ];
    let spans = [span(1.0, 3.0, 0), span(0.2, 1.4, 1), span(1.2, 2.0, 2), span(2.9, 3.5, 1)];
    assert_all_unbiased(&media, &spans, &along_x(4.0), Rgb::new(1.0, 0.2, 3.0), 30_000);
}

#[test]
fn grids_are_unbiased() {
    for strength in [0.05, 1.0, 12.0] {
        let (medium, ray) = cloudy(Rgb::splat(0.2 * strength), Rgb::splat(strength), 20.0);
        assert_all_unbiased(&[medium], &[span(0.0, f32::INFINITY, 0)], &ray, WHITE, 20_000);
    }
}

/// A grid, an emissive medium and one that scatters nothing, overlapping, all coloured.
pub(super) fn mixed() -> ([Medium; 3], [Span; 3], Ray) {
    let (grid, ray) = cloudy(Rgb::new(0.1, 0.2, 0.0), Rgb::new(1.0, 0.3, 0.5), 5.0);
    let media = [
        grid,
        emissive(homogeneous(Rgb::new(0.3, 0.0, 0.1), Rgb::new(0.0, 0.2, 0.1)), WHITE),
        homogeneous(Rgb::splat(0.3), Rgb::ZERO),
    ];
    let spans = [span(0.5, 3.0, 1), span(0.0, 10.0, 0), span(2.5, 5.0, 2)];
    (media, spans, ray)
}

#[test]
fn grids_and_homogeneous_media_of_any_colour_are_unbiased() {
    let (media, spans, ray) = mixed();
    assert_all_unbiased(&media, &spans, &ray, Rgb::new(1.0, 0.3, 2.0), 30_000);
}

#[test]
fn any_choice_has_the_same_mean_distance() {
    // algorithm.md §8: E[1_vol (W/P_v) t] for σ = L = 1 is 1 - 2/e, whatever P_v.
    let media = [homogeneous(Rgb::ZERO, WHITE)];
    for choice in CHOICES {
        let m =
            resampled(&media, &[span(0.0, 1.0, 0)], &along_x(1.0), WHITE, 200_000, choice, options(1.0, 0.0));
        m.scatter_t.assert_near([1.0 - 2.0 / std::f64::consts::E; 3], "t");
    }
}

/// A grid of constant density 1 from the origin to 2, in which a ray runs along x.
pub(super) fn constant() -> (BrickGrid, Affine3A, Ray) {
    let values = [1f32; 512];
    let leaves = (0..8).map(|i| ([(i & 1) * 8, (i >> 1 & 1) * 8, (i >> 2) * 8], &values[..])).collect();
    let grid = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0;
    let ray = Ray { origin: Vec3A::new(0.2, 0.9, 0.8), direction: Vec3A::X, t_max: 1.0 };
    (grid, Affine3A::from_scale(Vec3::splat(8.0)), ray)
}

/// The probability of a scattering that is reached, on a constant density of 1 under the majorant `scale`.
fn achieved(choice: Choice, scale: f32) -> Mean {
    let (grid, index_from_world, ray) = constant();
    let media = [with_grid(homogeneous(Rgb::ZERO, WHITE), grid, index_from_world)];
    let (mut rng, mut u) = (Pcg::new(&[3]), Pcg::new(&[4]));
    let mut reached = Mean::default();
    for _ in 0..200_000 {
        let resampled = resample_collision(
            &media,
            &[span(0.0, 9.0, 0)],
            &ray,
            WHITE,
            options(scale, 0.0),
            |sums| choice.probability(sums),
            u.next_f32(),
            &mut rng,
            &mut WalkStats::default(),
        );
        let CandidateSums { w, t_hat, majorant_depth } = resampled.sums;
        assert!((w + t_hat - 1.0).abs() < 1e-5);
        assert!((majorant_depth / scale - 1.0).abs() < 1e-3);
        reached.add(f32::from(u8::from(matches!(resampled.walk.event, Event::Scatter { .. }))));
    }
    reached
}

#[test]
fn the_probability_asked_for_is_reached_where_there_are_candidates() {
    // algorithm.md §8, σ = L = 1 under σ̄ = 2, compensated for segments without a candidate.
    for (target, alpha, expected) in [(0.2, 1.0, 0.2), (0.2, 0.75, 0.308_030), (0.05, 0.75, 0.195_530)] {
        let compensated = target / -(-2f32).exp_m1();
        achieved(Choice::Target(compensated, alpha), 2.0).assert_near(expected, "P*");
    }
}

#[test]
fn a_dense_medium_costs_few_look_ups() {
    // The naive walk needs a look-up per mean free path.
    let (grid, index_from_world, ray) = constant();
    let media = [with_grid(homogeneous(Rgb::ZERO, Rgb::splat(80.0)), grid, index_from_world)];
    let cost = |faint| {
        let m = resampled(
            &media,
            &[span(0.0, 10.0, 0)],
            &ray,
            WHITE,
            20_000,
            Choice::Odds(1.0),
            options(1.05, faint),
        );
        m.stats.lookups as f64 / 20_000.0
    };
    let (with, without) = (cost(0.05), cost(0.0));
    assert!(with < 6.0 && without > 10.0 * with, "{with} look-ups with the roulette, {without} without");
}

#[test]
fn absurd_coefficients_end_in_time() {
    let (_, ray) = cloudy(WHITE, WHITE, 0.0);
    for exponent in [-40, -12, -3, 0, 6, 12, 20, 38] {
        let sigma = 10f32.powi(exponent);
        let (grid, _) = cloudy(WHITE * sigma, WHITE * sigma, 1e6);
        let media = [grid, homogeneous(WHITE * sigma, Rgb::new(1.0, 1e-3, 0.0) * sigma)];
        for spans in [&[span(0.0, 9.0, 0)][..], &[span(0.0, 9.0, 1)], &[span(0.0, 9.0, 0), span(1.0, 9.0, 1)]]
        {
            for choice in CHOICES {
                let m = resampled(&media, spans, &ray, WHITE, 10, choice, options(1.05, 0.05));
                assert!(m.stats.candidates < 40 * u64::from(LONG_WALK), "{} at {sigma}", m.stats.candidates);
            }
        }
    }
}

#[test]
fn nothing_to_choose_is_not_asked() {
    let mut rng = Pcg::new(&[5]);
    let ask = |media: &[Medium], spans: &[Span], rng: &mut Pcg| {
        let never = |_: &CandidateSums| panic!("asked");
        resample_collision(
            media,
            spans,
            &along_x(f32::INFINITY),
            WHITE,
            options(1.0, 0.05),
            never,
            0.5,
            rng,
            &mut WalkStats::default(),
        )
    };
    let absorber = [homogeneous(WHITE, Rgb::ZERO)];
    let passed = ask(&absorber, &[span(0.0, 1.0, 0)], &mut rng);
    assert!(matches!(passed.walk.event, Event::Pass) && (passed.walk.weight.x - (-1f32).exp()).abs() < 1e-6);
    assert!(matches!(ask(&absorber, &[], &mut rng).walk.event, Event::Pass));
    let unbounded = [homogeneous(Rgb::ZERO, WHITE)];
    let scattered = ask(&unbounded, &[span(2.0, f32::INFINITY, 0)], &mut rng);
    assert!(matches!(scattered.walk.event, Event::Scatter { .. }) && scattered.walk.weight == WHITE);
}

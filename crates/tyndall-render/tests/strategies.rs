//! Guiding and walks together: whatever probability to scatter the strategies ask for, means are those of quadrature,
//! and where they can, they reach it.

use glam::{Affine3A, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_guiding::{ScatteringOdds, TargetProbability, headroom_depth};
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};
use tyndall_volume::phase::Isotropic;
use tyndall_volume::{
    BrickGrid, CandidateSums, Emission, Event, GridDensity, Medium, Normalization, Phase, PhaseMix,
    ResampleOptions, Resampled, Span, SparseVoxels, WalkStats, resample_collision,
};

const ALBEDO: f32 = 0.8;
const TARGETS: [f32; 3] = [0.001, 0.5, 0.999];
const ALPHAS: [f32; 3] = [0.0, 0.75, 1.0];
/// Voxels per unit of length.
const SCALE: f32 = 8.0;

/// A density along x between two voxels, of which the walk sees no more than bricks and look-ups.
struct Slab {
    medium: Medium,
    density: fn(i32) -> f32,
    ray: Ray,
}

impl Slab {
    /// Three bricks with these values at their voxels, crossed from voxel 4 to 20: two units of length.
    fn new(density: fn(i32) -> f32) -> Self {
        let brick = |x: i32| -> Vec<f32> { (0..512).map(|i| density(8 * x + (i >> 6))).collect() };
        let bricks = [0, 1, 2].map(brick);
        let leaves = (0..).map(|x| [8 * x, 0, 0]).zip(bricks.iter().map(|brick| &brick[..])).collect();
        let grid = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0;
        let index_from_world = Affine3A::from_scale(Vec3::splat(SCALE));
        let medium = Medium {
            sigma_a: Rgb::splat(1.0 - ALBEDO),
            sigma_s: Rgb::splat(ALBEDO),
            emission: Emission::NONE,
            phase: PhaseMix::single(Phase::Isotropic(Isotropic)),
            density: Some(GridDensity { grid: Arc::new(grid), index_from_world }),
            tint: None,
        };
        let ray = Ray { origin: Vec3A::new(4.0, 3.5, 3.5) / SCALE, direction: Vec3A::X, t_max: 2.0 };
        Self { medium, density, ray }
    }

    /// What passes, what scatters, and ∫ t of it: by the midpoint rule in f64.
    fn exact(&self) -> [f64; 3] {
        const STEPS: u32 = 100_000;
        let step = 2.0 / f64::from(STEPS);
        let (mut depth, mut scattered, mut moment) = (0f64, 0f64, 0f64);
        for i in 0..STEPS {
            let t = (f64::from(i) + 0.5) * step;
            let x = 4.0 + f64::from(SCALE) * t;
            let (low, share) = (x.floor(), x.fract());
            let at = |x: f64| f64::from((self.density)(x as i32));
            let tau = (at(low) * (1.0 - share) + at(low + 1.0) * share) * step;
            let here = f64::from(ALBEDO) * (-depth).exp() * -(-tau).exp_m1();
            scattered += here;
            moment += here * t;
            depth += tau;
        }
        [(-depth).exp(), scattered, moment]
    }

    fn walk(&self, strategy: &Strategy, how: How, u: f32, rng: &mut Pcg) -> Resampled {
        let options = ResampleOptions {
            majorant_scale: how.majorant_scale,
            faint: how.faint,
            normalization: strategy.normalization(),
            keeps_candidate: true,
        };
        resample_collision(
            std::slice::from_ref(&self.medium),
            &[Span { t0: 0.0, t1: f64::INFINITY, medium: 0 }],
            &self.ray,
            Rgb::ONE,
            options,
            |sums| strategy.probability(sums),
            u,
            rng,
            &mut WalkStats::default(),
        )
    }
}

/// Majorants that are the density but for their rounding: without slack, next to nothing passes a candidate.
fn constant(_: i32) -> f32 {
    1.0
}

/// Majorants that change from brick to brick, and are loose in each.
fn varied(x: i32) -> f32 {
    [0.2, 2.0, 0.6][(x / 8) as usize] * (0.3 + 0.7 * ((x * 37 % 11) as f32 / 10.0))
}

#[derive(Debug, Clone, Copy)]
struct How {
    majorant_scale: f32,
    faint: f32,
}

#[derive(Debug, Clone, Copy)]
enum Strategy {
    Odds { kappa: f32, alpha: f32 },
    Target { target: f32, alpha: f32 },
    Normalized { target: f32, exponent: f32, alpha: f32 },
}

impl Strategy {
    /// Every strategy with every α.
    fn all() -> Vec<Self> {
        let of_alpha = |alpha| {
            let odds = [0.02, 1.0, 50.0].map(|kappa| Self::Odds { kappa, alpha });
            let target = TARGETS.map(|target| Self::Target { target, alpha });
            let nds = TARGETS.map(|target| Self::Normalized { target, exponent: 1.0, alpha });
            let nds_plus = TARGETS.map(|target| Self::Normalized { target, exponent: 0.7, alpha });
            [odds, target, nds, nds_plus].concat()
        };
        ALPHAS.into_iter().flat_map(of_alpha).collect()
    }

    /// How many walks show what is rare: where nothing defends a class that is taken once in a thousand times, weights
    /// are a thousand, and few of them would make the sample variance a fiction.
    fn walks(&self) -> u32 {
        match *self {
            Self::Target { target, alpha: 1.0 } if target != 0.5 => 200_000,
            _ => 20_000,
        }
    }

    fn probability(&self, sums: &CandidateSums) -> f32 {
        let CandidateSums { w, t_hat, majorant_depth } = *sums;
        match *self {
            Self::Odds { kappa, alpha } => ScatteringOdds::new(kappa).select_probability(w, t_hat, alpha),
            Self::Target { target, alpha } => {
                TargetProbability::new(target).select_probability(w, t_hat, majorant_depth, alpha)
            }
            Self::Normalized { .. } => unreachable!("flights decide"),
        }
    }

    fn normalization(&self) -> Option<Normalization> {
        match *self {
            Self::Normalized { target, exponent, alpha } => Some(Normalization { target, exponent, alpha }),
            Self::Odds { .. } | Self::Target { .. } => None,
        }
    }
}

/// Mean and standard error of many numbers.
#[derive(Default)]
struct Mean {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    /// The deviation from `expected` in standard errors.
    fn z(&self, expected: f64) -> f64 {
        let mean = self.sum / self.n;
        let variance = (self.squares / self.n - mean * mean).max(0.0);
        (mean - expected) / ((variance / self.n).sqrt() + 1e-5 * expected)
    }
}

/// How far what passes, what scatters and ∫ t of it are from `exact`, in standard errors; and the latter two where the
/// candidate counts, whatever was decided.
fn deviations(slab: &Slab, strategy: &Strategy, how: How, exact: [f64; 3], n: u32) -> [f64; 5] {
    let (mut rng, mut decisions) = (Pcg::new(&[11]), Pcg::new(&[12]));
    let mut means: [Mean; 5] = Default::default();
    for _ in 0..n {
        let Resampled { walk, candidate, .. } = slab.walk(strategy, how, decisions.next_f32(), &mut rng);
        let weight = f64::from(walk.weight.y);
        let [passes, scatters, moment] = match walk.event {
            Event::Pass => [weight, 0.0, 0.0],
            Event::Scatter { t, .. } => [0.0, weight, weight * t],
        };
        let [candidate, candidate_moment] = match candidate {
            Some((Event::Scatter { t, .. }, weight)) => [f64::from(weight.y), f64::from(weight.y) * t],
            // Normalised flights have none.
            _ if strategy.normalization().is_some() => [scatters, moment],
            _ => [0.0, 0.0],
        };
        let values = [passes, scatters, moment, candidate, candidate_moment];
        means.iter_mut().zip(values).for_each(|(mean, value)| mean.add(value));
    }
    std::array::from_fn(|i| means[i].z(exact[[0, 1, 2, 1, 2][i]]))
}

fn assert_unbiased(density: fn(i32) -> f32, majorant_scale: f32) {
    let slab = Slab::new(density);
    let exact = slab.exact();
    for strategy in Strategy::all() {
        for faint in [0.0, 0.3] {
            let how = How { majorant_scale, faint };
            let z = deviations(&slab, &strategy, how, exact, strategy.walks());
            assert!(z.iter().all(|z| z.abs() < 4.0), "{strategy:?}, {how:?}: {z:?} standard errors");
        }
    }
}

#[test]
fn every_strategy_is_unbiased_under_tight_majorants() {
    assert_unbiased(constant, 1.0);
}

#[test]
fn every_strategy_is_unbiased_under_slack_majorants() {
    assert_unbiased(constant, 2.5);
}

#[test]
fn every_strategy_is_unbiased_under_majorants_of_bricks() {
    assert_unbiased(varied, 1.0);
    assert_unbiased(varied, 1.05);
}

/// How often a walk scatters, in standard errors from `expected`.
fn achieved_z(slab: &Slab, strategy: &Strategy, majorant_scale: f32, expected: f64) -> f64 {
    let (mut rng, mut decisions) = (Pcg::new(&[21]), Pcg::new(&[22]));
    let how = How { majorant_scale, faint: 0.0 };
    let mut scatters = Mean::default();
    for _ in 0..200_000 {
        let walk = slab.walk(strategy, how, decisions.next_f32(), &mut rng).walk;
        scatters.add(f64::from(u8::from(matches!(walk.event, Event::Scatter { .. }))));
    }
    scatters.z(expected)
}

#[test]
fn targets_are_reached() {
    // α P* + (1-α)(1-T) for a density of 1 over the length 1, under majorants of 2 or what the target needs.
    let mut slab = Slab::new(constant);
    slab.ray.t_max = 1.0;
    for (target, alpha, expected) in
        [(0.2, 1.0, 0.2), (0.2, 0.75, 0.308_030), (0.9, 0.75, 0.833_030), (0.05, 0.75, 0.195_530)]
    {
        let z = achieved_z(&slab, &Strategy::Target { target, alpha }, headroom_depth(2.0, target), expected);
        assert!(z.abs() < 4.0, "P* {target}, α {alpha}: {z} standard errors from {expected}");
    }
}

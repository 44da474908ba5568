//! Table 2: what a ray costs.

use crate::scenes::{Leaf, cloud, fog, rays};
use crate::{median, time};
use glam::Affine3A;
use std::sync::Arc;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};
use tyndall_volume::majorant::GridWalk;
use tyndall_volume::phase::Isotropic;
use tyndall_volume::{
    BrickGrid, Emission, GridDensity, Medium, Phase, PhaseMix, Span, SparseVoxels, WalkStats,
    sample_collision, transmittance,
};

const N_RAYS: usize = 8192;
const TURNS: usize = 9;
const EDGE: i32 = 256;
const SPANS: [Span; 1] = [Span { t0: 0.0, t1: f64::INFINITY, medium: 0 }];

pub(crate) fn print_table() {
    println!("\nBricks only / with coarse levels; times as the ratio with / without and nanoseconds with.\n");
    println!("| grid | optical depth | steps | DDA | walk | look-ups | shadow ray | look-ups | variance |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, leaves) in scenes() {
        let borrowed = leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
        let voxels = SparseVoxels { leaves: borrowed, ..Default::default() };
        let grids = [BrickGrid::build(&voxels).0.without_coarse_levels(), BrickGrid::build(&voxels).0];
        let grids = grids.map(Arc::new);
        for tau in [0.01, 0.5, 5.0, 50.0, 500.0] {
            measure(name, &grids, tau);
        }
    }
}

fn scenes() -> [(&'static str, Vec<Leaf>); 4] {
    // Two wisps in opposite corners: nearly all of the box is empty.
    let mut wisps = cloud(EDGE);
    wisps.retain(|(origin, _)| {
        origin.iter().all(|&c| c < EDGE * 2 / 5) || origin.iter().all(|&c| c > EDGE * 3 / 5)
    });
    [
        ("wisps in empty space", wisps),
        ("noise cloud", cloud(EDGE)),
        ("smooth fog", fog(EDGE, 1.0)),
        ("faintly varied fog", fog(EDGE, 0.01)),
    ]
}

/// What one grid costs at one density.
struct Run {
    density: GridDensity,
    media: [Medium; 1],
    rng: Pcg,
    steps: usize,
    /// Nanoseconds of crossing, walk and shadow ray in every turn.
    times: [Vec<f64>; 3],
    walks: WalkStats,
    shadows: WalkStats,
}

impl Run {
    fn new(grid: &Arc<BrickGrid>, tau: f32) -> Self {
        let density = GridDensity { grid: Arc::clone(grid), index_from_world: Affine3A::IDENTITY };
        let medium = Medium {
            sigma_a: Rgb::ZERO,
            sigma_s: Rgb::splat(tau / EDGE as f32),
            emission: Emission::Glow(Rgb::ZERO),
            phase: PhaseMix::single(Phase::Isotropic(Isotropic)),
            density: Some(density.clone()),
            tint: None,
        };
        let (walks, shadows) = (WalkStats::default(), WalkStats::default());
        let (rng, times) = (Pcg::new(&[3]), Default::default());
        Self { density, media: [medium], rng, steps: 0, times, walks, shadows }
    }

    fn turn(&mut self, rays: &[Ray]) {
        let Self { density, media, rng, steps, times, walks, shadows } = self;
        let sigma = media[0].sigma_s.x;
        times[0].push(time(N_RAYS, || {
            let cross = |ray: &Ray| GridWalk::new(density, ray, [0.0, ray.t_max], sigma).count();
            *steps = rays.iter().map(cross).sum();
            *steps as f32
        }));
        times[1].push(time(N_RAYS, || {
            let mut sample = |ray| sample_collision(media, &SPANS, ray, Rgb::ONE, rng, walks).weight.x;
            rays.iter().map(&mut sample).sum()
        }));
        times[2].push(time(N_RAYS, || {
            rays.iter().map(|ray| transmittance(media, &SPANS, ray, rng, shadows).x).sum()
        }));
    }
}

fn measure(name: &str, grids: &[Arc<BrickGrid>; 2], tau: f32) {
    let rays: Vec<Ray> = rays(EDGE, N_RAYS).collect();
    let mut runs = grids.each_ref().map(|grid| Run::new(grid, tau));
    for _ in 0..TURNS {
        runs.iter_mut().for_each(|run| run.turn(&rays));
    }
    let variances = runs.each_mut().map(|run| shadow_variance(&run.media, &rays, &mut run.rng));
    let [without, with] = runs;
    let times = [0, 1, 2].map(|i| {
        let ratios = with.times[i].iter().zip(&without.times[i]).map(|(a, b)| a / b).collect();
        format!("{:.2} ({:.0} ns)", median(ratios), median(with.times[i].clone()))
    });
    let per_ray = |n: u64| n as f64 / (N_RAYS * TURNS) as f64;
    let steps = |run: &Run| run.steps as f64 / N_RAYS as f64;
    println!(
        "| {name} | {tau} | {:.1} / {:.1} | {} | {} | {:.2} / {:.2} | {} | {:.2} / {:.2} | {:.4} / {:.4} |",
        steps(&without),
        steps(&with),
        times[0],
        times[1],
        per_ray(without.walks.lookups),
        per_ray(with.walks.lookups),
        times[2],
        per_ray(without.shadows.lookups),
        per_ray(with.shadows.lookups),
        variances[0],
        variances[1],
    );
}

/// Mean over rays of the variance of transmittance: half the squared difference of two estimates.
fn shadow_variance(media: &[Medium], rays: &[Ray], rng: &mut Pcg) -> f64 {
    let mut stats = WalkStats::default();
    let mut estimate = |ray: &Ray| f64::from(transmittance(media, &SPANS, ray, rng, &mut stats).x);
    let mut half_square = |ray: &Ray| (estimate(ray) - estimate(ray)).powi(2) / 2.0;
    rays.iter().map(&mut half_square).sum::<f64>() / rays.len() as f64
}

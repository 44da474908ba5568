//! Table 3: `BrickGrid` of half floats against the same one of f32.
//!
//! Both hold the same field, but for one voxel that a half float does not hold exactly: it keeps the whole grid f32. Grids
//! below `HALF_FROM` bricks (`src/grid/build.rs`) are f32 in both; set it to 0 to compare those.

use crate::scenes::{Leaf, cloud, random_points, ray_points, rays};
use crate::{median, time};
use glam::{Affine3A, Vec3A};
use std::sync::Arc;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};
use tyndall_volume::phase::Isotropic;
use tyndall_volume::{
    BrickGrid, Emission, GridDensity, Medium, Phase, PhaseMix, Span, SparseVoxels, WalkStats,
    sample_collision, transmittance,
};

const EDGES: [i32; 5] = [64, 128, 256, 512, 768];
const N_POINTS: usize = 1 << 18;
const N_RAYS: usize = 1 << 15;
const TURNS: usize = 15;
/// Optical depth across.
const TAU: f32 = 5.0;
const SPANS: [Span; 1] = [Span { t0: 0.0, t1: f64::INFINITY, medium: 0 }];

pub(crate) fn print_table() {
    println!("\nMemory in MiB; times as the ratio half / f32, and nanoseconds of half.\n");
    println!("| voxels | f32 | half | random | along rays | walk | shadow ray |");
    println!("|---|---|---|---|---|---|---|");
    for edge in EDGES {
        let mut leaves = cloud(edge);
        let half = build(&leaves);
        let voxel = leaves.iter_mut().flat_map(|(_, values)| values).find(|value| **value > 0.0);
        *voxel.expect("a cloud has voxels") *= 1.000_1;
        measure(edge, &[build(&leaves), half].map(Arc::new));
    }
}

fn build(leaves: &[Leaf]) -> BrickGrid {
    let borrowed = leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
    BrickGrid::build(&SparseVoxels { leaves: borrowed, ..Default::default() }).0
}

fn measure(edge: i32, grids: &[Arc<BrickGrid>; 2]) {
    let (random, along) = (random_points(edge, N_POINTS), ray_points(edge, N_POINTS));
    let rays: Vec<Ray> = rays(edge, N_RAYS).collect();
    let media = grids.each_ref().map(|grid| [medium(grid, TAU / edge as f32)]);
    let mut times: [[Vec<f64>; 2]; 4] = Default::default();
    for turn in 0..TURNS {
        // Either is first as often as the other.
        for which in [turn & 1, 1 - (turn & 1)] {
            let (grid, media) = (&grids[which], &media[which]);
            let look_up = |points: &[Vec3A]| points.iter().map(|&p| grid.density(p)).sum();
            let (mut rng, mut stats) = (Pcg::new(&[turn as u64]), WalkStats::default());
            times[0][which].push(time(N_POINTS, || look_up(&random)));
            times[1][which].push(time(N_POINTS, || look_up(&along)));
            times[2][which].push(time(N_RAYS, || {
                let mut walk =
                    |ray| sample_collision(media, &SPANS, ray, Rgb::ONE, &mut rng, &mut stats).weight.x;
                rays.iter().map(&mut walk).sum()
            }));
            times[3][which].push(time(N_RAYS, || {
                rays.iter().map(|ray| transmittance(media, &SPANS, ray, &mut rng, &mut stats).x).sum()
            }));
        }
    }
    let cells = times.map(|[full, half]| {
        let ratios = half.iter().zip(&full).map(|(half, full)| half / full).collect();
        format!("{:.2} ({:.0} ns)", median(ratios), median(half))
    });
    let [full, half] = grids.each_ref().map(|grid| grid.memory_bytes() as f64 / f64::from(1 << 20));
    println!("| {edge}^3 | {full:.1} | {half:.1} | {} |", cells.join(" | "));
}

fn medium(grid: &Arc<BrickGrid>, sigma: f32) -> Medium {
    Medium {
        sigma_a: Rgb::ZERO,
        sigma_s: Rgb::splat(sigma),
        emission: Emission::Glow(Rgb::ZERO),
        phase: PhaseMix::single(Phase::Isotropic(Isotropic)),
        density: Some(GridDensity { grid: Arc::clone(grid), index_from_world: Affine3A::IDENTITY }),
        tint: None,
    }
}

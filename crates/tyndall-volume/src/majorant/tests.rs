//! Walks cover what is not empty, in order, and bound it.

use super::*;
use crate::SparseVoxels;
use crate::grid::DenseGrid;
use crate::testing::{cloud, noise, placement};
use glam::{Affine3A, IVec3};
use proptest::prelude::*;
use std::sync::Arc;

fn density(grid: BrickGrid, index_from_world: Affine3A) -> GridDensity {
    GridDensity { grid: Arc::new(grid), index_from_world }
}

/// Every point of the ray is in a step that bounds its density, or has none; steps are in order.
fn assert_covers(density: &GridDensity, ray: &Ray, coefficient: f32) -> usize {
    let steps: Vec<_> = GridWalk::new(density, ray, [0.0, ray.t_max], coefficient).collect();
    let walk = GridWalk::new(density, ray, [0.0, ray.t_max], coefficient);
    for pair in steps.windows(2) {
        assert!(pair[0].t1 <= pair[1].t0);
    }
    for i in 0..4000 {
        let t = ray.t_max * (i as f32 + 0.5) / 4000.0;
        let p = density.index_from_world.transform_point3a(ray.at(t));
        let value = density.grid.density(p);
        match steps.iter().find(|step| step.t0 <= t && t < step.t1) {
            Some(step) => {
                let inside = walk.density(step, t);
                assert!(step.min <= inside && inside <= step.max, "{inside} at {t} in {step:?}");
                // Moving the point into the cell moves it by rounding only.
                assert!((inside - value).abs() <= 1e-3 * step.max, "{inside} for {value} at {t} in {step:?}");
            }
            None => assert!(value <= 1e-3 * density.grid.max_density(), "{value} at {t} is skipped"),
        }
    }
    steps.len()
}

#[test]
fn covers_a_sheared_cloud_with_bricks_and_with_voxels() {
    let (index_from_world, ray) = placement();
    let cloud = density(cloud(3.0).to_bricks(), index_from_world);
    let coarse = assert_covers(&cloud, &ray, 1e-3);
    let fine = assert_covers(&cloud, &ray, 1e6);
    assert!(coarse < 20 && fine > 3 * coarse, "{coarse} bricks, {fine} voxels");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]
    #[test]
    fn covers_random_grids(
        seed in 0u64..1000, a in prop::array::uniform3(-60f32..60.0), b in prop::array::uniform3(-60f32..60.0),
        coefficient in prop::sample::select(vec![1e-3f32, 1.0, 1e4]), aligned in 0usize..6, far in any::<bool>(),
    ) {
        let dense = DenseGrid::from_fn(IVec3::new(-21, -13, -5), IVec3::new(45, 30, 20), |v| {
            if noise(v >> 3i32, seed) < 0.5 { noise(v, seed) } else { 0.0 }
        });
        let leaves = dense.leaves();
        let leaves = leaves.iter().map(|(origin, values)| (*origin, &values[..])).collect();
        let mut voxels = SparseVoxels { leaves, ..Default::default() };
        voxels.tiles.push(([24, -16, -8], 8, 0.8));
        if far {
            voxels.tiles.push(([1 << 22, 0, 0], 8, 0.5));
        }
        let density = density(BrickGrid::build(&voxels).0, Affine3A::IDENTITY);
        let (a, mut b) = (Vec3A::from_array(a), Vec3A::from_array(b));
        // Rays along axes and planes are the traps of such walks.
        for axis in 0..3 {
            if aligned & (1 << axis) != 0 { b[axis] = a[axis]; }
        }
        prop_assume!((b - a).length() > 1e-3);
        let ray = Ray { origin: a, direction: (b - a).normalize(), t_max: (b - a).length() };
        assert_covers(&density, &ray, coefficient);
    }
}

#[test]
fn a_billion_empty_voxels_are_crossed_in_few_steps() {
    let voxels = SparseVoxels {
        tiles: vec![([0, 0, 0], 8, 1.0), ([1_000_000_000, 0, 0], 8, 1.0), ([500_000_000, 64, 0], 8, 1.0)],
        ..Default::default()
    };
    let grid = density(BrickGrid::build(&voxels).0, Affine3A::IDENTITY);
    let ray = Ray { origin: Vec3A::new(-5.0, 3.0, 3.0), direction: Vec3A::X, t_max: f32::INFINITY };
    let before = std::time::Instant::now();
    let steps = (0..1000).map(|_| GridWalk::new(&grid, &ray, [0.0, ray.t_max], 1.0).count()).sum::<usize>();
    assert!(steps >= 2000, "{steps}");
    assert!(before.elapsed().as_secs_f64() < 1.0, "{:?}", before.elapsed());
}

#[test]
fn garbage_ends() {
    let index_from_world = Affine3A::IDENTITY;
    let cloud = density(cloud(1e6).to_bricks(), index_from_world);
    for origin in [Vec3A::NAN, Vec3A::splat(f32::INFINITY), Vec3A::splat(1e30), Vec3A::splat(5.0)] {
        for direction in [Vec3A::ZERO, Vec3A::NAN, Vec3A::splat(1e-38), Vec3A::splat(1e38), Vec3A::X] {
            for t in [[0.0, f32::INFINITY], [f32::NAN, 1.0], [0.0, f32::NAN], [1e30, 1e31]] {
                let ray = Ray { origin, direction, t_max: f32::INFINITY };
                assert!(GridWalk::new(&cloud, &ray, t, 1e12).take(10_000).count() < 10_000);
            }
        }
    }
    let singular = GridDensity { index_from_world: Affine3A::from_scale(glam::Vec3::ZERO), ..cloud };
    let ray = Ray::new(Vec3A::ZERO, Vec3A::X);
    assert!(GridWalk::new(&singular, &ray, [0.0, f32::INFINITY], 1.0).count() < 10);
}

#[test]
fn empty_space_in_a_table_is_skipped_in_cubes() {
    let tiles = (0..64).map(|i| ([8 * (i % 8) * 40, 8 * (i / 8) * 40, 0], 8, 1.0)).collect();
    let (grid, report) = BrickGrid::build(&SparseVoxels { tiles, ..Default::default() });
    assert!(report.is_sparse, "a table would be mostly empty");
    let tiles = (0..64).map(|i| ([8 * (i % 8) * 20, 8 * (i / 8) * 20, 0], 8, 1.0)).collect();
    let (table, report) = BrickGrid::build(&SparseVoxels { tiles, ..Default::default() });
    assert!(!report.is_sparse);
    for grid in [grid, table] {
        let density = density(grid, Affine3A::IDENTITY);
        let ray =
            Ray { origin: Vec3A::new(-1.0, -20.0, 3.0), direction: Vec3A::new(0.6, 0.8, 0.0), t_max: 2000.0 };
        assert_covers(&density, &ray, 1.0);
    }
}

/// ∫ of the upper and of the lower bound along the ray.
fn integrals(density: &GridDensity, ray: &Ray, coefficient: f32) -> [f64; 2] {
    GridWalk::new(density, ray, [0.0, ray.t_max], coefficient).fold([0.0; 2], |[max, min], step| {
        let length = f64::from(step.t1) - f64::from(step.t0);
        [max + length * f64::from(step.max), min + length * f64::from(step.min)]
    })
}

#[test]
fn coarse_levels_save_steps_and_cost_few_candidates() {
    let dense = DenseGrid::from_fn(IVec3::new(-70, -9, 3), IVec3::new(150, 90, 70), |v| match v.x {
        0..10 => 0.0,
        _ => 1.0 + 0.1 * (v.x as f32 * 0.1).sin() + 0.1 * noise(v, 3),
    });
    let levels = density(dense.to_bricks(), Affine3A::IDENTITY);
    let bricks = density(dense.to_bricks().without_coarse_levels(), Affine3A::IDENTITY);
    for i in 0..40 {
        let at = |seed| noise(IVec3::splat(i), seed);
        let (a, b) =
            (Vec3A::new(-80.0, 80.0 * at(1), 70.0 * at(2)), Vec3A::new(90.0, 80.0 * at(3), 70.0 * at(4)));
        let ray = Ray { origin: a, direction: (b - a).normalize(), t_max: (b - a).length() };
        for coefficient in [1e-6, 1e-2, 1.0] {
            let (n_levels, n_bricks) =
                (assert_covers(&levels, &ray, coefficient), assert_covers(&bricks, &ray, coefficient));
            assert!(n_levels <= n_bricks + 2, "{n_levels} steps for {n_bricks}");
            assert!(coefficient > 1e-5 || n_levels * 4 < n_bricks, "{n_levels} steps for {n_bricks}");
            let ([max, min], [brick_max, brick_min]) =
                (integrals(&levels, &ray, coefficient), integrals(&bricks, &ray, coefficient));
            let added = f64::from(coefficient) * (max - brick_max + brick_min - min);
            // The ray meets the mean brick only on average, hence the 4.
            assert!(added <= 4.0 * n_levels as f64 * f64::from(COARSE_BELOW), "{added} in {n_levels} steps");
        }
    }
}

#[test]
fn uniform_regions_are_crossed_at_once() {
    let tiles = vec![([0, 0, 0], 512, 0.7)];
    let grid = density(BrickGrid::build(&SparseVoxels { tiles, ..Default::default() }).0, Affine3A::IDENTITY);
    let ray = Ray { origin: Vec3A::new(-5.0, 200.0, 210.0), direction: Vec3A::X, t_max: 600.0 };
    let n = assert_covers(&grid, &ray, 100.0);
    assert!(n < 64 / 3, "{n} steps through 64 bricks");
}

//! Bricks against the dense twin, and hostile grids.

mod pool;
mod sparse;

use super::*;
use crate::testing::noise;
use proptest::prelude::*;
use std::collections::HashMap;
use tyndall_math::random::Pcg;

fn random_point(rng: &mut Pcg, lo: Vec3A, hi: Vec3A) -> Vec3A {
    lo + (hi - lo) * Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
}

/// Value, minimum and maximum agree with the dense grid at random and at integer points.
fn assert_same(dense: &DenseGrid, grid: &BrickGrid, lo: Vec3A, hi: Vec3A, seed: u64) {
    let mut rng = Pcg::new(&[seed]);
    for i in 0..400 {
        let mut p = random_point(&mut rng, lo - 3.0, hi + 3.0);
        if i % 4 == 0 {
            p = p.round();
        } else if i % 4 == 1 {
            p = (p / 8.0).round() * 8.0 - Vec3A::splat(1e-4);
        }
        let (expected, got) = (dense.density(p), grid.density(p));
        let [min, max] = grid.bounds_around(p.floor().as_ivec3());
        // Rounding of seven lerps between values up to the brick's maximum.
        assert!((f64::from(got) - expected).abs() <= 1e-6 * f64::from(max), "{p}: {got} for {expected}");
        assert!(min <= got && got <= max, "{p}: {got} outside [{min}, {max}]");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(40) })]
    #[test]
    fn agrees_with_the_dense_twin(
        seed in 0u64..1000, x in -40i32..40, y in -40i32..40, z in -9i32..9,
        sx in 1i32..30, sy in 1i32..20, sz in 1i32..20, fill in 0f32..1.0,
    ) {
        let (lo, size) = (IVec3::new(x, y, z), IVec3::new(sx, sy, sz));
        let value = |v: IVec3| if noise(v >> 2i32, seed) < fill { noise(v, seed + 1) } else { 0.0 };
        let dense = DenseGrid::from_fn(lo, size, value);
        assert_same(&dense, &dense.to_bricks(), lo.as_vec3a(), (lo + size).as_vec3a(), seed);
    }

    #[test]
    fn tiles_agree_with_the_dense_twin(seed in 0u64..1000, tx in -2i32..2, value in 0.1f32..2.0, far in any::<bool>()) {
        let (tile, leaf) = (IVec3::new(128 * tx, 0, -128), IVec3::new(128 * tx + 128, 8, -8));
        let inside = |v: IVec3, lo: IVec3, edge: i32| {
            (v - lo).cmpge(IVec3::ZERO).all() && (v - lo).cmplt(IVec3::splat(edge)).all()
        };
        let at = |v: IVec3| match v {
            v if inside(v, tile, 128) => value,
            v if inside(v, leaf, 8) => noise(v, seed),
            _ => 0.0,
        };
        let lo = tile + IVec3::new(100, -3, 90);
        let dense = DenseGrid::from_fn(lo, IVec3::splat(44), at);
        let values: Vec<f32> = (0..512).map(|i| at(leaf + IVec3::new(i >> 6, i >> 3 & 7, i & 7))).collect();
        let mut voxels = SparseVoxels { leaves: vec![(leaf.to_array(), &values)], ..Default::default() };
        voxels.tiles.push((tile.to_array(), 128, value));
        if far {
            // One distant voxel makes the table a tree.
            voxels.tiles.push(([1 << 20, 0, 0], 8, 1.0));
        }
        let (grid, report) = BrickGrid::build(&voxels);
        prop_assert_eq!(report.is_sparse, far);
        assert_same(&dense, &grid, lo.as_vec3a() + 9.0, lo.as_vec3a() + 34.0, seed);
    }
}

#[test]
fn bad_values_are_counted_and_read_as_zero() {
    let mut values = vec![0.5f32; 512];
    (values[0], values[1], values[2], values[3], values[4]) =
        (f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e30);
    let voxels = SparseVoxels {
        leaves: vec![([0, 0, 0], &values), ([4, 0, 0], &values), ([8, 0, 0], &values[..100])],
        tiles: vec![([16, 0, 0], 8, f32::NAN), ([16, 0, 0], 7, 1.0), ([i32::MAX - 7, 0, 0], 8, 1.0)],
        background: 0.25,
    };
    let (grid, report) = BrickGrid::build(&voxels);
    assert_eq!((report.nan_count, report.inf_count, report.negative_count, report.huge_count), (2, 2, 1, 1));
    assert_eq!(report.dropped_count, 4);
    assert!(report.nonzero_background);
    assert_eq!(grid.density(Vec3A::ZERO), 0.0);
    assert_eq!(grid.density(Vec3A::new(0.0, 0.0, 3.0)), 0.0);
    assert_eq!(grid.density(Vec3A::new(0.0, 0.0, 4.0)), MAX_DENSITY);
    assert_eq!(grid.density(Vec3A::new(3.0, 3.0, 3.0)), 0.5);
    assert_eq!(grid.density(Vec3A::NAN), 0.0);
    assert_eq!(grid.density(Vec3A::splat(f32::INFINITY)), 0.0);
}

#[test]
fn empty_grids_have_no_box() {
    let zeros = vec![0f32; 512];
    let voxels = SparseVoxels { leaves: vec![([0, 0, 0], &zeros)], ..Default::default() };
    for voxels in [SparseVoxels::default(), voxels] {
        let (grid, _) = BrickGrid::build(&voxels);
        assert!(grid.is_empty() && grid.bounds().is_none());
        assert_eq!(grid.density(Vec3A::ZERO), 0.0);
        assert_eq!(grid.max_density(), 0.0);
        assert_eq!(grid.memory_bytes(), 0);
    }
}

#[test]
fn one_voxel_is_a_blob_two_voxels_wide() {
    let mut values = vec![0f32; 512];
    values[7 << 6 | 7 << 3 | 7] = 2.0;
    let voxels = SparseVoxels { leaves: vec![([-8, -8, -8], &values)], ..Default::default() };
    let grid = BrickGrid::build(&voxels).0;
    assert_eq!(grid.bounds(), Some([Vec3A::splat(-2.0), Vec3A::splat(0.0)]));
    assert_eq!(grid.density(Vec3A::splat(-1.0)), 2.0);
    assert_eq!(grid.density(Vec3A::new(-0.5, -1.0, -1.0)), 1.0);
    assert_eq!(grid.density(Vec3A::new(-0.5, -0.5, -1.5)), 0.25);
    assert_eq!(grid.density(Vec3A::new(0.0, -1.0, -1.0)), 0.0);
}

#[test]
fn uniform_bricks_take_no_pool() {
    let values = vec![0.7f32; 512];
    let leaves = (0..64).map(|i| ([i * 8, 0, 0], &values[..])).collect();
    let (grid, report) = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() });
    assert_eq!(report.brick_count, 0);
    assert!(grid.memory_bytes() < 64 * 1024);
    assert_eq!(grid.density(Vec3A::new(100.3, 3.0, 4.2)), 0.7);
}

/// The definition, over a map of voxels.
fn brute_force(voxels: &HashMap<IVec3, [f32; 3]>, p: Vec3A) -> [f64; 3] {
    let (floor, mut sum) = (p.floor(), [0f64; 3]);
    for i in 0..8 {
        let step = IVec3::new(i >> 2, i >> 1 & 1, i & 1);
        let weight = (step.as_vec3a() - Vec3A::ONE + (p - floor)).abs().as_dvec3().element_product();
        let color = voxels.get(&(floor.as_ivec3() + step)).copied().unwrap_or_default();
        (0..3).for_each(|c| sum[c] += weight * f64::from(color[c]));
    }
    sum
}

/// The voxels of a leaf.
fn voxels_of<T: Copy>((origin, values): &([i32; 3], Vec<T>)) -> impl Iterator<Item = (IVec3, T)> {
    let local = |i: usize| IVec3::new(i as i32 >> 6, i as i32 >> 3 & 7, i as i32 & 7);
    values.iter().enumerate().map(move |(i, &value)| (IVec3::from_array(*origin) + local(i), value))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(30) })]
    #[test]
    fn colors_agree_with_brute_force(seed in 0u64..1000, far in any::<bool>()) {
        let color = |v: IVec3| [0, 1, 2].map(|c| (noise(v, seed + c) - 0.3).max(0.0));
        let mut leaves: Vec<([i32; 3], Vec<[f32; 3]>)> = (0..12)
            .map(|i| IVec3::new(i % 3 - 1, i / 3 % 2, i / 6) * 8)
            .filter(|&origin| noise(origin, seed) < 0.7)
            .map(|origin| (origin.to_array(), vec![[0.0; 3]; 512]))
            .collect();
        for (i, leaf) in leaves.iter_mut().enumerate() {
            let voxels: Vec<_> = voxels_of(leaf).collect();
            leaf.1 = voxels.iter().map(|(v, _)| if i % 4 == 1 { [0.1, 0.0, 2.0] } else { color(*v) }).collect();
        }
        let mut map: HashMap<_, _> = leaves.iter().flat_map(voxels_of).collect();
        let tile = ([16, 0, 0], vec![[0.5, 0.25, 0.0]; 512]);
        map.extend(voxels_of(&tile));
        let mut tiles = vec![(tile.0, 8, tile.1[0])];
        if far {
            tiles.push(([1 << 25, 0, 0], 128, [1.0; 3]));
        }
        let leaves = leaves.iter().map(|(origin, colors)| (*origin, &colors[..])).collect();
        let (grid, report) = ColorGrid::build(&SparseVoxels { leaves, tiles, ..Default::default() });
        assert_eq!(report.is_sparse, far);
        let mut rng = Pcg::new(&[seed]);
        for _ in 0..400 {
            let p = random_point(&mut rng, Vec3A::new(-11.0, -3.0, -3.0), Vec3A::new(27.0, 19.0, 19.0));
            let (got, expected) = (grid.color(p), brute_force(&map, p));
            (0..3).for_each(|c| assert!((f64::from(got[c]) - expected[c]).abs() < 1e-5, "{p}: {got}"));
        }
    }
}

#[test]
fn hostile_colors_become_black() {
    let mut colors = vec![[0f32; 3]; 512];
    colors[0] = [f32::NAN, -1.0, 3.0];
    colors[1] = [f32::INFINITY, 1e30, 0.0];
    let leaves = vec![([0, 0, 0], &colors[..]), ([0, 0, 0], &colors[..5]), ([i32::MAX, 0, 0], &colors[..])];
    let tiles = vec![([8, 0, 0], 0, [1.0; 3]), ([8, 0, 0], 8, [f32::NAN; 3])];
    let (grid, report) = ColorGrid::build(&SparseVoxels { leaves, tiles, background: [1.0; 3] });
    assert_eq!((report.nan_count, report.inf_count, report.negative_count, report.huge_count), (4, 1, 1, 1));
    assert_eq!(report.dropped_count, 3);
    assert!(report.nonzero_background);
    assert_eq!(grid.color(Vec3A::ZERO).to_array(), [0.0, 0.0, 3.0]);
    assert_eq!(grid.color(Vec3A::Z).to_array(), [0.0, MAX_DENSITY, 0.0]);
    assert_eq!(grid.color(Vec3A::NAN).to_array(), [0.0; 3]);
    let (empty, _) = ColorGrid::build(&SparseVoxels::default());
    assert!(empty.is_empty() && empty.memory_bytes() == 0 && empty.color(Vec3A::ZERO).to_array() == [0.0; 3]);
}

#[test]
fn uniform_colors_share_a_brick() {
    let colors = vec![[0.5f32, 0.0, 0.25]; 512];
    let leaves = (0..64).map(|i| ([i * 8, 0, 0], &colors[..])).collect();
    let tiles = vec![([0, 128, 0], 128, [0.5, 0.0, 0.25])];
    let (grid, _) = ColorGrid::build(&SparseVoxels { leaves, tiles, ..Default::default() });
    assert!(grid.memory_bytes() < 512 * 12 + (1 << 20), "{} bytes", grid.memory_bytes());
    assert_eq!(grid.color(Vec3A::new(7.5, 3.0, 3.0)).to_array(), [0.5, 0.0, 0.25]);
    assert_eq!(grid.color(Vec3A::new(7.5, 130.0, 3.0)).to_array(), [0.5, 0.0, 0.25]);
}

#[test]
fn level_sets_become_their_interior() {
    let centre = Vec3A::new(9.3, 8.1, 7.7);
    let distance = |v: IVec3| (v.as_vec3a() - centre).length() - 6.0;
    // What a level set file holds: distances cut to a narrow band, a tile inside.
    let band = DenseGrid::from_fn(IVec3::splat(0), IVec3::splat(24), |v| distance(v).clamp(-2.0, 2.0));
    let mut leaves = band.leaves();
    leaves[0].1[0] = f32::NAN;
    let borrowed = leaves.iter().map(|(origin, values)| (*origin, &values[..])).collect();
    let tiles = vec![([128, 0, 0], 128, -2.0), ([256, 0, 0], 128, 2.0)];
    let (grid, report) =
        BrickGrid::build_interior(&SparseVoxels { leaves: borrowed, tiles, background: 2.0 }, 1.0);
    let inside =
        DenseGrid::from_fn(IVec3::splat(0), IVec3::splat(24), |v| (0.5 - distance(v)).clamp(0.0, 1.0));
    assert_same(&inside, &grid, Vec3A::ZERO, Vec3A::splat(24.0), 5);
    assert_eq!((report.nan_count, report.negative_count, report.nonzero_background), (1, 0, false));
    assert_eq!((grid.density(centre), grid.max_density()), (1.0, 1.0));
    assert_eq!(grid.density(Vec3A::new(190.5, 60.0, 60.0)), 1.0);
    assert_eq!(grid.density(Vec3A::new(300.0, 60.0, 60.0)), 0.0);
    assert!(
        BrickGrid::build_interior(&SparseVoxels { background: -1.0, ..Default::default() }, 1.0)
            .1
            .nonzero_background
    );
}

#[test]
fn a_thousand_voxels_a_billion_apart_cost_kilobytes() {
    // 10 x 10 x 5 voxels in each of two corners.
    let corner = |lo: IVec3| DenseGrid::from_fn(lo, IVec3::new(10, 10, 5), |v| 0.5 + noise(v, 1)).leaves();
    for span in [1_000, 1_000_000_000] {
        let leaves: Vec<_> = corner(IVec3::ZERO).into_iter().chain(corner(IVec3::splat(span))).collect();
        let leaves = leaves.iter().map(|(origin, values)| (*origin, &values[..])).collect();
        let (grid, report) = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() });
        assert!(report.is_sparse);
        assert!(grid.memory_bytes() < 64 << 10, "{} bytes", grid.memory_bytes());
    }
}

#[test]
fn coarse_bounds_are_those_of_their_bricks() {
    let lo = IVec3::new(-50, 7, -3);
    let dense = DenseGrid::from_fn(lo, IVec3::new(150, 80, 40), |v| {
        if noise(v >> 5i32, 3) < 0.4 { 0.0 } else { noise(v, 4) }
    });
    let grid = dense.to_bricks();
    assert!(grid.top_level(f32::INFINITY) >= 2);
    for level in 1..=grid.top_level(f32::INFINITY) {
        let edge = BRICK_EDGE << (2 * level);
        for x in (-256..256).step_by(edge as usize) {
            let (cell, slack) = grid.coarse_cell(level, IVec3::new(x, 40, 20));
            assert_eq!(
                (cell.edge, cell.lo),
                (edge, IVec3::new(x, 40, 20).div_euclid(IVec3::splat(edge)) * edge)
            );
            let n = edge / BRICK_EDGE;
            let (mut max, mut min, mut ranges) = (0f32, f32::INFINITY, 0f64);
            for i in 0..n * n * n {
                let brick = cell.lo + IVec3::new(i / (n * n), i / n % n, i % n) * BRICK_EDGE;
                let [brick_min, brick_max] = grid.bounds_around(brick);
                (max, min) = (max.max(brick_max), min.min(brick_min));
                ranges += f64::from(brick_max - brick_min);
            }
            assert_eq!((cell.max, cell.min), (max, min));
            let expected = f64::from(max - min) - ranges / f64::from(n * n * n);
            assert!((f64::from(slack) - expected).abs() < 1e-4, "{slack} for {expected}");
        }
    }
}

//! Grids under a tree: lists of voxels, lists of bricks, tiles.

use super::super::{BrickGrid, SparseVoxels, offset};
use super::random_point;
use glam::{IVec3, Vec3A};
use std::collections::HashMap;
use tyndall_math::random::Pcg;

/// About 1,000 voxels in a box of 10^9, nearly always one to a brick, placed there by `place`; one brick has 40 more.
fn scattered(place: impl Fn(IVec3) -> IVec3) -> HashMap<IVec3, f32> {
    let mut rng = Pcg::new(&[9]);
    let mut coordinate =
        || (f64::from(rng.next_f32()) * 1e9) as i32 - 399_999_997 + (rng.next_f32() * 64.0) as i32;
    let voxels = (0..1000).map(|_| place(IVec3::new(coordinate(), coordinate(), coordinate())));
    let mut voxels: HashMap<IVec3, f32> = voxels.zip((0..).map(|i| 0.5 + i as f32 * 1e-3)).collect();
    let heart = *voxels.keys().next().unwrap() & !7i32;
    voxels.extend((0..40).map(|i| (heart + IVec3::new(i % 4, i / 4 % 4, i / 16), 2.0)));
    voxels
}

fn sparse_bricks(voxels: &HashMap<IVec3, f32>) -> BrickGrid {
    let mut leaves: HashMap<IVec3, Vec<f32>> = HashMap::new();
    for (&v, &value) in voxels {
        leaves.entry(v & !7i32).or_insert_with(|| vec![0.0; 512])[offset(v & 7i32)] = value;
    }
    let leaves = leaves.iter().map(|(origin, values)| (origin.to_array(), &values[..])).collect();
    let (grid, report) = BrickGrid::build(&SparseVoxels { leaves, ..Default::default() });
    assert!(report.is_sparse);
    grid
}

#[test]
fn a_thousand_scattered_voxels_cost_kilobytes() {
    // Anywhere; on the lowest corner, where a voxel reaches the cells of eight bricks; inside, where of one.
    let places = [(0, 7, 100_000), (0, 0, 300_000), (3, 0, 60_000)];
    for (add, keep, most) in places {
        let voxels = scattered(|v| v & !7i32 | v & keep | add);
        let grid = sparse_bricks(&voxels);
        assert!(grid.memory_bytes() < most, "{} bytes of {most}", grid.memory_bytes());
        assert_holds(&grid, &voxels);
    }
}

/// Voxels, corners and bounds are those of the map, in it and around.
fn assert_holds(grid: &BrickGrid, voxels: &HashMap<IVec3, f32>) {
    let voxel = |v: IVec3| voxels.get(&v).copied().unwrap_or(0.0);
    for &v in voxels.keys() {
        for i in 0..27 {
            let near = v + IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
            let brick = grid.brick(near >> 3i32);
            assert_eq!(grid.pool.voxel(brick, offset(near & 7i32)), voxel(near));
            let corners: [f32; 8] = std::array::from_fn(|i| {
                voxel(near + (IVec3::new(i as i32 >> 2, i as i32 >> 1, i as i32) & 1i32))
            });
            assert_eq!(grid.corners(brick, near), corners);
            let cell = grid.cell(near);
            assert!(cell.contains(near) && corners.iter().all(|&c| c <= cell.max), "{near}: {cell:?}");
        }
    }
}

#[test]
fn few_bricks_beside_tiles_agree_with_their_bounds() {
    let mut values = vec![0f32; 512];
    values[0] = 1.0;
    values[300] = 3.0;
    // In the corner of a tile's lower neighbour, beside it, and far away.
    let origins = [[120, 120, 120], [264, 0, 0], [1 << 25, 0, 0], [-(1 << 28), 8, 1 << 20]];
    let leaves = origins.map(|origin| (origin, &values[..])).to_vec();
    let tiles = vec![([128, 128, 128], 128, 0.5), ([0, 0, 1 << 20], 4096, 0.25)];
    let (grid, report) = BrickGrid::build(&SparseVoxels { leaves, tiles, ..Default::default() });
    assert!(report.is_sparse);
    let inside = |v: IVec3, lo: [i32; 3], edge: i32| {
        let local = v - IVec3::from_array(lo);
        local.cmpge(IVec3::ZERO).all() && local.cmplt(IVec3::splat(edge)).all()
    };
    let voxel = |v: IVec3| match origins.iter().find(|&&origin| inside(v, origin, 8)) {
        Some(&origin) => values[offset(v - IVec3::from_array(origin))],
        None if inside(v, [128; 3], 128) => 0.5,
        None if inside(v, [0, 0, 1 << 20], 4096) => 0.25,
        None => 0.0,
    };
    let mut rng = Pcg::new(&[4]);
    let centres =
        origins.into_iter().chain([[128; 3], [250; 3], [0, 0, 1 << 20], [4090, 4090, (1 << 20) + 4090]]);
    for centre in centres.map(IVec3::from_array) {
        for _ in 0..2000 {
            let v = centre + random_point(&mut rng, Vec3A::splat(-20.0), Vec3A::splat(20.0)).as_ivec3();
            let corners: [f32; 8] = std::array::from_fn(|i| {
                voxel(v + IVec3::new(i as i32 >> 2, i as i32 >> 1 & 1, i as i32 & 1))
            });
            assert_eq!(grid.corners(grid.brick(v >> 3i32), v), corners, "{v}");
            let cell = grid.cell(v);
            assert!(cell.contains(v) && corners.iter().all(|&c| c <= cell.max), "{v}: {cell:?}");
        }
    }
}

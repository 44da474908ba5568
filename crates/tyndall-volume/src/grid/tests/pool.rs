//! Half floats against f32.

use super::super::Brick;
use super::super::pool::{Pool, is_half_exact};
use crate::testing::noise;
use glam::IVec3;

#[test]
fn half_bricks_read_the_same_bits_from_half_the_memory() {
    let value = |i: usize, seed: u64| half::f16::from_f32(3.0 * noise(IVec3::splat(i as i32), seed)).to_f32();
    let bricks = [1, 2, 3].map(|seed| -> [f32; 512] { std::array::from_fn(|i| value(i, seed)) });
    let pool = |is_half| {
        Pool::fill(&bricks, is_half, Default::default(), |brick: &[f32; 512], values| *values = *brick)
    };
    let (full, half) = (pool(false), pool(true));
    assert_eq!((full.memory_bytes(), half.memory_bytes()), (3 * 2048, 3 * 1024));
    for (data, values) in bricks.iter().enumerate() {
        let brick = Brick { data: data as u32, value: 0.0 };
        for (i, &value) in values.iter().enumerate() {
            assert_eq!([full.voxel(brick, i), half.voxel(brick, i)], [value; 2]);
            if [i >> 6, i >> 3 & 7, i & 7].iter().all(|&local| local < 7) {
                assert_eq!(full.corners(brick, i), half.corners(brick, i));
            }
        }
    }
}

#[test]
fn subnormal_and_huge_values_stay_exact() {
    let smallest = 2f32.powi(-24);
    assert!([0.0, 1.0, 0.5, smallest, 3.0 * smallest, 65_504.0].into_iter().all(is_half_exact));
    let none = [0.1, 1.5 * smallest, smallest / 2.0, 65_536.0, 1e10, f32::MIN_POSITIVE];
    assert!(!none.into_iter().any(is_half_exact));
}

//! The slow twin of [`super::BrickGrid`]: a plain array.

use super::SparseVoxels;
use glam::{IVec3, Vec3A};

/// Densities of a box of voxels, for tests and small grids: nothing clever.
#[derive(Debug, Clone)]
pub struct DenseGrid {
    lo: IVec3,
    size: IVec3,
    values: Vec<f32>,
}

impl DenseGrid {
    /// All voxels of `lo` to `lo + size - 1` from `value`.
    pub fn from_fn(lo: IVec3, size: IVec3, value: impl Fn(IVec3) -> f32) -> Self {
        let mut values = Vec::new();
        for x in 0..size.x {
            for y in 0..size.y {
                for z in 0..size.z {
                    values.push(value(lo + IVec3::new(x, y, z)));
                }
            }
        }
        Self { lo, size, values }
    }

    /// The voxel at `v`, 0 outside.
    pub fn voxel(&self, v: IVec3) -> f32 {
        let i = v - self.lo;
        if i.cmplt(IVec3::ZERO).any() || i.cmpge(self.size).any() {
            return 0.0;
        }
        self.values[((i.x * self.size.y + i.y) * self.size.z + i.z) as usize]
    }

    /// Trilinear density at `p_index` in f64, straight from the definition.
    pub fn density(&self, p_index: Vec3A) -> f64 {
        let floor = p_index.floor();
        let f = (p_index - floor).as_dvec3();
        let mut sum = 0.0;
        for corner in 0..8 {
            let step = IVec3::new(corner >> 2, corner >> 1 & 1, corner & 1);
            let weight = |f: f64, s: i32| if s == 1 { f } else { 1.0 - f };
            let w = weight(f.x, step.x) * weight(f.y, step.y) * weight(f.z, step.z);
            sum += w * f64::from(self.voxel(floor.as_ivec3() + step));
        }
        sum
    }

    /// The leaves that cover the box: origin and 512 values each, as [`SparseVoxels`] wants them.
    pub fn leaves(&self) -> Vec<([i32; 3], Vec<f32>)> {
        let (lo, hi) = (self.lo >> 3i32, (self.lo + self.size - 1) >> 3i32);
        let mut leaves = Vec::new();
        for x in lo.x..=hi.x {
            for y in lo.y..=hi.y {
                for z in lo.z..=hi.z {
                    let origin = IVec3::new(x, y, z) * 8;
                    let local = |i: i32| IVec3::new(i >> 6, i >> 3 & 7, i & 7);
                    leaves
                        .push((origin.to_array(), (0..512).map(|i| self.voxel(origin + local(i))).collect()));
                }
            }
        }
        leaves
    }

    /// The same values as a [`super::BrickGrid`].
    pub fn to_bricks(&self) -> super::BrickGrid {
        let leaves = self.leaves();
        let leaves = leaves.iter().map(|(origin, values)| (*origin, &values[..])).collect();
        super::BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0
    }
}

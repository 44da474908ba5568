//! The voxels of a grid's bricks.
//!
//! Look-ups are the innermost loop of every walk, so what is rare is told apart by a test that f32 bricks need anyway:
//! the check of the range. Lists lie beyond any brick that fits in memory, and of half floats no f32 is stored.

use super::list::VoxelLists;
use super::{BRICK_VOXELS, Brick};
use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;

/// Voxels from the first corner of a cell to the last.
const REACH: usize = 74;
/// The corners of a cell from its first on, corner index x << 2 | y << 1 | z.
const STEPS: [usize; 8] = [0, 1, 8, 9, 64, 65, 72, 73];

/// Bricks of 512 values, offset x << 6 | y << 3 | z.
#[derive(Debug, Default)]
pub(super) struct Pool {
    /// Empty where all values are exact as half floats.
    full: Vec<f32>,
    /// Those values otherwise.
    half: Vec<f16>,
    /// Bricks with few voxels, under a tree.
    lists: VoxelLists,
}

impl Pool {
    /// As many bricks as in `bricks`, each written by `fill` from its entry, and `lists`. `is_half` says that all values
    /// are exact as half floats.
    pub(super) fn fill<B: Sync>(
        bricks: &[B],
        is_half: bool,
        lists: VoxelLists,
        fill: impl Fn(&B, &mut [f32; BRICK_VOXELS]) + Sync,
    ) -> Self {
        let mut pool = Self { lists, ..Self::default() };
        if is_half {
            pool.half = vec![f16::ZERO; bricks.len() * BRICK_VOXELS];
            let (chunks, _) = pool.half.as_chunks_mut::<BRICK_VOXELS>();
            chunks.par_iter_mut().zip(bricks).for_each(|(chunk, brick)| {
                let mut values = [0.0; BRICK_VOXELS];
                fill(brick, &mut values);
                chunk.convert_from_f32_slice(&values);
            });
        } else {
            pool.full = vec![0.0; bricks.len() * BRICK_VOXELS];
            let (chunks, _) = pool.full.as_chunks_mut::<BRICK_VOXELS>();
            chunks.par_iter_mut().zip(bricks).for_each(|(chunk, brick)| fill(brick, chunk));
        }
        pool
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.full.capacity() * size_of::<f32>()
            + self.half.capacity() * size_of::<f16>()
            + self.lists.memory_bytes()
    }

    /// The f32 voxels, if there are no others.
    #[inline]
    pub(super) fn only_full(&self) -> Option<&[f32]> {
        (self.half.is_empty() && self.lists.is_empty()).then_some(&self.full[..])
    }

    /// The eight corners of the cell whose lowest is at `offset` in `brick`, which holds all of them.
    #[inline]
    pub(super) fn corners(&self, brick: Brick, offset: usize) -> [f32; 8] {
        if brick.data == Brick::UNIFORM {
            return [brick.value; 8];
        }
        let base = brick.data as usize * BRICK_VOXELS + offset;
        match self.full.get(base..base + REACH) {
            Some(v) => [v[0], v[1], v[8], v[9], v[64], v[65], v[72], v[73]],
            None => self.other_corners(brick, offset),
        }
    }

    /// The same in half floats or a list.
    #[inline(never)]
    fn other_corners(&self, brick: Brick, offset: usize) -> [f32; 8] {
        if brick.data >= Brick::FIRST_LIST {
            return STEPS.map(|step| self.lists.voxel(brick, offset + step));
        }
        let base = brick.data as usize * BRICK_VOXELS + offset;
        let v = &self.half[base..base + REACH];
        let mut corners = [0.0; 8];
        [v[0], v[1], v[8], v[9], v[64], v[65], v[72], v[73]].convert_to_f32_slice(&mut corners);
        corners
    }

    /// The voxel at `offset` in `brick`.
    #[inline]
    pub(super) fn voxel(&self, brick: Brick, offset: usize) -> f32 {
        if brick.data == Brick::UNIFORM {
            return brick.value;
        }
        match self.full.get(brick.data as usize * BRICK_VOXELS + offset) {
            Some(&value) => value,
            None => self.other_voxel(brick, offset),
        }
    }

    /// The same in half floats or a list.
    #[inline(never)]
    fn other_voxel(&self, brick: Brick, offset: usize) -> f32 {
        match brick.data {
            Brick::FIRST_LIST.. => self.lists.voxel(brick, offset),
            data => self.half[data as usize * BRICK_VOXELS + offset].to_f32(),
        }
    }
}

/// Whether half floats hold `value` exactly.
#[inline]
pub(super) fn is_half_exact(value: f32) -> bool {
    /// Bits of an f32's significand that an f16 has not.
    const LOST: u32 = (1 << 13) - 1;
    value.to_bits() & LOST == 0 && f16::from_f32(value).to_f32() == value
}

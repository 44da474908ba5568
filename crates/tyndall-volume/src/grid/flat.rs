//! The top level as a dense table over the bounding box in bricks.

use super::build::{Extrema, Source, axes};
use super::{BRICK_EDGE, Brick, GridCell, ROUNDING};
use glam::IVec3;
use rayon::prelude::*;

/// What the table knows of one brick cell: 16 bytes.
#[derive(Debug, Clone, Copy)]
struct Entry {
    brick: Brick,
    max: f32,
    min: f32,
}

/// Bricks `lo` to `lo + size - 1`, z fastest.
#[derive(Debug, Default)]
pub(super) struct FlatTable {
    lo: IVec3,
    size: IVec3,
    entries: Vec<Entry>,
}

impl FlatTable {
    pub(super) fn build(sources: &[Source], lo: IVec3, hi: IVec3) -> Self {
        let mut table = Self { lo, size: hi - lo + 1, entries: Vec::new() };
        let n = table.size.x as usize * table.size.y as usize * table.size.z as usize;

        // Which source covers each brick; 0 for none.
        let mut owner = vec![0u32; n];
        for (i, source) in sources.iter().enumerate() {
            table.for_each_brick_of(source, |index| owner[index] = i as u32 + 1);
        }
        let extrema = |brick: IVec3, set: usize| match table.index(brick).map(|index| owner[index]) {
            None | Some(0) => Extrema::ZERO,
            Some(i) => {
                let source = &sources[i as usize - 1];
                // Only the lowest bricks of a source touch its lowest voxels, but a tile is the same everywhere.
                source.extrema[set]
            }
        };
        let entries = (0..n).into_par_iter().map(|index| {
            let brick = table.brick_of(index);
            let bounds = (0..8).map(|set| extrema(brick + axes(set), set)).reduce(Extrema::union);
            let Extrema { min, max } = bounds.unwrap_or(Extrema::ZERO);
            let brick = match owner[index] {
                0 => Brick::EMPTY,
                i => sources[i as usize - 1].brick,
            };
            Entry { brick, max: max * ROUNDING, min: min * (2.0 - ROUNDING) }
        });
        table.entries = entries.collect();
        table
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.entries.capacity() * size_of::<Entry>()
    }

    #[inline]
    pub(super) fn brick(&self, brick: IVec3) -> Brick {
        self.entry(brick).map_or(Brick::EMPTY, |entry| entry.brick)
    }

    #[inline]
    pub(super) fn cell(&self, voxel: IVec3) -> GridCell {
        let brick = voxel >> 3i32;
        let entry = self.entry(brick).unwrap_or(&Entry { brick: Brick::EMPTY, max: 0.0, min: 0.0 });
        GridCell { lo: brick << 3, edge: BRICK_EDGE, max: entry.max, min: entry.min, brick: Some(entry.brick) }
    }

    #[inline]
    fn entry(&self, brick: IVec3) -> Option<&Entry> {
        self.index(brick).and_then(|index| self.entries.get(index))
    }

    #[inline]
    fn index(&self, brick: IVec3) -> Option<usize> {
        let i = (brick - self.lo).as_uvec3();
        let inside = i.cmplt(self.size.as_uvec3()).all();
        inside.then(|| (i.x as usize * self.size.y as usize + i.y as usize) * self.size.z as usize + i.z as usize)
    }

    fn brick_of(&self, index: usize) -> IVec3 {
        let (y, z) = (self.size.y as usize, self.size.z as usize);
        self.lo + IVec3::new((index / (y * z)) as i32, (index / z % y) as i32, (index % z) as i32)
    }

    fn for_each_brick_of(&self, source: &Source, mut f: impl FnMut(usize)) {
        let lo = (source.lo >> 3i32).max(self.lo);
        let hi = ((source.lo + (source.edge - 1)) >> 3i32).min(self.lo + self.size - 1);
        for x in lo.x..=hi.x {
            for y in lo.y..=hi.y {
                for z in lo.z..=hi.z {
                    self.index(IVec3::new(x, y, z)).into_iter().for_each(&mut f);
                }
            }
        }
    }
}

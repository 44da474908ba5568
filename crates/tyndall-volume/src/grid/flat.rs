//! The top level as a dense table over the bounding box in bricks.

use super::build::{Extrema, Source, axes};
use super::pyramid::Pyramid;
use super::{BRICK_EDGE, Brick, GridCell, ROUNDING};
use glam::IVec3;
use rayon::prelude::*;

/// What the table knows of one brick cell: 16 bytes.
#[derive(Debug, Clone, Copy)]
struct Entry {
    brick: Brick,
    /// Bound of the density; if not positive, the cell is empty and so are this many (negated) around it.
    max: f32,
    min: f32,
}

/// Empty cells know at most this many empty cells around.
const FARTHEST: u16 = 1 << 10;

/// Bricks `lo` to `lo + size - 1`, z fastest.
#[derive(Debug, Default)]
pub(super) struct FlatTable {
    lo: IVec3,
    size: IVec3,
    entries: Vec<Entry>,
    pyramid: Pyramid,
}

impl FlatTable {
    pub(super) fn build(sources: &[Source], lo: IVec3, hi: IVec3) -> Self {
        let mut table = Self { lo, size: hi - lo + 1, ..Default::default() };
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
        let bounds = table.entries.iter().map(|&Entry { min, max, .. }| Extrema { min, max });
        table.pyramid = Pyramid::build(lo, table.size, bounds);
        table.measure_emptiness();
        table
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.entries.capacity() * size_of::<Entry>() + self.pyramid.memory_bytes()
    }

    pub(super) fn remove_pyramid(&mut self) {
        self.pyramid = Pyramid::default();
    }

    #[inline]
    pub(super) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    #[inline]
    pub(super) fn brick(&self, brick: IVec3) -> Brick {
        self.entry(brick).map_or(Brick::EMPTY, |entry| entry.brick)
    }

    #[inline]
    pub(super) fn cell(&self, voxel: IVec3) -> GridCell {
        let brick = voxel >> 3i32;
        let entry = *self.entry(brick).unwrap_or(&Entry { brick: Brick::EMPTY, max: 0.0, min: 0.0 });
        if entry.max > 0.0 {
            let Entry { brick: content, max, min } = entry;
            return GridCell { lo: brick << 3, edge: BRICK_EDGE, max, min, brick: Some(content) };
        }
        let around = -entry.max as i32;
        let edge = (2 * around + 1) * BRICK_EDGE;
        GridCell { lo: (brick - around) << 3, edge, max: 0.0, min: 0.0, brick: None }
    }

    #[inline]
    fn entry(&self, brick: IVec3) -> Option<&Entry> {
        self.index(brick).and_then(|index| self.entries.get(index))
    }

    #[inline]
    fn index(&self, brick: IVec3) -> Option<usize> {
        let i = (brick - self.lo).as_uvec3();
        let inside = i.cmplt(self.size.as_uvec3()).all();
        inside.then(|| {
            (i.x as usize * self.size.y as usize + i.y as usize) * self.size.z as usize + i.z as usize
        })
    }

    /// Writes into every empty entry how many cells around it are empty: the chessboard distance to the nearest that
    /// is not, by a sweep forwards and one backwards (Rosenfeld & Pfaltz 1968, doi:10.1016/0031-3203(68)90013-7).
    fn measure_emptiness(&mut self) {
        let mut distances: Vec<u16> =
            self.entries.iter().map(|entry| if entry.max > 0.0 { 0 } else { FARTHEST }).collect();
        let all = (0..27).map(|i| IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1));
        let before: Vec<IVec3> = all.take(13).collect();
        let mut relax = |index: usize, sign: i32| {
            if distances[index] > 0 {
                let brick = self.brick_of(index);
                let neighbours = before.iter().filter_map(|&step| self.index(brick + step * sign));
                let nearest = neighbours.map(|n| distances[n] + 1).min().unwrap_or(FARTHEST);
                distances[index] = distances[index].min(nearest);
            }
        };
        (0..self.entries.len()).for_each(|index| relax(index, 1));
        (0..self.entries.len()).rev().for_each(|index| relax(index, -1));
        for (entry, distance) in self.entries.iter_mut().zip(distances) {
            if distance > 0 {
                entry.max = -f32::from(distance - 1);
            }
        }
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

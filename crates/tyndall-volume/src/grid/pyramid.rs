//! Bounds over ever larger cubes of bricks.
//!
//! Level 1 has cells of 4^3 bricks, every further level of 4^3 cells of the level below. Bounds of a cell are those of
//! its bricks, whose own already reach over the interpolation footprint, so they hold on closed cubes at every level.

use super::build::Extrema;
use super::{BRICK_EDGE, GridCell};
use glam::IVec3;

/// log2 of the number of cells of one level along the edge of a cell of the next.
const SHIFT: usize = 2;
/// No level is added above one of at most this many cells along each axis.
const SMALL_ENOUGH: i32 = 2;

/// The highest level on which two voxels that differ in the bits `differ` of a coordinate lie in different cells.
#[inline]
pub(crate) fn level_between(differ: i32) -> usize {
    let highest_bit = (differ | 1).cast_unsigned().ilog2();
    highest_bit.saturating_sub(BRICK_EDGE.ilog2()) as usize / SHIFT
}

/// Levels 1 and up over a flat table.
#[derive(Debug, Default)]
pub(super) struct Pyramid {
    levels: Vec<Level>,
}

/// Cells `lo` to `lo + size - 1`, z fastest.
#[derive(Debug)]
struct Level {
    lo: IVec3,
    size: IVec3,
    cells: Vec<CubeBounds>,
    /// Median of [`CubeBounds::slack`] over cells that are not empty, times a cell's edge in voxels.
    typical_slack: f32,
}

/// What a level knows of a cell.
#[derive(Debug, Clone, Copy)]
struct CubeBounds {
    extrema: Extrema,
    /// Mean over its bricks of the difference between maximum and minimum.
    mean_range: f32,
}

impl CubeBounds {
    const EMPTY: Self = Self { extrema: Extrema::ZERO, mean_range: 0.0 };

    /// How much further the bounds lie apart than those of the bricks on average.
    #[inline]
    fn slack(&self) -> f32 {
        self.extrema.max - self.extrema.min - self.mean_range
    }
}

impl Pyramid {
    /// The levels above bricks `lo` to `lo + size - 1` with extrema `bricks`, z fastest.
    pub(super) fn build(lo: IVec3, size: IVec3, bricks: impl Iterator<Item = Extrema>) -> Self {
        let cells = bricks.map(|extrema| CubeBounds { extrema, mean_range: extrema.max - extrema.min });
        let bricks = Level { lo, size, cells: cells.collect(), typical_slack: 0.0 };
        let mut levels = Vec::new();
        while levels.last().unwrap_or(&bricks).size.max_element() > SMALL_ENOUGH {
            let edge = 1 << (BRICK_EDGE.ilog2() as usize + SHIFT * (levels.len() + 1));
            levels.push(levels.last().unwrap_or(&bricks).coarsened(edge));
        }
        Self { levels }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let bounds = self.levels.iter().map(|level| level.cells.capacity() * size_of::<CubeBounds>());
        bounds.sum::<usize>() + self.levels.capacity() * size_of::<Level>()
    }

    /// Index of the highest level, if across a typical cell of the first its slack is at most `slack`, density times
    /// voxels; else 0.
    #[inline]
    pub(super) fn top(&self, slack: f32) -> usize {
        let is_tight = self.levels.first().is_some_and(|level| level.typical_slack <= slack);
        if is_tight { self.levels.len() } else { 0 }
    }

    /// The cell of `level`, 1 to the highest, around `voxel`, and how much further its bounds lie apart than those
    /// of its bricks on average.
    #[inline]
    pub(super) fn cell(&self, level: usize, voxel: IVec3) -> (GridCell, f32) {
        let shift = BRICK_EDGE.ilog2() as i32 + (SHIFT * level) as i32;
        let key = voxel >> shift;
        let level = level.checked_sub(1).and_then(|i| self.levels.get(i));
        let bounds = level.map_or(CubeBounds::EMPTY, |level| level.at(key));
        let Extrema { min, max } = bounds.extrema;
        (GridCell { lo: key << shift, edge: 1 << shift, max, min, brick: None }, bounds.slack())
    }
}

impl Level {
    /// The cell `key`; beyond the level density is 0.
    #[inline]
    fn at(&self, key: IVec3) -> CubeBounds {
        let (i, size) = ((key - self.lo).as_uvec3(), self.size.as_uvec3());
        if !i.cmplt(size).all() {
            return CubeBounds::EMPTY;
        }
        let index = (i.x as usize * size.y as usize + i.y as usize) * size.z as usize + i.z as usize;
        self.cells.get(index).copied().unwrap_or(CubeBounds::EMPTY)
    }

    /// The next level, whose cells are `edge` voxels wide.
    fn coarsened(&self, edge: u32) -> Self {
        let lo = self.lo >> SHIFT as i32;
        let size = ((self.lo + self.size - 1) >> SHIFT as i32) - lo + 1;
        let mut cells = Vec::with_capacity(size.as_u64vec3().element_product() as usize);
        for x in 0..size.x {
            for y in 0..size.y {
                for z in 0..size.z {
                    cells.push(self.union((lo + IVec3::new(x, y, z)) << SHIFT as i32));
                }
            }
        }
        let typical_slack = median_slack(&cells) * edge as f32;
        Self { lo, size, cells, typical_slack }
    }

    /// The cube of 4^3 cells from `lo` on.
    fn union(&self, lo: IVec3) -> CubeBounds {
        let edge = 1 << SHIFT;
        let local = |i: i32| IVec3::new(i / (edge * edge), i / edge % edge, i % edge);
        let n = edge * edge * edge;
        let first = CubeBounds { mean_range: 0.0, ..self.at(lo) };
        (0..n).map(|i| self.at(lo + local(i))).fold(first, |sum, cell| CubeBounds {
            extrema: sum.extrema.union(cell.extrema),
            mean_range: sum.mean_range + cell.mean_range / n as f32,
        })
    }
}

/// The median over cells that are not empty: the loose cells around a uniform block don't count against it.
fn median_slack(cells: &[CubeBounds]) -> f32 {
    let mut slacks: Vec<f32> =
        cells.iter().filter(|cell| cell.extrema.max > 0.0).map(CubeBounds::slack).collect();
    let middle = slacks.len() / 2;
    match slacks.get(middle) {
        Some(_) => *slacks.select_nth_unstable_by(middle, f32::total_cmp).1,
        None => 0.0,
    }
}

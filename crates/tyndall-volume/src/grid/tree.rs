//! The top level as hash maps: for boxes too empty for a table.
//!
//! Six levels of nodes, 8 to 2^27 voxels wide. Sources (leaves and tiles) sit on the level of their own size; a node
//! holds the bound of the sources *of its level* that reach into it, and whether finer ones do. The bound of a point
//! is the largest over the levels, and a node nobody reaches is empty as a whole: a ray crosses a span of 10^9 voxels
//! in a few steps.

use super::build::{Extrema, Source, axes};
use super::{Brick, GridCell, ROUNDING};
use glam::IVec3;
use rustc_hash::FxHashMap;

/// log2 of the node edge per level; the first three are the sizes of VDB nodes.
const SHIFT: [i32; 6] = [3, 7, 12, 17, 22, 27];

#[derive(Debug, Clone, Copy)]
struct Node {
    /// Largest density that sources of this level contribute to the cells of this node.
    max: f32,
    /// Sources of finer levels reach into it.
    is_mixed: bool,
    /// The source that is this node, if one is.
    brick: Option<Brick>,
}

#[derive(Debug, Default)]
pub(super) struct TreeTable {
    levels: [FxHashMap<IVec3, Node>; SHIFT.len()],
}

impl TreeTable {
    pub(super) fn build(sources: &[Source]) -> Self {
        let mut table = Self::default();
        for source in sources {
            table.insert(source);
        }
        table.levels.iter_mut().for_each(FxHashMap::shrink_to_fit);
        table
    }

    /// Enters `source` into its node and the seven below it, whose highest cells interpolate towards it.
    fn insert(&mut self, source: &Source) {
        let level = SHIFT.iter().position(|shift| source.edge == 1 << shift).unwrap_or(0);
        let own = source.lo >> SHIFT[level];
        for (set, Extrema { max, .. }) in source.extrema.into_iter().enumerate().filter(|(_, e)| e.max > 0.0)
        {
            let node = self.node(level, own - axes(set));
            node.max = node.max.max(max * ROUNDING);
            for (coarse, shift) in SHIFT.iter().enumerate().skip(level + 1) {
                self.node(coarse, (own - axes(set)) >> (shift - SHIFT[level])).is_mixed = true;
            }
        }
        self.node(level, own).brick = Some(source.brick);
    }

    fn node(&mut self, level: usize, key: IVec3) -> &mut Node {
        self.levels[level].entry(key).or_insert(Node { max: 0.0, is_mixed: false, brick: None })
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.levels.iter().map(|level| level.capacity() * size_of::<(IVec3, Node)>() * 8 / 7).sum()
    }

    pub(super) fn brick(&self, brick: IVec3) -> Brick {
        let present = |level: usize| self.levels[level].get(&(brick >> (SHIFT[level] - 3)))?.brick;
        (0..3).find_map(present).unwrap_or(Brick::EMPTY)
    }

    pub(super) fn cell(&self, voxel: IVec3) -> GridCell {
        let mut max = 0f32;
        for level in (0..SHIFT.len()).rev() {
            let key = voxel >> SHIFT[level];
            let node = self.levels[level].get(&key);
            max = max.max(node.map_or(0.0, |node| node.max));
            if level == 0 || !node.is_some_and(|node| node.is_mixed) {
                let brick = (level == 0).then(|| self.brick(key));
                return GridCell { lo: key << SHIFT[level], edge: 1 << SHIFT[level], max, min: 0.0, brick };
            }
        }
        unreachable!("level 0 returns")
    }
}

//! The top level as hash maps: for boxes too empty for a table.
//!
//! Six levels of nodes, 8 to 2^27 voxels wide. Sources (leaves and tiles) sit on the level of their own size; a node
//! holds the bound of the sources *of its level* that reach into it, and what finer ones do: nothing, much, or so little
//! that its bricks are kept in a list instead of on levels of their own. The bound of a point is the largest over the
//! levels, and a node nobody reaches is empty as a whole: a ray crosses a span of 10^9 voxels in a few steps.

use super::build::{Extrema, Source, axes};
use super::{BRICK_EDGE, Brick, GridCell, ROUNDING};
use glam::IVec3;
use rustc_hash::FxHashMap;

/// log2 of the node edge per level; the first three are the sizes of VDB nodes.
const SHIFT: [i32; 6] = [3, 7, 12, 17, 22, 27];

/// Bricks in a list at most: a look-up reads them all.
const FEW: usize = 8;

#[derive(Debug, Clone, Copy)]
struct Node {
    /// Largest density that sources of this level contribute to the cells of this node.
    max: f32,
    /// What sources of finer levels do in it.
    inside: Inside,
    /// The source that is this node, if one is.
    brick: Option<Brick>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Inside {
    /// They do not reach into it.
    Nothing,
    /// Only bricks reach into it; see the finer levels.
    Bricks,
    /// The same, which are `len` of [`TreeTable::few`] from `first` on. No finer node is inside.
    Few { first: u32, len: u8 },
    /// Tiles do as well; see the finer levels.
    Mixed,
}

/// A brick's node, in a list.
#[derive(Debug, Clone, Copy)]
struct FewBrick {
    key: IVec3,
    max: f32,
    brick: Option<Brick>,
}

#[derive(Debug, Default)]
pub(super) struct TreeTable {
    levels: [FxHashMap<IVec3, Node>; SHIFT.len()],
    few: Vec<FewBrick>,
}

impl TreeTable {
    pub(super) fn build(sources: &[Source]) -> Self {
        let mut table = Self::default();
        for source in sources {
            table.insert(source);
        }
        table.gather_few();
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
                let node = self.node(coarse, (own - axes(set)) >> (shift - SHIFT[level]));
                let only_bricks = level == 0 && node.inside != Inside::Mixed;
                node.inside = if only_bricks { Inside::Bricks } else { Inside::Mixed };
            }
        }
        self.node(level, own).brick = Some(source.brick);
    }

    fn node(&mut self, level: usize, key: IVec3) -> &mut Node {
        self.levels[level].entry(key).or_insert(Node { max: 0.0, inside: Inside::Nothing, brick: None })
    }

    /// Moves the bricks of the coarsest nodes that have few, and no tiles, into lists.
    fn gather_few(&mut self) {
        let listed = |(&key, node): (&IVec3, &Node)| FewBrick { key, max: node.max, brick: node.brick };
        let mut bricks: Vec<FewBrick> = self.levels[0].iter().map(listed).collect();
        let coarsest_first =
            |brick: &FewBrick| [5, 4, 3, 2, 1, 0].map(|level| around(brick.key, level).to_array());
        bricks.sort_unstable_by_key(coarsest_first);
        self.gather_below(SHIFT.len() - 1, &bricks);
        self.few.shrink_to_fit();
    }

    /// The same for the nodes of `level` around `bricks`, in that order.
    fn gather_below(&mut self, level: usize, bricks: &[FewBrick]) {
        for group in bricks.chunk_by(|a, b| around(a.key, level) == around(b.key, level)) {
            let first = self.few.len() as u32;
            let node = self.node(level, around(group[0].key, level));
            if group.len() <= FEW && node.inside == Inside::Bricks {
                node.inside = Inside::Few { first, len: group.len() as u8 };
                self.few.extend_from_slice(group);
                for (finer, brick) in
                    (0..level).flat_map(|finer| group.iter().map(move |brick| (finer, brick)))
                {
                    self.levels[finer].remove(&around(brick.key, finer));
                }
            } else if level > 1 {
                self.gather_below(level - 1, group);
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let entry = size_of::<(IVec3, Node)>() + 1;
        self.levels.iter().map(|level| level.capacity() * entry * 8 / 7).sum::<usize>()
            + self.few.capacity() * size_of::<FewBrick>()
    }

    pub(super) fn brick(&self, brick: IVec3) -> Brick {
        let present = |level: usize| self.levels[level].get(&around(brick, level))?.brick;
        let listed = || self.few_around(brick).iter().find(|few| few.key == brick)?.brick;
        present(0).or_else(listed).or_else(|| present(1)).or_else(|| present(2)).unwrap_or(Brick::EMPTY)
    }

    /// The list that `brick` belongs to, if to one.
    fn few_around(&self, brick: IVec3) -> &[FewBrick] {
        if self.few.is_empty() {
            return &[];
        }
        let inside = |level: usize| Some(self.levels[level].get(&around(brick, level))?.inside);
        (1..SHIFT.len()).rev().map_while(inside).find_map(|inside| self.list(inside)).unwrap_or_default()
    }

    fn list(&self, inside: Inside) -> Option<&[FewBrick]> {
        let Inside::Few { first, len } = inside else { return None };
        self.few.get(first as usize..first as usize + usize::from(len))
    }

    pub(super) fn cell(&self, voxel: IVec3) -> GridCell {
        let mut max = 0f32;
        for level in (0..SHIFT.len()).rev() {
            let key = voxel >> SHIFT[level];
            let node = self.levels[level].get(&key);
            max = max.max(node.map_or(0.0, |node| node.max));
            let inside = node.map_or(Inside::Nothing, |node| node.inside);
            if let Some(few) = self.list(inside) {
                return self.cell_among(few, voxel >> SHIFT[0], max);
            }
            if level == 0 || inside == Inside::Nothing {
                let brick = (level == 0).then(|| self.brick(key));
                return GridCell { lo: key << SHIFT[level], edge: 1 << SHIFT[level], max, min: 0.0, brick };
            }
        }
        unreachable!("level 0 returns")
    }

    /// The cell of `brick` if it is one of `few`; else the largest aligned cube around it that has none of them. Tiles are
    /// at most `max` dense there.
    fn cell_among(&self, few: &[FewBrick], brick: IVec3, max: f32) -> GridCell {
        if let Some(few) = few.iter().find(|few| few.key == brick) {
            let (max, content) = (max.max(few.max), Some(self.brick(brick)));
            return GridCell { lo: brick << SHIFT[0], edge: BRICK_EDGE, max, min: 0.0, brick: content };
        }
        // In the smallest aligned cube around both bricks, the highest bit that differs tells the halves apart.
        let differ = |few: &FewBrick| {
            let bits = few.key ^ brick;
            (bits.x | bits.y | bits.z).cast_unsigned().ilog2() as i32
        };
        let shift = SHIFT[0] + few.iter().map(differ).min().unwrap_or(0);
        let lo = (brick << SHIFT[0]) >> shift << shift;
        GridCell { lo, edge: 1 << shift, max, min: 0.0, brick: None }
    }
}

/// The node of `level` around a brick.
fn around(brick: IVec3, level: usize) -> IVec3 {
    brick >> (SHIFT[level] - SHIFT[0])
}

//! First pass: where everything is, with all counts checked against the bytes present.

use rustc_hash::FxHashSet;

use super::{Level, ROOT_LOG2};
use crate::VdbError;
use crate::codec::block::{Block, BlockFormat};
use crate::cursor::Cursor;
use crate::header::VERSION_NODE_MASKS;
use crate::mask::Mask;

/// Bytes of a leaf's active mask.
const LEAF_MASK_BYTES: usize = 64;

/// All nodes of a tree, in file order, as references into the file.
#[derive(Debug)]
pub(crate) struct Skeleton<'a> {
    pub(crate) format: BlockFormat,
    pub(crate) background: &'a [u8],
    pub(crate) root_tiles: Vec<RootTile<'a>>,
    pub(crate) nodes: Vec<InternalNode<'a>>,
    pub(crate) leaves: Vec<LeafSite<'a>>,
}

#[derive(Debug)]
pub(crate) struct RootTile<'a> {
    pub(crate) origin: [i32; 3],
    pub(crate) value: &'a [u8],
    pub(crate) active: bool,
}

#[derive(Debug)]
pub(crate) struct InternalNode<'a> {
    pub(crate) level: Level,
    pub(crate) origin: [i32; 3],
    pub(crate) children: Mask<'a>,
    pub(crate) active: Mask<'a>,
    pub(crate) block: Block<'a>,
    /// Number of values in the block: all slots, or before version 222 those without a child.
    pub(crate) n_values: usize,
}

#[derive(Debug)]
pub(crate) struct LeafSite<'a> {
    pub(crate) origin: [i32; 3],
    pub(crate) active: Mask<'a>,
    pub(crate) block: Block<'a>,
}

/// A leaf whose mask has been seen in the topology and whose buffer comes later.
struct PendingLeaf<'a> {
    origin: [i32; 3],
    active: Mask<'a>,
}

impl<'a> Skeleton<'a> {
    /// Reads topology and leaf buffers; afterwards the cursor is at the end of the tree.
    pub(crate) fn read(cursor: &mut Cursor<'a>, format: BlockFormat) -> Result<Self, VdbError> {
        cursor.i32("buffer count")?;
        let background = cursor.take(format.values.full_bytes, "background")?;
        let mut topology = Topology {
            skeleton: Self {
                format,
                background,
                root_tiles: Vec::new(),
                nodes: Vec::new(),
                leaves: Vec::new(),
            },
            pending: Vec::new(),
            seen: FxHashSet::default(),
        };
        topology.read_root(cursor)?;
        let Topology { mut skeleton, pending, .. } = topology;
        for leaf in pending {
            let block = locate_leaf_buffer(cursor, &format, leaf.active)?;
            skeleton.leaves.push(LeafSite { origin: leaf.origin, active: leaf.active, block });
        }
        Ok(skeleton)
    }
}

struct Topology<'a> {
    skeleton: Skeleton<'a>,
    pending: Vec<PendingLeaf<'a>>,
    seen: FxHashSet<[i32; 3]>,
}

impl<'a> Topology<'a> {
    fn read_root(&mut self, cursor: &mut Cursor<'a>) -> Result<(), VdbError> {
        let value_bytes = self.skeleton.format.values.full_bytes;
        let n_tiles = cursor.u32("root tile count")?;
        let n_children = cursor.u32("root child count")?;
        cursor.require(u64::from(n_tiles) * (12 + value_bytes as u64 + 1), "root tiles")?;
        for _ in 0..n_tiles {
            let origin = self.read_root_origin(cursor)?;
            let value = cursor.take(value_bytes, "root tile")?;
            let active = cursor.u8("root tile")? != 0;
            self.skeleton.root_tiles.push(RootTile { origin, value, active });
        }
        let smallest_child = 12 + 2 * Level::Upper.n_slots() as u64 / 8;
        cursor.require(u64::from(n_children) * smallest_child, "root children")?;
        for _ in 0..n_children {
            let origin = self.read_root_origin(cursor)?;
            self.read_upper(cursor, origin)?;
        }
        Ok(())
    }

    /// Root entries are disjoint cubes of side 4096 on their own lattice; anything else would let voxels overlap.
    fn read_root_origin(&mut self, cursor: &mut Cursor<'a>) -> Result<[i32; 3], VdbError> {
        let at = cursor.offset();
        let origin = cursor.i32x3("root entry")?;
        if origin.iter().any(|c| c.trailing_zeros() < u32::from(ROOT_LOG2)) {
            return Err(VdbError::corrupt(at, format!("root entry at {origin:?} is not a multiple of 4096")));
        }
        if !self.seen.insert(origin) {
            return Err(VdbError::corrupt(at, format!("two root entries at {origin:?}")));
        }
        Ok(origin)
    }

    fn read_upper(&mut self, cursor: &mut Cursor<'a>, origin: [i32; 3]) -> Result<(), VdbError> {
        for slot in self.read_node(cursor, Level::Upper, origin)?.on_indices() {
            let lower_origin = Level::Upper.slot_origin(origin, slot);
            for slot in self.read_node(cursor, Level::Lower, lower_origin)?.on_indices() {
                let active = Mask(cursor.take(LEAF_MASK_BYTES, "leaf mask")?);
                let origin = Level::Lower.slot_origin(lower_origin, slot);
                self.pending.push(PendingLeaf { origin, active });
            }
        }
        Ok(())
    }

    /// Reads masks and values of an internal node and returns its child mask.
    fn read_node(
        &mut self,
        cursor: &mut Cursor<'a>,
        level: Level,
        origin: [i32; 3],
    ) -> Result<Mask<'a>, VdbError> {
        let format = &self.skeleton.format;
        let n_slots = level.n_slots();
        let children = Mask(cursor.take(n_slots / 8, "child mask")?);
        let active = Mask(cursor.take(n_slots / 8, "value mask")?);
        let n_values =
            if format.version >= VERSION_NODE_MASKS { n_slots } else { n_slots - children.count_on() };
        let block = Block::locate(cursor, format, active, n_values)?;
        self.skeleton.nodes.push(InternalNode { level, origin, children, active, block, n_values });
        Ok(children)
    }
}

/// A leaf's part of the buffer pass: its mask once more, then (before version 222) origin and number of buffers,
/// then values. Extra buffers are stepped over.
fn locate_leaf_buffer<'a>(
    cursor: &mut Cursor<'a>,
    format: &BlockFormat,
    active: Mask<'a>,
) -> Result<Block<'a>, VdbError> {
    cursor.take(LEAF_MASK_BYTES, "leaf mask")?;
    let mut n_buffers = 1;
    if format.version < VERSION_NODE_MASKS {
        cursor.take(12, "leaf origin")?;
        n_buffers = cursor.u8("leaf buffer count")?;
    }
    let block = Block::locate(cursor, format, active, active.len())?;
    // The count is a signed byte in the format; 128 and more are negative there and mean no extra buffers.
    let n_extra = if n_buffers < 128 { n_buffers.saturating_sub(1) } else { 0 };
    for _ in 0..n_extra {
        format.chunk(cursor, active.len())?;
    }
    Ok(block)
}

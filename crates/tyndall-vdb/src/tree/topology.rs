//! First pass: where everything is, with all counts checked against the bytes present.

use rustc_hash::FxHashSet;

use super::{Level, ROOT_LOG2};
use crate::VdbError;
use crate::codec::block::{Block, BlockFormat};
use crate::cursor::Cursor;
use crate::header::VERSION_NODE_MASKS;
use crate::mask::Mask;

/// Bytes of a leaf's active mask.
pub(super) const LEAF_MASK_BYTES: usize = 64;

/// All nodes of a tree, in file order, as references into the file.
#[derive(Debug)]
pub(super) struct Topology<'a> {
    pub(super) format: BlockFormat,
    pub(super) background: &'a [u8],
    pub(super) root_tiles: Vec<RootTile<'a>>,
    pub(super) nodes: Vec<InternalNode<'a>>,
    /// In the order in which their buffers follow.
    pub(super) leaves: Vec<LeafStub<'a>>,
}

#[derive(Debug)]
pub(super) struct RootTile<'a> {
    pub(super) origin: [i32; 3],
    pub(super) value: &'a [u8],
    pub(super) active: bool,
}

#[derive(Debug)]
pub(super) struct InternalNode<'a> {
    pub(super) level: Level,
    pub(super) origin: [i32; 3],
    pub(super) children: Mask<'a>,
    pub(super) active: Mask<'a>,
    pub(super) block: Block<'a>,
    /// Number of values in the block: all slots, or before version 222 those without a child.
    pub(super) n_values: usize,
}

/// A leaf of which only the mask has been seen: its buffer comes later.
#[derive(Debug)]
pub(super) struct LeafStub<'a> {
    pub(super) origin: [i32; 3],
    pub(super) active: Mask<'a>,
}

impl<'a> Topology<'a> {
    /// Reads everything before the leaf buffers; afterwards the cursor is at the first of them.
    pub(super) fn read(cursor: &mut Cursor<'a>, format: BlockFormat) -> Result<Self, VdbError> {
        cursor.i32("buffer count")?;
        let background = cursor.take(format.values.full_bytes, "background")?;
        let topology =
            Self { format, background, root_tiles: Vec::new(), nodes: Vec::new(), leaves: Vec::new() };
        let mut reader = Reader { topology, seen: FxHashSet::default() };
        reader.read_root(cursor)?;
        Ok(reader.topology)
    }
}

struct Reader<'a> {
    topology: Topology<'a>,
    seen: FxHashSet<[i32; 3]>,
}

impl<'a> Reader<'a> {
    fn read_root(&mut self, cursor: &mut Cursor<'a>) -> Result<(), VdbError> {
        let value_bytes = self.topology.format.values.full_bytes;
        let n_tiles = cursor.u32("root tile count")?;
        let n_children = cursor.u32("root child count")?;
        cursor.require(u64::from(n_tiles) * (12 + value_bytes as u64 + 1), "root tiles")?;
        for _ in 0..n_tiles {
            let origin = self.read_root_origin(cursor)?;
            let value = cursor.take(value_bytes, "root tile")?;
            let active = cursor.u8("root tile")? != 0;
            self.topology.root_tiles.push(RootTile { origin, value, active });
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
                self.topology.leaves.push(LeafStub { origin, active });
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
        let format = &self.topology.format;
        let n_slots = level.n_slots();
        let children = Mask(cursor.take(n_slots / 8, "child mask")?);
        let active = Mask(cursor.take(n_slots / 8, "value mask")?);
        let n_values =
            if format.version >= VERSION_NODE_MASKS { n_slots } else { n_slots - children.count_on() };
        let block = Block::locate(cursor, format, active, n_values)?;
        self.topology.nodes.push(InternalNode { level, origin, children, active, block, n_values });
        Ok(children)
    }
}

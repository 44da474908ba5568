//! The tree of one grid in two passes: first locate every node, then decode values in parallel.
//!
//! The first pass is cheap, sequential and independent of the voxel type, so it also serves to step over grids in
//! stream files. After it, the number of leaves is known to be backed by bytes, and only then memory is allocated.

mod decode;
mod leaf;
mod topology;

use std::ops::Range;

use crate::VdbError;
use crate::codec::block::BlockFormat;
use crate::cursor::Cursor;
use crate::grid::{Leaf, Tile};
use crate::source::Source;
use crate::value::Value;
use topology::Topology;

/// Where a tree's bytes are and how they are stored.
#[derive(Debug)]
pub(crate) struct TreeSite {
    pub(crate) bytes: Range<usize>,
    /// Where the leaf buffers are said to begin.
    pub(crate) buffers_at: usize,
    pub(crate) format: BlockFormat,
}

/// A decoded tree.
#[derive(Debug)]
pub(crate) struct Tree<T> {
    pub(crate) background: T,
    pub(crate) tiles: Vec<Tile<T>>,
    pub(crate) leaves: Vec<Leaf<T>>,
}

/// Decodes a tree whose voxels are of type `T`, converting each value.
pub(crate) fn read<T: Value, U: Value>(
    source: &Source,
    site: &TreeSite,
    convert: impl Fn(T) -> U + Sync,
) -> Result<Tree<U>, VdbError> {
    let Range { start, end } = site.bytes;
    let front = source.bytes(start..site.buffers_at)?;
    let whole;
    let mut cursor = Cursor::new(&front, start);
    let topology = match Topology::read(&mut cursor, site.format) {
        // The buffers begin later than said.
        Err(VdbError::Truncated { .. }) if start + front.len() < end => {
            whole = source.bytes(start..end)?;
            cursor = Cursor::new(&whole, start);
            Topology::read(&mut cursor, site.format)?
        }
        topology => topology?,
    };
    let window = source.window(cursor.offset()..end);
    Ok(Tree {
        background: convert(topology.background::<T>()),
        tiles: topology.decode_tiles(&convert)?,
        leaves: topology.decode_leaves(window, &convert)?,
    })
}

/// The position behind a tree's last byte.
pub(crate) fn find_end(source: &Source, site: &TreeSite) -> Result<usize, VdbError> {
    let bytes = source.bytes(site.bytes.clone())?;
    let mut cursor = Cursor::new(&bytes, site.bytes.start);
    Topology::read(&mut cursor, site.format)?.skip_leaves(&mut cursor)?;
    Ok(cursor.offset())
}

/// Side of a root entry's cube is `1 << ROOT_LOG2` voxels.
pub(crate) const ROOT_LOG2: u8 = 12;
/// Side of an upper internal node's children and tiles (32³ of them).
pub(crate) const UPPER_LOG2: u8 = 7;
/// Side of a lower internal node's children and tiles (16³ of them): a leaf.
pub(crate) const LOWER_LOG2: u8 = 3;

/// The two kinds of internal node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Level {
    /// 32³ slots of side 128.
    Upper,
    /// 16³ slots of side 8.
    Lower,
}

impl Level {
    /// log2 of the slots per axis.
    pub(crate) fn slots_log2(self) -> u32 {
        match self {
            Self::Upper => u32::from(ROOT_LOG2 - UPPER_LOG2),
            Self::Lower => u32::from(UPPER_LOG2 - LOWER_LOG2),
        }
    }

    /// log2 of a slot's side in voxels.
    pub(crate) fn slot_side_log2(self) -> u8 {
        match self {
            Self::Upper => UPPER_LOG2,
            Self::Lower => LOWER_LOG2,
        }
    }

    /// Number of slots.
    pub(crate) fn n_slots(self) -> usize {
        1 << (3 * self.slots_log2())
    }

    /// Lowest voxel of a slot; slots are numbered with z fastest.
    pub(crate) fn slot_origin(self, node_origin: [i32; 3], slot: usize) -> [i32; 3] {
        let (log2, side) = (self.slots_log2(), self.slot_side_log2());
        let axis_mask = (1 << log2) - 1;
        let local = [slot >> (2 * log2), slot >> log2 & axis_mask, slot & axis_mask];
        std::array::from_fn(|axis| node_origin[axis] + ((local[axis] as i32) << side))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_cover_the_node() {
        assert_eq!(Level::Upper.n_slots(), 32768);
        assert_eq!(Level::Lower.n_slots(), 4096);
        assert_eq!(Level::Upper.slot_origin([-4096, 0, 4096], 1), [-4096, 0, 4096 + 128]);
        assert_eq!(Level::Upper.slot_origin([0; 3], 32767), [4096 - 128; 3]);
        assert_eq!(Level::Lower.slot_origin([0; 3], 16), [0, 8, 0]);
        assert_eq!(Level::Lower.slot_origin([i32::MAX - 127; 3], 4095), [i32::MAX - 7; 3]);
    }
}

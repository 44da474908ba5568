//! A leaf's part of the buffer pass: found first, one after the other; decoded later, in parallel.

use super::topology::{LEAF_MASK_BYTES, LeafStub};
use crate::VdbError;
use crate::codec::Scratch;
use crate::codec::block::{Block, BlockFormat};
use crate::cursor::Cursor;
use crate::grid::{LEAF_VOXELS, Leaf};
use crate::header::VERSION_NODE_MASKS;
use crate::mask::Mask;
use crate::value::{LeafLayout, Value};

/// Bytes of a leaf's origin, where it is repeated.
const ORIGIN_BYTES: usize = 12;

/// Where a leaf's values are.
#[derive(Debug)]
pub(super) struct LeafSite<'a> {
    origin: [i32; 3],
    active: Mask<'a>,
    values: LeafValues<'a>,
}

#[derive(Debug)]
enum LeafValues<'a> {
    Block(Block<'a>),
    /// One bit per voxel.
    Bits(Mask<'a>),
}

impl<'a> LeafSite<'a> {
    /// The fewest bytes a leaf takes in the buffer pass.
    pub(super) const LEAST_BYTES: usize = LEAF_MASK_BYTES + 1;

    /// Steps over a leaf's buffers.
    pub(super) fn locate<'c: 'a>(
        cursor: &mut Cursor<'c>,
        format: &BlockFormat,
        leaf: &LeafStub<'a>,
    ) -> Result<Self, VdbError> {
        // The topology had the same mask.
        cursor.take(LEAF_MASK_BYTES, "leaf mask")?;
        let values = match format.values.leaf {
            LeafLayout::Block => LeafValues::Block(locate_block(cursor, format, leaf.active)?),
            LeafLayout::Bits => {
                cursor.take(ORIGIN_BYTES, "leaf origin")?;
                LeafValues::Bits(Mask(cursor.take(LEAF_MASK_BYTES, "leaf values")?))
            }
            LeafLayout::MaskOnly => {
                cursor.take(ORIGIN_BYTES, "leaf origin")?;
                LeafValues::Bits(leaf.active)
            }
        };
        Ok(Self { origin: leaf.origin, active: leaf.active, values })
    }

    pub(super) fn decode<T: Value, U: Value>(
        &self,
        is_half: bool,
        background: T,
        convert: impl Fn(T) -> U,
        scratch: &mut Scratch,
    ) -> Result<Leaf<U>, VdbError> {
        let mut values = [background; LEAF_VOXELS];
        match &self.values {
            LeafValues::Block(block) => {
                block.decode(is_half, self.active, background, &mut values, scratch)?;
            }
            LeafValues::Bits(bits) => {
                let bytes: [u8; LEAF_VOXELS] = std::array::from_fn(|i| u8::from(bits.is_on(i)));
                T::read_full(&bytes, &mut values);
            }
        }
        let mut leaf = Leaf::uniform(self.origin, convert(background));
        leaf.active.iter_mut().zip(self.active.words()).for_each(|(word, stored)| *word = stored);
        leaf.values.iter_mut().zip(values).for_each(|(slot, value)| *slot = convert(value));
        Ok(leaf)
    }
}

/// Before version 222 origin and number of buffers come first. Extra buffers are stepped over.
fn locate_block<'a>(
    cursor: &mut Cursor<'a>,
    format: &BlockFormat,
    active: Mask<'_>,
) -> Result<Block<'a>, VdbError> {
    let mut n_buffers = 1;
    if format.version < VERSION_NODE_MASKS {
        cursor.take(ORIGIN_BYTES, "leaf origin")?;
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

//! The tree of one grid: internal nodes first, one after the other, then leaves in parallel.
//!
//! Nodes of one level lie side by side, and every one is reached from exactly one place. Both are checked, so that a
//! small file cannot stand for a large tree.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::image::{GridHead, HEAD_BYTES, Image};
use super::layout::{
    ALIGNMENT, CODES_AT, LEAF_FLAGS_AT, LEAF_MASK_AT, LEAF_MASK_BYTES, LEAF_TAIL_AT, Layout, LeafKind,
    NODE_MASKS_AT,
};
use super::quantized::dequantize;
use crate::VdbError;
use crate::grid::{LEAF_VOXELS, Leaf, Tile};
use crate::mask::Mask;
use crate::tree::{Level, ROOT_LOG2, Tree};
use crate::value::Value;

/// The structure behind [`HEAD_BYTES`]: offsets to leaves, lower nodes, upper nodes and root, then the counts of the
/// first three.
const TREE_AT: usize = HEAD_BYTES;
const COUNTS_AT: usize = TREE_AT + 32;
/// Leaves per rayon task.
const LEAVES_PER_TASK: usize = 64;

/// Decodes a grid whose voxels are of type `T`, converting each value.
pub(super) fn read<T: Value, U: Value>(
    image: &Image<'_>,
    head: &GridHead,
    name: &str,
    convert: impl Fn(T) -> U + Sync,
) -> Result<Tree<U>, VdbError> {
    let layout = head
        .layout
        .filter(|_| head.value_type == T::TYPE || layout_is_mask_as_bool::<T>(head))
        .ok_or_else(|| VdbError::unsupported(name, format!("it is a {} grid", head.value_type)))?;
    let mut walk = Walk::<T>::new(image, layout)?;
    walk.root()?;
    let Walk { background, tiles, leaves, .. } = walk;
    let convert_tile = |tile: Tile<T>| {
        let Tile { origin, size_log2, value, active } = tile;
        Tile { origin, size_log2, value: convert(value), active }
    };
    let decode = |leaf: &LeafSite| decode_leaf(image, &layout, leaf, &convert);
    Ok(Tree {
        background: convert(background),
        tiles: tiles.into_iter().map(convert_tile).collect(),
        leaves: decode_leaves(&leaves, convert(background), decode)?,
    })
}

fn layout_is_mask_as_bool<T: Value>(head: &GridHead) -> bool {
    use crate::value::ValueType::{Bool, Mask};
    head.value_type == Mask && T::TYPE == Bool
}

/// A leaf whose place in the tree is known and whose bytes are there.
struct LeafSite {
    origin: [i32; 3],
    offset: usize,
    /// Of a code, in quantized leaves.
    bits: usize,
}

struct Walk<'a, T> {
    image: &'a Image<'a>,
    layout: Layout,
    root_at: usize,
    uppers: Pool,
    lowers: Pool,
    leaf_pool: Pool,
    background: T,
    tiles: Vec<Tile<T>>,
    leaves: Vec<LeafSite>,
}

impl<'a, T: Value> Walk<'a, T> {
    fn new(image: &'a Image<'a>, layout: Layout) -> Result<Self, VdbError> {
        let root_at = image.follow(TREE_AT, image.i64(TREE_AT + 24)?)?;
        let background = T::from_full(image.bytes(root_at + layout.background_at(), layout.value_bytes)?);
        Ok(Self {
            image,
            layout,
            root_at,
            uppers: Pool::new(image, 2, Some(layout.node_bytes(Level::Upper)))?,
            lowers: Pool::new(image, 1, Some(layout.node_bytes(Level::Lower)))?,
            leaf_pool: Pool::new(image, 0, layout.leaf_bytes())?,
            background,
            tiles: Vec::new(),
            leaves: Vec::new(),
        })
    }

    fn root(&mut self) -> Result<(), VdbError> {
        let entry_bytes = self.layout.root_entry_bytes();
        let n_entries = self.image.u32(self.root_at + 24)? as usize;
        let table_at = self.root_at + self.layout.root_bytes();
        let table_bytes = n_entries.saturating_mul(entry_bytes);
        self.image.bytes(table_at, table_bytes)?;
        let mut seen = FxHashSet::default();
        for entry_at in (0..n_entries).map(|i| table_at + i * entry_bytes) {
            let origin = root_origin(self.image.u64(entry_at)?);
            if !seen.insert(origin) {
                return Err(self.image.corrupt(format!("two root entries at {origin:?}")));
            }
            let child = self.image.i64(entry_at + 8)?;
            if child != 0 {
                let offset = self.uppers.take(self.image, self.image.follow(self.root_at, child)?)?;
                self.node(Level::Upper, origin, offset)?;
                continue;
            }
            let active = self.image.u32(entry_at + 16)? != 0;
            let value_at = entry_at + self.layout.root_value_at();
            let value = T::from_full(self.image.bytes(value_at, self.layout.value_bytes)?);
            self.keep(Tile { origin, size_log2: ROOT_LOG2, value, active });
        }
        Ok(())
    }

    /// An upper node and everything below it, or a lower one.
    fn node(&mut self, level: Level, origin: [i32; 3], offset: usize) -> Result<(), VdbError> {
        let (n_slots, image) = (level.n_slots(), self.image);
        let active = Mask(image.bytes(offset + NODE_MASKS_AT, n_slots / 8)?);
        let children = Mask(image.bytes(offset + NODE_MASKS_AT + n_slots / 8, n_slots / 8)?);
        let entry_bytes = self.layout.table_entry_bytes();
        let table = image.bytes(offset + self.layout.table_at(level), n_slots * entry_bytes)?;
        for (slot, entry) in table.chunks_exact(entry_bytes).enumerate() {
            let slot_origin = level.slot_origin(origin, slot);
            if !children.is_on(slot) {
                let (value, active) = (T::from_full(entry), active.is_on(slot));
                self.keep(Tile { origin: slot_origin, size_log2: level.slot_side_log2(), value, active });
                continue;
            }
            let child = entry.first_chunk().map_or(0, |bytes| i64::from_le_bytes(*bytes));
            let child_at = image.follow(offset, child)?;
            match level {
                Level::Upper => {
                    let child_at = self.lowers.take(image, child_at)?;
                    self.node(Level::Lower, slot_origin, child_at)?;
                }
                Level::Lower => self.leaf(slot_origin, child_at)?,
            }
        }
        Ok(())
    }

    fn leaf(&mut self, origin: [i32; 3], offset: usize) -> Result<(), VdbError> {
        let offset = self.leaf_pool.take(self.image, offset)?;
        let mut bits = 0;
        if let LeafKind::Quantized(fixed) = self.layout.leaf {
            bits = fixed;
        }
        if self.layout.leaf == LeafKind::QuantizedByLeaf {
            let [flags] = self.image.array(offset + LEAF_FLAGS_AT)?;
            bits = 1 << (flags >> 5);
            if bits > 16 {
                return Err(self.image.corrupt(format!("a NanoVDB leaf with codes of {bits} bits")));
            }
            self.image.bytes(offset, CODES_AT + bits * LEAF_MASK_BYTES)?;
        }
        self.leaves.push(LeafSite { origin, offset, bits });
        Ok(())
    }

    fn keep(&mut self, tile: Tile<T>) {
        self.tiles.extend(Some(tile).filter(|tile| tile.differs_from(self.background)));
    }
}

/// x, y and z of a root entry in units of its side, in 21 bits each.
fn root_origin(key: u64) -> [i32; 3] {
    // Twenty bits are enough; the upper ones of negative coordinates are cut off by the shift.
    [42, 21, 0].map(|shift| ((key >> shift) as u32) << ROOT_LOG2).map(|c| c as i32)
}

/// The nodes of one level.
struct Pool {
    first: usize,
    /// `None` if they differ in size.
    node_bytes: Option<usize>,
    /// Which are in use, by number, or by offset if they differ in size.
    taken: Vec<bool>,
    taken_offsets: FxHashSet<usize>,
}

impl Pool {
    /// Level 0 are the leaves. All nodes must be inside the image.
    fn new(image: &Image<'_>, level: usize, node_bytes: Option<usize>) -> Result<Self, VdbError> {
        let first = image.follow(TREE_AT, image.i64(TREE_AT + 8 * level)?)?;
        let count = image.u32(COUNTS_AT + 4 * level)? as usize;
        let least = node_bytes.unwrap_or(CODES_AT);
        if count > 0 {
            image.bytes(first, count.saturating_mul(least))?;
        }
        let taken = if node_bytes.is_some() { vec![false; count] } else { Vec::new() };
        Ok(Self { first, node_bytes, taken, taken_offsets: FxHashSet::default() })
    }

    /// The same offset, if an unused node is there.
    fn take(&mut self, image: &Image<'_>, offset: usize) -> Result<usize, VdbError> {
        let is_free = match self.node_bytes {
            Some(node_bytes) => {
                let number =
                    offset.checked_sub(self.first).filter(|distance| distance.is_multiple_of(node_bytes));
                let taken = number.and_then(|distance| self.taken.get_mut(distance / node_bytes));
                taken.is_some_and(|taken| !std::mem::replace(taken, true))
            }
            None => offset.is_multiple_of(ALIGNMENT) && self.taken_offsets.insert(offset),
        };
        if is_free {
            return Ok(offset);
        }
        Err(image.corrupt("nodes of a NanoVDB grid overlap or are not side by side"))
    }
}

fn decode_leaves<U: Value>(
    sites: &[LeafSite],
    background: U,
    decode: impl Fn(&LeafSite) -> Result<Leaf<U>, VdbError> + Sync,
) -> Result<Vec<Leaf<U>>, VdbError> {
    let bytes = sites.len().saturating_mul(size_of::<Leaf<U>>()) as u64;
    let mut leaves = Vec::new();
    leaves.try_reserve_exact(sites.len()).map_err(|_| VdbError::OutOfMemory { bytes })?;
    // All bytes are known to be there, so decoding doesn't fail and needs no way to say so.
    let decoded = sites.par_iter().with_min_len(LEAVES_PER_TASK);
    leaves.par_extend(decoded.map(|site| decode(site).unwrap_or(Leaf::uniform(site.origin, background))));
    Ok(leaves)
}

fn decode_leaf<T: Value, U: Value>(
    image: &Image<'_>,
    layout: &Layout,
    site: &LeafSite,
    convert: impl Fn(T) -> U,
) -> Result<Leaf<U>, VdbError> {
    let active = Mask(image.bytes(site.offset + LEAF_MASK_AT, LEAF_MASK_BYTES)?);
    let mut values = [T::default(); LEAF_VOXELS];
    let values_at = site.offset + layout.leaf_values_at();
    match layout.leaf {
        LeafKind::Values => {
            T::read_full(image.bytes(values_at, LEAF_VOXELS * layout.value_bytes)?, &mut values)
        }
        LeafKind::Bits => read_bits(Mask(image.bytes(values_at, LEAF_MASK_BYTES)?), &mut values),
        LeafKind::MaskOnly => read_bits(active, &mut values),
        LeafKind::Quantized(_) | LeafKind::QuantizedByLeaf => {
            let number = |at| image.array(site.offset + at).map(f32::from_le_bytes);
            let (offset, step) = (number(LEAF_TAIL_AT)?, number(LEAF_TAIL_AT + 4)?);
            let codes = image.bytes(values_at, site.bits * LEAF_MASK_BYTES)?;
            let floats = dequantize(codes, site.bits, step, offset);
            // `T` is `f32` here, which only its bytes can tell.
            T::read_full(floats.map(f32::to_le_bytes).as_flattened(), &mut values);
        }
    }
    let mut leaf = Leaf::uniform(site.origin, convert(T::default()));
    leaf.active.iter_mut().zip(active.words()).for_each(|(word, stored)| *word = stored);
    leaf.values.iter_mut().zip(values).for_each(|(slot, value)| *slot = convert(value));
    Ok(leaf)
}

fn read_bits<T: Value>(bits: Mask<'_>, values: &mut [T]) {
    let bytes: [u8; LEAF_VOXELS] = std::array::from_fn(|i| u8::from(bits.is_on(i)));
    T::read_full(&bytes, values);
}

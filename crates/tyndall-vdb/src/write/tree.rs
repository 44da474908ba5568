//! A flat grid back into a tree's bytes.

use std::collections::BTreeMap;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::WriteCompression;
use crate::VdbError;
use crate::grid::{Grid, Leaf, Tile};
use crate::tree::{LOWER_LOG2, Level, ROOT_LOG2, UPPER_LOG2};
use crate::value::Value;

/// "No mask or inactive values": only active values follow, all others are the background.
const CODE_BACKGROUND: u8 = 0;
/// "No mask and all values".
const CODE_ALL_VALUES: u8 = 6;

/// The two parts of a stored tree.
pub(super) struct TreeBytes {
    pub(super) topology: Vec<u8>,
    pub(super) buffers: Vec<u8>,
}

/// A type of values that can be written.
pub(super) trait Stored: Value {
    /// Appends the full-size little-endian bytes.
    fn put(self, out: &mut Vec<u8>);
}

impl Stored for f32 {
    fn put(self, out: &mut Vec<u8>) {
        out.extend(self.to_le_bytes());
    }
}

impl Stored for [f32; 3] {
    fn put(self, out: &mut Vec<u8>) {
        self.iter().for_each(|component| component.put(out));
    }
}

/// What is at one slot of an internal node.
enum Entry<'a, T> {
    Lower(Slots<'a, T>),
    Leaf(&'a Leaf<T>),
    Tile(&'a Tile<T>),
}

type Slots<'a, T> = BTreeMap<usize, Entry<'a, T>>;

/// All entries of a root in ascending order, which is the order of the file.
struct Root<'a, T> {
    tiles: BTreeMap<[i32; 3], &'a Tile<T>>,
    children: BTreeMap<[i32; 3], Slots<'a, T>>,
}

pub(super) fn tree_bytes<T: Stored>(
    grid: &Grid<T>,
    compression: WriteCompression,
) -> Result<TreeBytes, VdbError> {
    let root = Root::of(grid).map_err(|what| VdbError::InvalidGrid { name: grid.name.clone(), what })?;
    let mut writer =
        TreeWriter { background: grid.background, compression, topology: Vec::new(), leaves: Vec::new() };
    writer.root(&root);
    let TreeWriter { topology, leaves, .. } = writer;
    let blocks: Vec<Vec<u8>> =
        leaves.par_iter().map(|leaf| leaf_bytes(leaf, grid.background, compression)).collect();
    Ok(TreeBytes { topology, buffers: blocks.concat() })
}

impl<'a, T: Stored> Root<'a, T> {
    fn of(grid: &'a Grid<T>) -> Result<Self, String> {
        let mut root = Self { tiles: BTreeMap::new(), children: BTreeMap::new() };
        for leaf in &grid.leaves {
            root.insert(leaf.origin, LOWER_LOG2, Entry::Leaf(leaf))?;
        }
        for tile in &grid.tiles {
            if !matches!(tile.size_log2, LOWER_LOG2 | UPPER_LOG2 | ROOT_LOG2) {
                return Err(format!("tile at {:?} has a side of 2^{}", tile.origin, tile.size_log2));
            }
            root.insert(tile.origin, tile.size_log2, Entry::Tile(tile))?;
        }
        Ok(root)
    }

    fn insert(&mut self, origin: [i32; 3], size_log2: u8, entry: Entry<'a, T>) -> Result<(), String> {
        if origin.iter().any(|c| c.trailing_zeros() < u32::from(size_log2)) {
            return Err(format!("leaf or tile at {origin:?} is off its lattice"));
        }
        let overlap = || format!("two leaves or tiles at {origin:?}");
        let key = origin.map(|c| c >> ROOT_LOG2 << ROOT_LOG2);
        if let (Entry::Tile(tile), ROOT_LOG2) = (&entry, size_log2) {
            let is_free = !self.children.contains_key(&key) && self.tiles.insert(key, tile).is_none();
            return if is_free { Ok(()) } else { Err(overlap()) };
        }
        if self.tiles.contains_key(&key) {
            return Err(overlap());
        }
        let mut slots = self.children.entry(key).or_default();
        let mut slot = slot_of(Level::Upper, origin);
        if size_log2 == LOWER_LOG2 {
            let lower = slots.entry(slot).or_insert_with(|| Entry::Lower(Slots::default()));
            let Entry::Lower(lower) = lower else { return Err(overlap()) };
            (slots, slot) = (lower, slot_of(Level::Lower, origin));
        }
        if slots.insert(slot, entry).is_some() { Err(overlap()) } else { Ok(()) }
    }
}

/// Number of the slot that contains a voxel, in the node of that level around it.
fn slot_of(level: Level, voxel: [i32; 3]) -> usize {
    let axis_mask = (1 << level.slots_log2()) - 1;
    voxel
        .iter()
        .fold(0, |slot, c| slot << level.slots_log2() | (c >> level.slot_side_log2() & axis_mask) as usize)
}

struct TreeWriter<'a, T> {
    background: T,
    compression: WriteCompression,
    topology: Vec<u8>,
    /// In the order in which their buffers follow.
    leaves: Vec<&'a Leaf<T>>,
}

impl<'a, T: Stored> TreeWriter<'a, T> {
    fn root(&mut self, root: &Root<'a, T>) {
        self.topology.extend(1_i32.to_le_bytes());
        self.background.put(&mut self.topology);
        // Root keys are distinct multiples of 4096: at most 2^60, but every one is backed by memory here.
        self.topology.extend((root.tiles.len() as u32).to_le_bytes());
        self.topology.extend((root.children.len() as u32).to_le_bytes());
        for (origin, tile) in &root.tiles {
            self.origin(*origin);
            tile.value.put(&mut self.topology);
            self.topology.push(u8::from(tile.active));
        }
        for (origin, slots) in &root.children {
            self.origin(*origin);
            self.node(Level::Upper, slots);
            for entry in slots.values() {
                let Entry::Lower(lower) = entry else { continue };
                self.node(Level::Lower, lower);
                self.leaf_masks(lower);
            }
        }
    }

    fn origin(&mut self, origin: [i32; 3]) {
        self.topology.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
    }

    /// Child mask, value mask and tile values.
    fn node(&mut self, level: Level, slots: &Slots<'a, T>) {
        let mut children = vec![0_u8; level.n_slots() / 8];
        let mut active = children.clone();
        let mut values = vec![self.background; level.n_slots()];
        let mut are_inactive_background = true;
        for (&slot, entry) in slots {
            match entry {
                Entry::Tile(tile) => {
                    values[slot] = tile.value;
                    active[slot / 8] |= u8::from(tile.active) << (slot % 8);
                    are_inactive_background &= tile.active || tile.value == self.background;
                }
                Entry::Lower(_) | Entry::Leaf(_) => children[slot / 8] |= 1 << (slot % 8),
            }
        }
        if are_inactive_background {
            let is_active = |slot: usize| active[slot / 8] >> (slot % 8) & 1 == 1;
            values = (0..level.n_slots()).filter(|&slot| is_active(slot)).map(|slot| values[slot]).collect();
        }
        self.topology.extend(children);
        self.topology.extend(active);
        self.topology.push(if are_inactive_background { CODE_BACKGROUND } else { CODE_ALL_VALUES });
        pack(&values, self.compression, &mut self.topology);
    }

    fn leaf_masks(&mut self, lower: &Slots<'a, T>) {
        for entry in lower.values() {
            if let Entry::Leaf(leaf) = entry {
                self.topology.extend(mask_bytes(leaf));
                self.leaves.push(leaf);
            }
        }
    }
}

fn mask_bytes<T>(leaf: &Leaf<T>) -> impl Iterator<Item = u8> {
    leaf.active.into_iter().flat_map(u64::to_le_bytes)
}

/// A leaf in the buffer pass: its mask again, then values.
fn leaf_bytes<T: Stored>(leaf: &Leaf<T>, background: T, compression: WriteCompression) -> Vec<u8> {
    let mut out: Vec<u8> = mask_bytes(leaf).collect();
    let is_active = |offset: usize| leaf.active[offset >> 6] >> (offset & 63) & 1 == 1;
    let values = leaf.values.iter().enumerate();
    if values.clone().all(|(offset, &value)| is_active(offset) || value == background) {
        out.push(CODE_BACKGROUND);
        let active: Vec<T> = leaf.active_offsets().map(|offset| leaf.values[offset]).collect();
        pack(&active, compression, &mut out);
    } else {
        out.push(CODE_ALL_VALUES);
        pack(&leaf.values, compression, &mut out);
    }
    out
}

/// Appends values, zipped if that is smaller: then after a positive size, otherwise after a negative one.
fn pack<T: Stored>(values: &[T], compression: WriteCompression, out: &mut Vec<u8>) {
    let mut bytes = Vec::with_capacity(size_of_val(values));
    values.iter().for_each(|value| value.put(&mut bytes));
    if compression == WriteCompression::None {
        out.extend(bytes);
        return;
    }
    // Node values are at most 384 kB: sizes fit.
    match zip(&bytes).filter(|zipped| zipped.len() < bytes.len()) {
        Some(zipped) => {
            out.extend((zipped.len() as i64).to_le_bytes());
            out.extend(zipped);
        }
        None => {
            out.extend((-(bytes.len() as i64)).to_le_bytes());
            out.extend(bytes);
        }
    }
}

/// `None` if zlib fails, which writing to memory does not.
fn zip(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).ok()?;
    encoder.finish().ok()
}

//! Second pass: values. Internal nodes become tiles; leaves are unpacked in parallel into one flat allocation.

use std::sync::Mutex;

use rayon::prelude::*;

use super::leaf::LeafSite;
use super::topology::{InternalNode, LeafStub, Topology};
use super::{Level, ROOT_LOG2};
use crate::VdbError;
use crate::codec::Scratch;
use crate::codec::block::BlockFormat;
use crate::cursor::Cursor;
use crate::grid::{Leaf, Tile};
use crate::source::Window;
use crate::value::Value;

/// Fewest leaves per rayon task: some ten microseconds of work.
const LEAVES_PER_TASK: usize = 8;

impl Topology<'_> {
    pub(super) fn background<T: Value>(&self) -> T {
        T::from_full(self.background)
    }

    /// All tiles that differ from inactive background.
    pub(super) fn decode_tiles<T: Value, U: Value>(
        &self,
        convert: impl Fn(T) -> U,
    ) -> Result<Vec<Tile<U>>, VdbError> {
        let background = self.background::<T>();
        let mut tiles = Vec::new();
        let mut keep = |tile: Tile<T>| {
            let Tile { origin, size_log2, value, active } = tile;
            if tile.differs_from(background) {
                tiles.push(Tile { origin, size_log2, value: convert(value), active });
            }
        };
        for root in &self.root_tiles {
            let value = T::from_full(root.value);
            keep(Tile { origin: root.origin, size_log2: ROOT_LOG2, value, active: root.active });
        }
        let mut values = vec![T::default(); Level::Upper.n_slots()];
        let mut scratch = Scratch::default();
        for node in &self.nodes {
            let values = &mut values[..node.n_values];
            node.block.decode(self.format.values.is_half, node.active, background, values, &mut scratch)?;
            node_tiles(node, values).for_each(&mut keep);
        }
        Ok(tiles)
    }

    /// All leaves, in file order, from the buffers at the window's start. Each is found and decoded once; the window
    /// moves on when its leaves are done.
    pub(super) fn decode_leaves<T: Value, U: Value>(
        &self,
        mut window: Window<'_>,
        convert: impl Fn(T) -> U + Sync,
    ) -> Result<Vec<Leaf<U>>, VdbError> {
        let mut leaves = room_for(self.leaves.len(), &window)?;
        let background = self.background::<T>();
        while leaves.len() < self.leaves.len() {
            let (at, remaining) = (window.offset(), window.remaining());
            let bytes = window.load()?;
            let is_last = bytes.len() == remaining;
            let mut cursor = Cursor::new(bytes, at);
            let sites = locate_leaves(&mut cursor, &self.format, &self.leaves[leaves.len()..], is_last)?;
            decode_all(&sites, &mut leaves, |site, scratch| {
                site.decode(self.format.values.is_half, background, &convert, scratch)
            })?;
            let (is_stuck, next_at) = (sites.is_empty(), cursor.offset());
            window.advance_to(next_at);
            if is_stuck {
                window.grow();
            }
        }
        Ok(leaves)
    }

    /// Steps over all leaf buffers.
    pub(super) fn skip_leaves(&self, cursor: &mut Cursor<'_>) -> Result<(), VdbError> {
        for leaf in &self.leaves {
            LeafSite::locate(cursor, &self.format, leaf)?;
        }
        Ok(())
    }
}

/// An empty list with room for `n` leaves, if the bytes that are left can hold as many.
fn room_for<U>(n: usize, window: &Window<'_>) -> Result<Vec<Leaf<U>>, VdbError> {
    let (needed, available) = ((n * LeafSite::LEAST_BYTES) as u64, window.remaining());
    if needed > available as u64 {
        return Err(VdbError::Truncated { what: "leaf buffers", offset: window.offset(), needed, available });
    }
    let mut leaves = Vec::new();
    let bytes = n.saturating_mul(size_of::<Leaf<U>>()) as u64;
    leaves.try_reserve_exact(n).map_err(|_| VdbError::OutOfMemory { bytes })?;
    Ok(leaves)
}

/// As many leaves as the cursor's bytes hold whole; it is left behind them. All must be there if these are the last
/// bytes.
fn locate_leaves<'a>(
    cursor: &mut Cursor<'a>,
    format: &BlockFormat,
    leaves: &[LeafStub<'a>],
    is_last: bool,
) -> Result<Vec<LeafSite<'a>>, VdbError> {
    let mut sites = Vec::new();
    for leaf in leaves {
        let mut ahead = cursor.clone();
        match LeafSite::locate(&mut ahead, format, leaf) {
            Ok(site) => sites.push(site),
            Err(VdbError::Truncated { .. }) if !is_last => break,
            Err(error) => return Err(error),
        }
        *cursor = ahead;
    }
    Ok(sites)
}

/// Appends what `decode` makes of each site, in order, in place. After an error the list's end is undefined.
fn decode_all<S: Sync, U: Value>(
    sites: &[S],
    leaves: &mut Vec<Leaf<U>>,
    decode: impl Fn(&S, &mut Scratch) -> Result<Leaf<U>, VdbError> + Sync,
) -> Result<(), VdbError> {
    // Collecting results would build many lists and join them. Of several errors any is reported.
    let failure = Mutex::new(None);
    let decoded =
        sites.par_iter().with_min_len(LEAVES_PER_TASK).map_init(Scratch::default, |scratch, site| {
            decode(site, scratch).unwrap_or_else(|error| {
                if let Ok(mut failure) = failure.lock() {
                    *failure = Some(error);
                }
                Leaf::uniform([0; 3], U::default())
            })
        });
    leaves.par_extend(decoded);
    failure.into_inner().ok().flatten().map_or(Ok(()), Err)
}

/// One tile per slot without a child.
fn node_tiles<'a, T: Value>(
    node: &'a InternalNode<'_>,
    values: &'a [T],
) -> impl Iterator<Item = Tile<T>> + 'a {
    let stores_children = node.n_values == node.level.n_slots();
    let mut values = values.iter().copied();
    (0..node.level.n_slots()).filter_map(move |slot| {
        let is_child = node.children.is_on(slot);
        if is_child && !stores_children {
            return None;
        }
        let value = values.next()?;
        let tile = Tile {
            origin: node.level.slot_origin(node.origin, slot),
            size_log2: node.level.slot_side_log2(),
            value,
            active: node.active.is_on(slot),
        };
        (!is_child).then_some(tile)
    })
}

//! Second pass: values. Internal nodes become tiles; leaves are unpacked in parallel into one flat allocation.

use rayon::prelude::*;

use super::skeleton::{InternalNode, LeafSite, Skeleton};
use super::{Level, ROOT_LOG2};
use crate::VdbError;
use crate::codec::Scratch;
use crate::grid::{Leaf, Tile};
use crate::value::Value;

/// Leaves per rayon task: small grids stay on one thread.
const LEAVES_PER_TASK: usize = 64;

impl Skeleton<'_> {
    pub(crate) fn background<T: Value>(&self) -> T {
        T::from_full(self.background)
    }

    /// All tiles that differ from inactive background.
    pub(crate) fn decode_tiles<T: Value>(&self) -> Result<Vec<Tile<T>>, VdbError> {
        let background = self.background::<T>();
        let mut tiles = Vec::new();
        for root in &self.root_tiles {
            let tile = Tile {
                origin: root.origin,
                size_log2: ROOT_LOG2,
                value: T::from_full(root.value),
                active: root.active,
            };
            tiles.extend(Some(tile).filter(|tile| tile.differs_from(background)));
        }
        let mut values = vec![T::default(); Level::Upper.n_slots()];
        let mut scratch = Scratch::default();
        for node in &self.nodes {
            let values = &mut values[..node.n_values];
            node.block.decode(self.format.values.is_half, node.active, background, values, &mut scratch)?;
            tiles.extend(node_tiles(node, values).filter(|tile| tile.differs_from(background)));
        }
        Ok(tiles)
    }

    /// All leaves, in file order.
    pub(crate) fn decode_leaves<T: Value>(&self) -> Result<Vec<Leaf<T>>, VdbError> {
        let background = self.background::<T>();
        let mut leaves = vec![Leaf::uniform([0; 3], background); self.leaves.len()];
        leaves
            .par_iter_mut()
            .zip(&self.leaves)
            .with_min_len(LEAVES_PER_TASK)
            .try_for_each_init(Scratch::default, |scratch, (leaf, site)| {
                self.decode_leaf(site, background, leaf, scratch)
            })?;
        Ok(leaves)
    }

    fn decode_leaf<T: Value>(
        &self,
        site: &LeafSite<'_>,
        background: T,
        leaf: &mut Leaf<T>,
        scratch: &mut Scratch,
    ) -> Result<(), VdbError> {
        leaf.origin = site.origin;
        leaf.active.iter_mut().zip(site.active.words()).for_each(|(word, stored)| *word = stored);
        site.block.decode(self.format.values.is_half, site.active, background, &mut leaf.values, scratch)
    }
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

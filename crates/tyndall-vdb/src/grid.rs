//! A decoded grid: leaves and tiles in plain arrays.

use std::sync::OnceLock;

use glam::DAffine3;
use rustc_hash::FxHashMap;

use crate::mask::on_bits;
use crate::metadata::{MetaValue, find};
use crate::tree::{LOWER_LOG2, ROOT_LOG2, UPPER_LOG2};
use crate::value::{Scalar, Value};

/// Voxels in a leaf, 8³.
pub const LEAF_VOXELS: usize = 512;

/// What a grid's values mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GridClass {
    /// Not said.
    #[default]
    Unknown,
    /// Signed distance, negative inside, in units of the file's world space.
    LevelSet,
    /// Density, temperature and the like: zero outside.
    FogVolume,
    /// Vectors whose components sit on voxel faces.
    Staggered,
}

impl GridClass {
    pub(crate) fn from_metadata(metadata: &[(String, MetaValue)]) -> Self {
        match find(metadata, "class") {
            Some(MetaValue::String(class)) => match class.as_str() {
                "level set" => Self::LevelSet,
                "fog volume" => Self::FogVolume,
                "staggered" => Self::Staggered,
                _ => Self::Unknown,
            },
            _ => Self::Unknown,
        }
    }
}

/// A cube of 8³ voxels.
#[derive(Debug, Clone, PartialEq)]
pub struct Leaf<T = f32> {
    /// Lowest voxel; multiples of 8.
    pub origin: [i32; 3],
    /// Bit `i % 64` of word `i / 64` tells whether voxel `i` is active.
    pub active: [u64; 8],
    /// Voxel `(x, y, z)` of the leaf is at `x << 6 | y << 3 | z`; inactive voxels have values too.
    pub values: [T; LEAF_VOXELS],
}

impl<T: Value> Leaf<T> {
    /// A leaf without active voxels.
    pub fn uniform(origin: [i32; 3], value: T) -> Self {
        Self { origin, active: [0; 8], values: [value; LEAF_VOXELS] }
    }

    /// Number of active voxels.
    pub fn active_count(&self) -> u32 {
        self.active.iter().map(|word| word.count_ones()).sum()
    }

    /// Offsets of the active voxels, ascending.
    pub fn active_offsets(&self) -> impl Iterator<Item = usize> + '_ {
        self.active.iter().enumerate().flat_map(|(i, &word)| on_bits(word).map(move |bit| i * 64 + bit))
    }

    /// The voxel at `offset` in index space.
    pub fn voxel(&self, offset: usize) -> [i32; 3] {
        let local = [offset >> 6 & 7, offset >> 3 & 7, offset & 7];
        std::array::from_fn(|axis| self.origin[axis].saturating_add(local[axis] as i32))
    }
}

/// A cube of equal values without stored voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile<T = f32> {
    /// Lowest voxel; multiples of the side.
    pub origin: [i32; 3],
    /// The side is `1 << size_log2` voxels: 3, 7 or 12.
    pub size_log2: u8,
    /// Of every voxel inside.
    pub value: T,
    /// Inactive tiles are listed only if their value is not the background.
    pub active: bool,
}

impl<T: Value> Tile<T> {
    pub(crate) fn differs_from(&self, background: T) -> bool {
        self.active || self.value != background
    }

    /// Number of voxels inside, up to 2^36.
    pub fn voxel_count(&self) -> u64 {
        1 << (3 * u32::from(self.size_log2.min(ROOT_LOG2)))
    }

    /// Highest voxel inside.
    pub fn last_voxel(&self) -> [i32; 3] {
        let side_less_one = (1 << self.size_log2.min(ROOT_LOG2)) - 1;
        self.origin.map(|c| c.saturating_add(side_less_one))
    }
}

/// A sparse grid. Voxels in no leaf and no tile are inactive and have the background value.
#[derive(Debug, Clone)]
pub struct Grid<T = f32> {
    /// Name without suffix.
    pub name: String,
    /// What the values mean.
    pub class: GridClass,
    /// Value outside all leaves and tiles.
    pub background: T,
    /// Index space (voxel centres at integers) to the file's world space; finite, not checked to be invertible.
    pub file_from_index: DAffine3,
    /// Disjoint, in file order.
    pub leaves: Vec<Leaf<T>>,
    /// Disjoint from each other and from the leaves.
    pub tiles: Vec<Tile<T>>,
    /// In file order.
    pub metadata: Vec<(String, MetaValue)>,
    lookup: OnceLock<FxHashMap<([i32; 3], u8), Slot>>,
}

/// Where a cube's values are.
#[derive(Debug, Clone, Copy)]
enum Slot {
    Leaf(usize),
    Tile(usize),
}

impl<T: Value> Grid<T> {
    /// A grid without voxels.
    pub fn new(name: impl Into<String>, background: T, file_from_index: DAffine3) -> Self {
        Self {
            name: name.into(),
            class: GridClass::Unknown,
            background,
            file_from_index,
            leaves: Vec::new(),
            tiles: Vec::new(),
            metadata: Vec::new(),
            lookup: OnceLock::new(),
        }
    }

    /// Lowest and highest active voxel, inclusive; `None` if no voxel is active.
    pub fn active_bounds(&self) -> Option<([i32; 3], [i32; 3])> {
        let mut bounds: Option<([i32; 3], [i32; 3])> = None;
        let mut include = |low: [i32; 3], high: [i32; 3]| {
            let (min, max) = bounds.get_or_insert((low, high));
            for axis in 0..3 {
                min[axis] = min[axis].min(low[axis]);
                max[axis] = max[axis].max(high[axis]);
            }
        };
        for leaf in &self.leaves {
            leaf.active_offsets().map(|offset| leaf.voxel(offset)).for_each(|voxel| include(voxel, voxel));
        }
        for tile in self.tiles.iter().filter(|tile| tile.active) {
            include(tile.origin, tile.last_voxel());
        }
        bounds
    }

    /// Active voxels in leaves and tiles; saturates.
    pub fn active_voxel_count(&self) -> u64 {
        let in_leaves: u64 = self.leaves.iter().map(|leaf| u64::from(leaf.active_count())).sum();
        let active_tiles = self.tiles.iter().filter(|tile| tile.active);
        active_tiles.fold(in_leaves, |count, tile| count.saturating_add(tile.voxel_count()))
    }

    /// The value at one voxel, active or not. Slow (up to three hash look-ups): meant for tests. The first call
    /// indexes leaves and tiles; later changes to them are not seen.
    pub fn value(&self, ijk: [i32; 3]) -> T {
        self.find(ijk).map_or(self.background, |slot| match slot {
            Slot::Leaf(i) => self.leaves[i].values[leaf_offset(ijk)],
            Slot::Tile(i) => self.tiles[i].value,
        })
    }

    /// Whether a voxel is active; as slow as [`Self::value`].
    pub fn is_active(&self, ijk: [i32; 3]) -> bool {
        self.find(ijk).is_some_and(|slot| match slot {
            Slot::Leaf(i) => self.leaves[i].active[leaf_offset(ijk) >> 6] >> (leaf_offset(ijk) & 63) & 1 == 1,
            Slot::Tile(i) => self.tiles[i].active,
        })
    }

    fn find(&self, ijk: [i32; 3]) -> Option<Slot> {
        let lookup = self.lookup.get_or_init(|| {
            let leaves = self.leaves.iter().enumerate().map(|(i, l)| ((l.origin, LOWER_LOG2), Slot::Leaf(i)));
            let tiles = self.tiles.iter().enumerate().map(|(i, t)| ((t.origin, t.size_log2), Slot::Tile(i)));
            leaves.chain(tiles).collect()
        });
        let cube = |log2: u8| (ijk.map(|c| c >> log2 << log2), log2);
        [LOWER_LOG2, UPPER_LOG2, ROOT_LOG2].into_iter().find_map(|log2| lookup.get(&cube(log2)).copied())
    }

    /// The same grid with every value converted.
    pub fn map<U: Value>(self, convert: impl Fn(T) -> U) -> Grid<U> {
        let leaves = self.leaves.into_iter();
        let tiles = self.tiles.into_iter();
        Grid {
            name: self.name,
            class: self.class,
            background: convert(self.background),
            file_from_index: self.file_from_index,
            leaves: leaves
                .map(|l| Leaf { origin: l.origin, active: l.active, values: l.values.map(&convert) })
                .collect(),
            tiles: tiles
                .map(|t| Tile {
                    origin: t.origin,
                    size_log2: t.size_log2,
                    value: convert(t.value),
                    active: t.active,
                })
                .collect(),
            metadata: self.metadata,
            lookup: OnceLock::new(),
        }
    }
}

impl<T: Scalar> Grid<T> {
    /// Sum over all active voxels, tiles included, in 64-bit floats.
    pub fn sum(&self) -> f64 {
        let in_leaf =
            |leaf: &Leaf<T>| leaf.active_offsets().fold(0.0, |sum, i| sum + leaf.values[i].to_f64());
        let in_leaves = self.leaves.iter().fold(0.0, |sum, leaf| sum + in_leaf(leaf));
        let active_tiles = self.tiles.iter().filter(|tile| tile.active);
        active_tiles.fold(in_leaves, |sum, tile| sum + tile.value.to_f64() * tile.voxel_count() as f64)
    }
}

/// Offset of a voxel in its leaf.
pub(crate) fn leaf_offset(ijk: [i32; 3]) -> usize {
    let [x, y, z] = ijk.map(|c| (c & 7) as usize);
    x << 6 | y << 3 | z
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Grid {
        let mut grid = Grid::new("g", 0.25, DAffine3::IDENTITY);
        let mut leaf = Leaf::uniform([-8, 0, 0], 0.0);
        leaf.values[leaf_offset([-7, 2, 3])] = 5.0;
        leaf.active[leaf_offset([-7, 2, 3]) >> 6] |= 1 << (leaf_offset([-7, 2, 3]) & 63);
        grid.leaves.push(leaf);
        grid.tiles.push(Tile { origin: [128, 0, 0], size_log2: 7, value: 2.0, active: true });
        grid.tiles.push(Tile { origin: [4096, 0, 0], size_log2: 12, value: -1.0, active: false });
        grid
    }

    #[test]
    fn values_come_from_leaf_tile_or_background() {
        let grid = sample();
        assert_eq!(grid.value([-7, 2, 3]), 5.0);
        assert_eq!(grid.value([-8, 0, 0]), 0.0);
        assert_eq!(grid.value([200, 127, 0]), 2.0);
        assert_eq!(grid.value([8191, 4095, 4095]), -1.0);
        assert_eq!(grid.value([0, 0, 0]), 0.25);
        assert_eq!(grid.value([i32::MIN, i32::MAX, 0]), 0.25);
        assert!(grid.is_active([-7, 2, 3]) && grid.is_active([128, 0, 0]) && !grid.is_active([4096, 0, 0]));
    }

    #[test]
    fn statistics_count_active_voxels_only() {
        let grid = sample();
        assert_eq!(grid.active_voxel_count(), 1 + (1 << 21));
        assert_eq!(grid.active_bounds(), Some(([-7, 0, 0], [255, 127, 127])));
        assert_eq!(grid.sum(), 5.0 + 2.0 * f64::from(1 << 21));
        assert_eq!(Grid::new("empty", 1.0_f32, DAffine3::IDENTITY).active_bounds(), None);
    }

    #[test]
    fn voxels_and_offsets_are_inverse() {
        let leaf = Leaf::uniform([16, -8, 0], 0.0_f32);
        assert!((0..LEAF_VOXELS).all(|offset| leaf_offset(leaf.voxel(offset)) == offset));
    }
}

//! Sizes and offsets of the structures, which depend on the type of the values as a C++ compiler arranges them.

use crate::tree::Level;
use crate::value::ValueType;

/// Every structure begins at a multiple of this.
pub(super) const ALIGNMENT: usize = 32;

/// How one type of values is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Of the background and of tiles.
    pub(super) value_bytes: usize,
    value_align: usize,
    /// Of a mean or a standard deviation.
    stats_bytes: usize,
    pub(super) leaf: LeafKind,
}

/// What a leaf holds beside its mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LeafKind {
    /// Statistics, then 512 values.
    Values,
    /// 512 bits.
    Bits,
    /// Nothing: the active voxels are the true ones.
    MaskOnly,
    /// Offset, step and 512 codes of that many bits.
    Quantized(usize),
    /// The same; each leaf says how many bits its codes have.
    QuantizedByLeaf,
}

/// Bytes before the mask: box and flags.
pub(super) const LEAF_MASK_AT: usize = 16;
/// Bytes of a leaf's mask.
pub(super) const LEAF_MASK_BYTES: usize = 64;
/// Where a leaf's flags are; the upper three bits are log2 of the bits of a code.
pub(super) const LEAF_FLAGS_AT: usize = 15;
/// Behind mask.
pub(super) const LEAF_TAIL_AT: usize = LEAF_MASK_AT + LEAF_MASK_BYTES;
/// Where a quantized leaf's codes begin: behind its offset, its step and four 16-bit statistics.
pub(super) const CODES_AT: usize = LEAF_TAIL_AT + 16;
/// Where an internal node's masks begin: behind its box and flags.
pub(super) const NODE_MASKS_AT: usize = 32;

impl Layout {
    /// The type of values that a grid type stands for and how they are stored, if they are read at all.
    pub(super) fn of(grid_type: u32) -> (ValueType, Option<Self>) {
        let numbers = |value_bytes, value_align: usize, leaf| Self {
            value_bytes,
            value_align,
            stats_bytes: value_align.max(4),
            leaf,
        };
        let truth = |leaf| Self { value_bytes: 1, value_align: 1, stats_bytes: 1, leaf };
        let (value_type, layout) = match grid_type {
            1 => (ValueType::Float, numbers(4, 4, LeafKind::Values)),
            2 => (ValueType::Double, numbers(8, 8, LeafKind::Values)),
            4 => (ValueType::Int32, numbers(4, 4, LeafKind::Values)),
            5 => (ValueType::Int64, numbers(8, 8, LeafKind::Values)),
            6 => (ValueType::Vec3s, numbers(12, 4, LeafKind::Values)),
            7 => (ValueType::Vec3d, numbers(24, 8, LeafKind::Values)),
            8 => (ValueType::Mask, truth(LeafKind::MaskOnly)),
            11 => (ValueType::Bool, truth(LeafKind::Bits)),
            13 => (ValueType::Float, numbers(4, 4, LeafKind::Quantized(4))),
            14 => (ValueType::Float, numbers(4, 4, LeafKind::Quantized(8))),
            15 => (ValueType::Float, numbers(4, 4, LeafKind::Quantized(16))),
            16 => (ValueType::Float, numbers(4, 4, LeafKind::QuantizedByLeaf)),
            other => return (ValueType::Other(name(other)), None),
        };
        (value_type, Some(layout))
    }

    /// Where the root has its background: behind box and table size.
    pub(super) fn background_at(&self) -> usize {
        28_usize.next_multiple_of(self.value_align)
    }

    /// Size of the root without its table, which follows.
    pub(super) fn root_bytes(&self) -> usize {
        let stats_at = (self.background_at() + 3 * self.value_bytes).next_multiple_of(self.stats_bytes);
        (stats_at + 2 * self.stats_bytes).next_multiple_of(ALIGNMENT)
    }

    /// Where a root's table entry has its value: behind key, child and state.
    pub(super) fn root_value_at(&self) -> usize {
        20_usize.next_multiple_of(self.value_align)
    }

    pub(super) fn root_entry_bytes(&self) -> usize {
        (self.root_value_at() + self.value_bytes).next_multiple_of(ALIGNMENT)
    }

    /// Where an internal node's table is.
    pub(super) fn table_at(&self, level: Level) -> usize {
        NODE_MASKS_AT + 2 * level.n_slots() / 8 + self.stats_block(0)
    }

    /// A value or a 64-bit offset, whichever is larger.
    pub(super) fn table_entry_bytes(&self) -> usize {
        self.value_bytes.max(8).next_multiple_of(8)
    }

    pub(super) fn node_bytes(&self, level: Level) -> usize {
        self.table_at(level) + level.n_slots() * self.table_entry_bytes()
    }

    /// Where a leaf's values are.
    pub(super) fn leaf_values_at(&self) -> usize {
        match self.leaf {
            LeafKind::Values => LEAF_TAIL_AT + self.stats_block(LEAF_TAIL_AT),
            LeafKind::Bits | LeafKind::MaskOnly => LEAF_TAIL_AT,
            LeafKind::Quantized(_) | LeafKind::QuantizedByLeaf => CODES_AT,
        }
    }

    /// `None` if leaves differ in size.
    pub(super) fn leaf_bytes(&self) -> Option<usize> {
        let values = match self.leaf {
            LeafKind::Values => 512 * self.value_bytes,
            LeafKind::Bits => LEAF_MASK_BYTES + 16,
            LeafKind::MaskOnly => 16,
            LeafKind::Quantized(bits) => bits * LEAF_MASK_BYTES,
            LeafKind::QuantizedByLeaf => return None,
        };
        Some(self.leaf_values_at() + values)
    }

    /// Minimum, maximum, mean and standard deviation from `at` on, up to the next structure.
    fn stats_block(&self, at: usize) -> usize {
        let stats_at =
            (at.next_multiple_of(self.value_align) + 2 * self.value_bytes).next_multiple_of(self.stats_bytes);
        (stats_at + 2 * self.stats_bytes).next_multiple_of(ALIGNMENT) - at
    }
}

/// Of types that are not read.
fn name(grid_type: u32) -> String {
    let name = match grid_type {
        3 => "int16",
        9 => "Half",
        10 => "uint32",
        12 => "RGBA8",
        17 => "Vec4f",
        18 => "Vec4d",
        19 => "Index",
        20 => "OnIndex",
        21 => "IndexMask",
        22 => "OnIndexMask",
        23 => "PointIndex",
        24 => "Vec3u8",
        25 => "Vec3u16",
        26 => "uint8",
        other => return format!("type {other}"),
    };
    format!("NanoVDB {name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes as `sizeof` gives them for NanoVDB's structures.
    #[test]
    fn sizes_are_those_of_the_structures() {
        let sizes = |grid_type| {
            let layout = Layout::of(grid_type).1.expect("a type that is read");
            let nodes = [Level::Upper, Level::Lower].map(|level| layout.node_bytes(level));
            (layout.root_bytes(), layout.root_entry_bytes(), nodes, layout.leaf_bytes())
        };
        let small = [270_400, 33_856];
        assert_eq!(sizes(1), (64, 32, small, Some(2144)), "float");
        assert_eq!(sizes(2), (96, 32, small, Some(4224)), "double");
        assert_eq!(sizes(4), (64, 32, small, Some(2144)), "int32");
        assert_eq!(sizes(5), (96, 32, small, Some(4224)), "int64");
        assert_eq!(sizes(6), (96, 32, [532_544, 66_624], Some(6272)), "Vec3f");
        assert_eq!(sizes(7), (128, 64, [794_720, 99_424], Some(12_448)), "Vec3d");
        assert_eq!(sizes(8), (64, 32, small, Some(96)), "mask");
        assert_eq!(sizes(11), (64, 32, small, Some(160)), "bool");
        assert_eq!(sizes(13).3, Some(352), "Fp4");
        assert_eq!(sizes(14).3, Some(608), "Fp8");
        assert_eq!(sizes(15).3, Some(1120), "Fp16");
        assert_eq!(sizes(16), (64, 32, small, None), "FpN");
    }

    #[test]
    fn types_that_are_not_read_have_names() {
        for (grid_type, expected) in [(9, "NanoVDB Half"), (20, "NanoVDB OnIndex"), (99, "type 99")] {
            assert_eq!(Layout::of(grid_type), (ValueType::Other(expected.to_owned()), None));
        }
    }
}

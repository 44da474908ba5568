//! The tree of one grid in two passes: first locate every node ([`Skeleton`]), then decode values in parallel.
//!
//! The first pass is cheap, sequential and independent of the voxel type, so it also serves to step over grids in
//! stream files. After it, the number of leaves is known to be backed by bytes, and only then memory is allocated.

mod decode;
mod skeleton;

pub(crate) use skeleton::Skeleton;

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

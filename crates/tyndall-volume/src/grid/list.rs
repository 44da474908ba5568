//! Bricks of which nearly all voxels are 0, as lists of those that are not.

use super::{BRICK_VOXELS, Brick};

/// A brick with more voxels than this that are not 0 is stored whole.
const LONGEST: usize = 16;

/// The lists of a grid, one behind the other.
#[derive(Debug, Default)]
pub(super) struct VoxelLists {
    voxels: Vec<ListedVoxel>,
}

/// A voxel that is not 0. Those of a brick follow each other.
#[derive(Debug, Clone, Copy)]
struct ListedVoxel {
    value: f32,
    /// Position in the brick.
    offset: u16,
    is_last: bool,
}

impl VoxelLists {
    /// Adds a brick; `None` if it has too many voxels for a list, or none.
    pub(super) fn add(&mut self, values: &[f32; BRICK_VOXELS]) -> Option<Brick> {
        let (first, room) = (self.voxels.len(), (Brick::UNIFORM - Brick::FIRST_LIST) as usize);
        let count = values.iter().filter(|&&value| value > 0.0).count();
        if !(1..=LONGEST).contains(&count) || first >= room {
            return None;
        }
        let present = values.iter().enumerate().filter(|(_, value)| **value > 0.0);
        self.voxels.extend(present.map(|(offset, &value)| ListedVoxel {
            value,
            offset: offset as u16,
            is_last: false,
        }));
        self.voxels[first + count - 1].is_last = true;
        Some(Brick { data: Brick::FIRST_LIST + first as u32, value: 0.0 })
    }

    /// The voxel at `offset` of a listed brick.
    pub(super) fn voxel(&self, brick: Brick, offset: usize) -> f32 {
        let list = self.voxels.get((brick.data - Brick::FIRST_LIST) as usize..).unwrap_or_default();
        for voxel in list {
            if usize::from(voxel.offset) == offset {
                return voxel.value;
            }
            if voxel.is_last {
                break;
            }
        }
        0.0
    }

    pub(super) fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    pub(super) fn shrink(&mut self) {
        self.voxels.shrink_to_fit();
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.voxels.capacity() * size_of::<ListedVoxel>()
    }
}

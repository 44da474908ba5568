//! What changed about a prim, in Hydra's words.

use std::ops::{BitOr, BitOrAssign};

/// A set of changes of one prim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct DirtyBits(u32);

/// Name of each bit, in bit order.
const NAMES: [&str; 11] = [
    "TRANSFORM",
    "TOPOLOGY",
    "POINTS",
    "PRIMVARS",
    "MATERIAL_ID",
    "VISIBILITY",
    "FIELD",
    "PARAMS",
    "CAMERA",
    "SETTINGS",
    "INSTANCES",
];

impl DirtyBits {
    /// Nothing changed.
    pub const NONE: Self = Self(0);
    /// `world_from_object`.
    pub const TRANSFORM: Self = Self(1);
    /// Face counts, indices, holes, orientation, subdivision.
    pub const TOPOLOGY: Self = Self(1 << 1);
    /// Point positions and authored normals.
    pub const POINTS: Self = Self(1 << 2);
    /// Other primvars.
    pub const PRIMVARS: Self = Self(1 << 3);
    /// Which material is bound, to the prim or a subset of its faces.
    pub const MATERIAL_ID: Self = Self(1 << 4);
    /// Shown or hidden.
    pub const VISIBILITY: Self = Self(1 << 5);
    /// A grid: its file, name or index.
    pub const FIELD: Self = Self(1 << 6);
    /// Parameters of a light or material.
    pub const PARAMS: Self = Self(1 << 7);
    /// Anything of a camera.
    pub const CAMERA: Self = Self(1 << 8);
    /// Render settings.
    pub const SETTINGS: Self = Self(1 << 9);
    /// Instance transforms.
    pub const INSTANCES: Self = Self(1 << 10);
    /// Everything: what a first sync means.
    pub const ALL: Self = Self((1 << NAMES.len()) - 1);

    /// From the integer that crosses language borders; unknown bits are dropped.
    pub fn from_bits(bits: u32) -> Self {
        Self(bits & Self::ALL.0)
    }

    /// The integer form.
    pub fn bits(self) -> u32 {
        self.0
    }

    /// Every bit with its name.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        NAMES.iter().enumerate().map(|(i, name)| (*name, Self(1 << i)))
    }

    /// Whether any bit of `other` is set.
    pub fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether no bit is set.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl BitOr for DirtyBits {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for DirtyBits {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cover_every_bit_once() {
        let all = DirtyBits::named().fold(DirtyBits::NONE, |acc, (_, bit)| acc | bit);
        assert_eq!(all, DirtyBits::ALL);
        let instances = DirtyBits::named().find(|(name, _)| *name == "INSTANCES").map(|(_, bit)| bit);
        assert_eq!(instances, Some(DirtyBits::INSTANCES));
    }
}

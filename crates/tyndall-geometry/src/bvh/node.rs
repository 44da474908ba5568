//! The node of the wide tree, and boxes.

use glam::{Mat3A, Vec3A};

/// Children of a node.
pub(crate) const WIDTH: usize = 8;

/// Set in a child reference that is a leaf.
pub(crate) const LEAF: u32 = 1 << 31;

/// Bits of a leaf reference that hold the number of items minus one; the rest is the first item.
const COUNT_BITS: u32 = 3;

/// Items a leaf can hold.
pub(crate) const MAX_LEAF_ITEMS: usize = 1 << COUNT_BITS;

/// Eight boxes side by side and where they lead.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// min x, max x, min y, max y, min z, max z of the children. Absent children are inverted: +inf to -inf.
    pub(crate) bounds: [[f32; WIDTH]; 6],
    /// Node index, or [`LEAF`] and the packed items.
    pub(crate) child: [u32; WIDTH],
}

impl Node {
    pub(crate) fn empty() -> Self {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { bounds: [low, high, low, high, low, high], child: [0; WIDTH] }
    }

    pub(crate) fn set(&mut self, slot: usize, bounds: &Bounds, child: u32) {
        for axis in 0..3 {
            self.bounds[2 * axis][slot] = bounds.min[axis];
            self.bounds[2 * axis + 1][slot] = bounds.max[axis];
        }
        self.child[slot] = child;
    }
}

/// A leaf of `count` items beginning with `first`.
pub(crate) fn leaf_reference(first: usize, count: usize) -> u32 {
    assert!((1..=MAX_LEAF_ITEMS).contains(&count), "a leaf holds 1 to {MAX_LEAF_ITEMS} items, not {count}");
    assert!(first < (LEAF >> COUNT_BITS) as usize, "{first} items are more than a tree can hold");
    LEAF | (first as u32) << COUNT_BITS | (count as u32 - 1)
}

/// First item and number of items of a leaf.
#[inline(always)]
pub(crate) fn leaf_items(reference: u32) -> std::ops::Range<usize> {
    let packed = reference & !LEAF;
    let first = (packed >> COUNT_BITS) as usize;
    first..first + (packed as usize & (MAX_LEAF_ITEMS - 1)) + 1
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) min: Vec3A,
    pub(crate) max: Vec3A,
}

impl Bounds {
    pub(crate) const EMPTY: Self =
        Self { min: Vec3A::splat(f32::INFINITY), max: Vec3A::splat(f32::NEG_INFINITY) };

    pub(crate) fn of_points(points: impl IntoIterator<Item = Vec3A>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub(crate) fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// Half the surface, infinite at most.
    pub(crate) fn half_area(&self) -> f32 {
        let size = self.max - self.min;
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Moves each face out by `relative` times the axis' largest coordinate.
    pub(crate) fn grown(&self, relative: f32) -> Self {
        let margin = self.min.abs().max(self.max.abs()) * relative;
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// The box around this box after `linear` and then a shift to `translation`.
    pub(crate) fn transformed(&self, linear: &Mat3A, translation: Vec3A) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        // Halved before adding, so that boxes up to f32::MAX stay finite.
        let center = self.min * 0.5 + self.max * 0.5;
        let half = self.max * 0.5 - self.min * 0.5;
        let extent =
            linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
        let middle = *linear * center;
        // The shift cancels digits when the object is small and far away: bound what that rounds off.
        let rounding = (middle.abs() + extent + translation.abs()) * 1e-6;
        let middle = middle + translation;
        Self { min: middle - extent - rounding, max: middle + extent + rounding }
    }
}

//! The boxes that planes cut space into: for pictures and statistics, never for sampling.

use super::{Field, Region};
use crate::EventClass;

/// A region with the box it is for. Outermost boxes reach to infinity.
#[derive(Debug, Clone, Copy)]
pub struct Cell<'a> {
    /// The lower corner; points on it belong to the box.
    pub min: [f32; 3],
    /// The upper corner; points on it do not.
    pub max: [f32; 3],
    /// What was learned there.
    pub region: &'a Region,
}

impl Field {
    /// Every region of vertices of this class with its box, in the order of the tree.
    pub fn cells(&self, class: EventClass) -> Vec<Cell<'_>> {
        let (nodes, regions) = self.parts(class);
        let mut cells = Vec::with_capacity(regions.len());
        let mut open = vec![(0, [f32::NEG_INFINITY; 3], [f32::INFINITY; 3])];
        while let Some((index, min, max)) = open.pop() {
            let Some(node) = nodes.get(index) else { continue };
            if let Some(region) = node.region() {
                cells.push(Cell { min, max, region: &regions[region] });
            } else if let Some((axis, plane, below)) = node.children() {
                let (mut upper_min, mut lower_max) = (min, max);
                (upper_min[axis], lower_max[axis]) = (plane, plane);
                open.push((below + 1, upper_min, max));
                open.push((below, min, lower_max));
            }
        }
        cells
    }
}

#[cfg(test)]
#[path = "cells_tests.rs"]
mod tests;

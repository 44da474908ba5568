//! Where: planes and the regions between them.
//!
//! Planes cut all of space, so no bounds are needed: a point far outside of what was sampled is in some region as well.

use super::refine::{Plan, assign, plan_region};
use super::train::train;
use super::{FieldSettings, Region, TrainingSample};
use crate::EventClass;
use glam::Vec3A;
use rayon::prelude::*;

/// Regions of a tree after which no more are cut: 55 MB. A field that lives through a long shot must not grow forever.
const MAX_REGIONS: usize = 1 << 16;
const AXIS_SHIFT: u32 = 30;
const LEAF: u32 = 3;

/// A plane with two children, or a leaf; 8 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Where on the axis; points on the plane are above it. Unused in leaves.
    pub(super) plane: f32,
    /// Two bits: the axis, or 3 for a leaf. 30 bits: the first of two adjacent children, or the region.
    pub(super) link: u32,
}

impl Node {
    pub(super) fn leaf(region: usize) -> Self {
        Self { plane: 0.0, link: LEAF << AXIS_SHIFT | region as u32 }
    }

    pub(super) fn inner(axis: usize, plane: f32, children: usize) -> Self {
        Self { plane, link: (axis as u32) << AXIS_SHIFT | children as u32 }
    }

    #[inline]
    fn index(self) -> usize {
        (self.link & ((1 << AXIS_SHIFT) - 1)) as usize
    }

    /// The axis (0 to 2), the position of the plane on it, and the node below it, the one above being the next; `None` for
    /// leaves.
    #[inline]
    pub fn children(self) -> Option<(usize, f32, usize)> {
        let axis = self.link >> AXIS_SHIFT;
        (axis != LEAF).then(|| (axis as usize, self.plane, self.index()))
    }

    /// The region of a leaf; `None` for planes.
    #[inline]
    pub fn region(self) -> Option<usize> {
        (self.link >> AXIS_SHIFT == LEAF).then(|| self.index())
    }
}

/// A tree of regions; empty until the first sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) regions: Vec<Region>,
}

impl Tree {
    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    pub(super) fn regions(&self) -> &[Region] {
        &self.regions
    }

    pub(super) fn n_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.regions.as_slice())
    }

    /// Number of the region at a point; 0 in an empty tree.
    #[inline]
    pub(super) fn region_at(&self, position: Vec3A) -> usize {
        let mut node = 0;
        while let Some((axis, plane, below)) = self.nodes.get(node).and_then(|n| n.children()) {
            node = below + usize::from(position[axis] >= plane);
        }
        self.nodes.get(node).map_or(0, |n| n.index())
    }

    /// The region at a point that is moved by up to half the size of its region: a third of `u` chooses the axis, the rest
    /// how far.
    #[inline]
    pub(super) fn lookup(&self, position: Vec3A, u: f32) -> Option<&Region> {
        let region = self.regions.get(self.region_at(position))?;
        let axis = ((3.0 * u) as usize).min(2);
        // Evenly filled boxes are √12 standard deviations wide.
        let shift = (3.0 * u - axis as f32 - 0.5) * 12f32.sqrt() * region.spread[axis];
        let mut moved = position;
        moved[axis] += shift;
        self.regions.get(self.region_at(moved))
    }

    /// Learns from those of the samples whose vertex is of this class; returns how many there were.
    pub(super) fn update(
        &mut self,
        samples: &[TrainingSample],
        class: EventClass,
        settings: &FieldSettings,
    ) -> usize {
        let is_ours = |s: &TrainingSample| s.vertex == class && s.is_usable();
        if self.nodes.is_empty() && samples.iter().any(is_ours) {
            self.nodes.push(Node::leaf(0));
            self.regions.push(Region::new(settings));
        }
        let groups = assign(samples, self.regions.len(), |s| {
            is_ours(s).then(|| self.region_at(Vec3A::from(s.position)))
        });
        let full = FieldSettings { max_depth: 0, ..*settings };
        let settings = if self.regions.len() < MAX_REGIONS { settings } else { &full };
        let plans: Vec<Plan> = groups
            .into_par_iter()
            .zip(&self.regions)
            .map(|(group, region)| plan_region(samples, group, region, settings))
            .collect();
        let groups = self.grow(plans);
        self.regions.par_iter_mut().zip(&groups).for_each(|(region, group)| {
            train(region, samples, group, settings);
        });
        groups.iter().map(Vec::len).sum()
    }

    /// Replaces leaves by what was planned for them; returns the samples of each region.
    fn grow(&mut self, plans: Vec<Plan>) -> Vec<Vec<u32>> {
        let mut leaves = vec![0; plans.len()];
        for (i, node) in self.nodes.iter().enumerate() {
            node.region().into_iter().for_each(|region| leaves[region] = i);
        }
        let mut groups = vec![Vec::new(); plans.len()];
        for (region, (plan, leaf)) in plans.into_iter().zip(leaves).enumerate() {
            self.graft(leaf, region, plan, &mut groups);
        }
        groups
    }

    /// Puts `plan` in the place of the leaf `node` of `region`.
    fn graft(&mut self, node: usize, region: usize, plan: Plan, groups: &mut Vec<Vec<u32>>) {
        match plan {
            Plan::Leaf { samples, narrowing } => {
                self.nodes[node] = Node::leaf(region);
                if let Some(n) = narrowing {
                    self.regions[region].narrow(&n.cloud, n.depth, n.factor);
                }
                groups[region] = samples;
            }
            Plan::Cut { axis, plane, parts } => {
                let (children, above) = (self.nodes.len(), self.regions.len());
                self.nodes[node] = Node::inner(axis, plane, children);
                self.nodes.extend([Node::leaf(region), Node::leaf(above)]);
                self.regions.push(self.regions[region].clone());
                groups.push(Vec::new());
                let [below_plan, above_plan] = *parts;
                self.graft(children, region, below_plan, groups);
                self.graft(children + 1, above, above_plan, groups);
            }
        }
    }
}

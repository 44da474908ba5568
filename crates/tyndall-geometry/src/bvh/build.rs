//! Building: equal boxes merged, `obvhs` run on the rest, two children made eight.

use super::groups::Groups;
use super::node::{Bounds, MAX_LEAF_ITEMS, Node, WIDTH, leaf_reference};
use super::walk::STACK_SIZE;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;
use rustc_hash::FxHashSet;
use std::ops::Range;

/// Boxes grow by this, relative to their largest coordinate: what rounding moves vertices by in the box test.
const GROWTH: f32 = 3e-7;

/// Primitives below which a degenerate tree is affordable whatever the builder does.
const SMALL: usize = 2048;

/// Boxes above which building quickly is worth more than the last percents of tracing.
const LARGE: usize = 1 << 18;

/// Boxes above which it is worth more still.
const HUGE: usize = 1 << 20;

/// How primitives become leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaves {
    /// Most primitives of one leaf.
    pub(crate) max_primitives: usize,
    /// Primitives that make one item (a block of triangles); leaves hold whole items.
    pub(crate) primitives_per_item: usize,
}

/// A tree eight children wide.
#[derive(Debug, Clone, Default)]
pub(crate) struct WideBvh {
    /// Root first; empty if there are no primitives.
    pub(crate) nodes: Vec<Node>,
    /// Primitives of all leaves; those of one item are consecutive, and `u32::MAX` fills incomplete items.
    pub(crate) order: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Box3(Aabb);

impl Boundable for Box3 {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// A tree over `boxes`, which must be finite. Primitives with empty boxes are left out.
pub(crate) fn build(boxes: &[Bounds], leaves: Leaves) -> WideBvh {
    let groups = Groups::new(boxes);
    if groups.boxes.is_empty() {
        return WideBvh::default();
    }
    if !is_degenerate(&groups.boxes) {
        let wide = Collapse::run(&binary_by_obvhs(&groups.boxes, leaves), &groups, leaves);
        if wide.stack_need(0) <= STACK_SIZE {
            return wide;
        }
    }
    let wide = Collapse::run(&binary_by_median(&groups.boxes), &groups, leaves);
    assert!(wide.stack_need(0) <= STACK_SIZE, "a balanced tree has logarithmic depth");
    wide
}

/// Whether PLOC would see mostly equal centres (nested boxes) or a scene without a finite size.
fn is_degenerate(boxes: &[Bounds]) -> bool {
    let all = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(b));
    if !(all.max - all.min).is_finite() {
        return true;
    }
    if boxes.len() < SMALL {
        return false;
    }
    // Some evenly spread over the list tell enough.
    let sample = || boxes.iter().step_by(boxes.len().div_ceil(1 << 16));
    let cell = (all.max - all.min) / 2f32.powi(20);
    let centers: FxHashSet<[i32; 3]> = sample()
        .map(|b| ((b.min * 0.5 + b.max * 0.5 - all.min) / cell).to_array().map(|x| x as i32))
        .collect();
    centers.len() < sample().count() / 16
}

/// A binary tree; children of inner nodes come after them.
struct BinaryTree {
    nodes: Vec<BinaryNode>,
    groups: Vec<u32>,
}

#[derive(Clone, Copy)]
struct BinaryNode {
    bounds: Bounds,
    /// Number of groups of a leaf; 0 for an inner node.
    count: u32,
    /// First group, or first of two adjacent children.
    first: u32,
}

fn binary_by_obvhs(boxes: &[Bounds], leaves: Leaves) -> BinaryTree {
    let aabbs: Vec<Box3> = boxes.par_iter().map(|b| Box3(Aabb::new(b.min, b.max))).collect();
    // Reinsertion is much of the time of a large build and gains least there; its second pass gains nothing.
    let quickly = |reinsertion_batch_ratio| BvhBuildParams {
        reinsertion_batch_ratio,
        post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
        ..BvhBuildParams::medium_build()
    };
    let preset = match boxes.len() {
        n if n <= LARGE => BvhBuildParams::medium_build(),
        n if n <= HUGE => quickly(0.02),
        _ => quickly(0.01),
    };
    let params = BvhBuildParams {
        max_prims_per_leaf: leaves.max_primitives as u32,
        collapse_traversal_cost: leaves.primitives_per_item as f32,
        ..preset
    };
    let Bvh2 { nodes, primitive_indices, .. } =
        build_bvh2(&aabbs, params, &mut std::time::Duration::default());
    let nodes = nodes
        .par_iter()
        .map(|n| {
            let bounds = Bounds { min: n.aabb().min, max: n.aabb().max };
            BinaryNode { bounds, count: n.prim_count, first: n.first_index }
        })
        .collect();
    BinaryTree { nodes, groups: primitive_indices }
}

/// The fallback: halves the boxes along the longest side of their centres until they fit a leaf. Depth is logarithmic
/// for any input.
fn binary_by_median(boxes: &[Bounds]) -> BinaryTree {
    let mut tree = BinaryTree { nodes: Vec::new(), groups: (0..boxes.len() as u32).collect() };
    let bounds = |groups: &[u32]| groups.iter().fold(Bounds::EMPTY, |b, &g| b.union(&boxes[g as usize]));
    let center = |g: u32| boxes[g as usize].min * 0.5 + boxes[g as usize].max * 0.5;
    tree.nodes.push(BinaryNode { bounds: bounds(&tree.groups), count: boxes.len() as u32, first: 0 });
    let mut open = vec![0usize];
    while let Some(index) = open.pop() {
        let BinaryNode { count, first, .. } = tree.nodes[index];
        if count <= 1 {
            continue;
        }
        let range = first as usize..(first + count) as usize;
        let spread = Bounds::of_points(tree.groups[range.clone()].iter().map(|&g| center(g)));
        let size = (spread.max * 0.5 - spread.min * 0.5).to_array();
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        let half = count / 2;
        tree.groups[range].select_nth_unstable_by(half as usize, |&a, &b| {
            center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b))
        });
        let child = tree.nodes.len();
        for (first, count) in [(first, half), (first + half, count - half)] {
            let bounds = bounds(&tree.groups[first as usize..(first + count) as usize]);
            tree.nodes.push(BinaryNode { bounds, count, first });
        }
        tree.nodes[index] = BinaryNode { count: 0, first: child as u32, ..tree.nodes[index] };
        open.extend([child, child + 1]);
    }
    tree
}

/// A subtree waiting for its place in a wide node.
#[derive(Clone)]
enum Subtree {
    Inner(u32),
    /// Primitives (range of `Collapse::primitives`) in one box: a leaf, or more than a leaf holds.
    Crowd(Bounds, Range<usize>),
}

struct Collapse<'a> {
    tree: &'a BinaryTree,
    groups: &'a Groups,
    leaves: Leaves,
    wide: WideBvh,
    /// Primitives of all binary leaves met so far.
    primitives: Vec<u32>,
}

impl<'a> Collapse<'a> {
    fn run(tree: &'a BinaryTree, groups: &'a Groups, leaves: Leaves) -> WideBvh {
        let primitives = Vec::with_capacity(groups.members.len());
        let mut this = Self { tree, groups, leaves, wide: WideBvh::default(), primitives };
        let root = this.subtree(0);
        let mut open = vec![(0usize, root)];
        this.wide.nodes.push(Node::empty());
        let mut children = Vec::with_capacity(WIDTH);
        while let Some((index, subtree)) = open.pop() {
            this.gather(subtree, &mut children);
            for (slot, child) in children.drain(..).enumerate() {
                let bounds = this.bounds(&child).grown(GROWTH);
                let reference = match child {
                    Subtree::Crowd(_, range) if range.len() <= this.capacity() => this.leaf(range),
                    inner => {
                        this.wide.nodes.push(Node::empty());
                        open.push((this.wide.nodes.len() - 1, inner));
                        this.wide.nodes.len() as u32 - 1
                    }
                };
                this.wide.nodes[index].set(slot, &bounds, reference);
            }
        }
        this.wide
    }

    fn capacity(&self) -> usize {
        MAX_LEAF_ITEMS * self.leaves.primitives_per_item
    }

    fn subtree(&mut self, node: u32) -> Subtree {
        let BinaryNode { bounds, count, first } = self.tree.nodes[node as usize];
        if count == 0 {
            return Subtree::Inner(node);
        }
        let start = self.primitives.len();
        for &group in &self.tree.groups[first as usize..(first + count) as usize] {
            self.primitives.extend_from_slice(self.groups.members(group as usize));
        }
        Subtree::Crowd(bounds, start..self.primitives.len())
    }

    fn bounds(&self, subtree: &Subtree) -> Bounds {
        match subtree {
            Subtree::Inner(node) => self.tree.nodes[*node as usize].bounds,
            Subtree::Crowd(bounds, _) => *bounds,
        }
    }

    /// Fills `children` with up to eight subtrees: the one with the largest box is opened until there are enough.
    fn gather(&mut self, root: Subtree, children: &mut Vec<Subtree>) {
        children.push(root);
        while children.len() < WIDTH {
            let openable = (0..children.len()).filter(|&i| match &children[i] {
                Subtree::Inner(_) => true,
                Subtree::Crowd(_, range) => range.len() > self.capacity(),
            });
            let area = |i: &usize| self.bounds(&children[*i]).half_area();
            let Some(largest) = openable.max_by(|a, b| area(a).total_cmp(&area(b))) else { return };
            match children.swap_remove(largest) {
                Subtree::Inner(node) => {
                    let first = self.tree.nodes[node as usize].first;
                    children.extend([self.subtree(first), self.subtree(first + 1)]);
                }
                Subtree::Crowd(bounds, range) => {
                    let middle = range.start + range.len() / 2;
                    children.push(Subtree::Crowd(bounds, range.start..middle));
                    children.push(Subtree::Crowd(bounds, middle..range.end));
                }
            }
        }
    }

    /// Writes the items of a leaf and returns its reference.
    fn leaf(&mut self, range: Range<usize>) -> u32 {
        let per_item = self.leaves.primitives_per_item;
        let count = range.len().div_ceil(per_item);
        let first = self.wide.order.len() / per_item;
        self.wide.order.extend_from_slice(&self.primitives[range]);
        self.wide.order.resize((first + count) * per_item, u32::MAX);
        leaf_reference(first, count)
    }
}

impl WideBvh {
    /// Bytes on the heap.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.order.as_slice())
    }

    /// The box around everything.
    pub(crate) fn bounds(&self) -> Bounds {
        let Some(root) = self.nodes.first() else { return Bounds::EMPTY };
        let row =
            |i: usize, f: fn(f32, f32) -> f32, start: f32| root.bounds[i].iter().copied().fold(start, f);
        let low = |axis: usize| row(2 * axis, f32::min, f32::INFINITY);
        let high = |axis: usize| row(2 * axis + 1, f32::max, f32::NEG_INFINITY);
        Bounds { min: Vec3A::new(low(0), low(1), low(2)), max: Vec3A::new(high(0), high(1), high(2)) }
    }

    /// Stack entries the worst ray needs below `node`.
    fn stack_need(&self, root: usize) -> usize {
        // Children come after their parents, so one backward pass sees every child before its parent.
        let mut need = vec![0usize; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            let present = (0..WIDTH).filter(|&slot| node.bounds[0][slot] <= node.bounds[1][slot]);
            let deepest =
                present.clone().map(|slot| need.get(node.child[slot] as usize).copied().unwrap_or(0));
            need[index] = present.count().saturating_sub(1) + deepest.max().unwrap_or(0);
        }
        need.get(root).copied().unwrap_or(0)
    }
}

//! The traversal of the wide tree, one for all uses.

use super::kernel::{BoxRay, Kernel};
use super::node::{LEAF, Node, WIDTH, leaf_items};
use arrayvec::ArrayVec;
use std::ops::Range;

/// Entries of the traversal stack. Building rejects deeper trees, so it can't overflow.
pub(crate) const STACK_SIZE: usize = 192;

/// Receives the leaves a ray passes.
pub(crate) trait Visit {
    /// Whether leaves should come roughly front to back.
    const ORDERED: bool;

    /// Nothing beyond this ray parameter matters. May shrink while walking.
    fn t_max(&self) -> f32;

    /// Looks at the items of a leaf; true ends the walk.
    fn leaf(&mut self, items: Range<usize>) -> bool;
}

/// Hands every leaf whose box the ray meets before `visitor.t_max()` to the visitor. Returns true if it ended early.
#[inline(always)]
pub(crate) fn walk<K: Kernel, V: Visit>(kernel: K, nodes: &[Node], ray: &BoxRay, visitor: &mut V) -> bool {
    // Entry distance in the high half, child reference in the low half: ordered as the non-negative distances are.
    let mut stack = ArrayVec::<u64, STACK_SIZE>::new();
    let mut entry = [0f32; WIDTH];
    let mut current = 0u32;
    if nodes.is_empty() {
        return false;
    }
    loop {
        if current & LEAF != 0 {
            if visitor.leaf(leaf_items(current)) {
                return true;
            }
        } else {
            let node = &nodes[current as usize];
            let mut mask = kernel.boxes(node, ray, visitor.t_max(), &mut entry);
            if mask != 0 {
                let slot = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if mask == 0 {
                    current = node.child[slot];
                    continue;
                }
                current = descend::<V>(node, &entry, slot, mask, &mut stack);
                continue;
            }
        }
        // The next child that is still near enough.
        loop {
            let Some(top) = stack.pop() else { return false };
            if f32::from_bits((top >> 32) as u32) <= visitor.t_max() {
                current = top as u32;
                break;
            }
        }
    }
}

/// Of several children, pushes all but the first to visit.
#[inline(always)]
fn descend<V: Visit>(
    node: &Node,
    entry: &[f32; WIDTH],
    first_slot: usize,
    mut mask: u32,
    stack: &mut ArrayVec<u64, STACK_SIZE>,
) -> u32 {
    let key = |slot: usize| u64::from(entry[slot].to_bits()) << 32 | u64::from(node.child[slot]);
    let mut nearest = key(first_slot);
    let base = stack.len();
    while mask != 0 {
        let mut far = key(mask.trailing_zeros() as usize);
        mask &= mask - 1;
        if V::ORDERED && far < nearest {
            std::mem::swap(&mut far, &mut nearest);
        }
        stack.push(far);
        if V::ORDERED {
            // Insertion from the top keeps the pushed ones in descending order: the nearest is popped first.
            let mut i = stack.len() - 1;
            while i > base && stack[i - 1] < stack[i] {
                stack.swap(i - 1, i);
                i -= 1;
            }
        }
    }
    nearest as u32
}

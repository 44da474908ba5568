//! Primitives that share a box.

use super::node::Bounds;
use glam::Vec3A;
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use std::hash::BuildHasher;

/// Primitives with bit-equal boxes: PLOC merges one pair of equal boxes a pass, which is quadratic and a tree as deep
/// as there are boxes. Instances stacked at one point are normal in production scenes.
pub(super) struct Groups {
    pub(super) boxes: Vec<Bounds>,
    /// Start of each group in `members`; one more at the end.
    start: Vec<u32>,
    pub(super) members: Vec<u32>,
}

impl Groups {
    pub(super) fn new(boxes: &[Bounds]) -> Self {
        let hashes: Vec<u64> = boxes.par_iter().map(|b| FxBuildHasher.hash_one(bits(b))).collect();
        let repeated = repeated(hashes.clone());
        let mut group_of_box = FxHashMap::<[u32; 6], u32>::default();
        let mut group_of = Vec::with_capacity(boxes.len());
        let mut unique = Vec::with_capacity(boxes.len());
        for (b, hash) in boxes.iter().zip(hashes) {
            if b.is_empty() {
                group_of.push(u32::MAX);
                continue;
            }
            let mut add = || {
                unique.push(*b);
                unique.len() as u32 - 1
            };
            // Most boxes are like no other, and looking up a million takes longer than sorting their hashes.
            let may_have_a_twin = repeated.contains(&hash);
            group_of.push(if may_have_a_twin {
                *group_of_box.entry(bits(b)).or_insert_with(add)
            } else {
                add()
            });
        }
        let mut start = vec![0u32; unique.len() + 1];
        group_of.iter().filter(|&&g| g != u32::MAX).for_each(|&g| start[g as usize + 1] += 1);
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut members = vec![0; start[unique.len()] as usize];
        for (primitive, &group) in group_of.iter().enumerate().filter(|(_, g)| **g != u32::MAX) {
            members[next[group as usize] as usize] = primitive as u32;
            next[group as usize] += 1;
        }
        Self { boxes: unique, start, members }
    }

    pub(super) fn members(&self, group: usize) -> &[u32] {
        &self.members[self.start[group] as usize..self.start[group + 1] as usize]
    }
}

fn bits(b: &Bounds) -> [u32; 6] {
    // Adding zero makes -0 and +0 one.
    let bits = |v: Vec3A| (v + Vec3A::ZERO).to_array().map(f32::to_bits);
    let ([a, b, c], [d, e, f]) = (bits(b.min), bits(b.max));
    [a, b, c, d, e, f]
}

/// Hashes that occur more than once.
fn repeated(mut hashes: Vec<u64>) -> FxHashSet<u64> {
    hashes.par_sort_unstable();
    hashes.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect()
}

//! Building: clusters are split until a node has eight children, from the root down.

use super::lanes::{LANES, Lanes};
use super::split::{bounds_of, halve_lights, split};
use super::{Child, LightTree, Node, Trail, WIDTH};
use crate::light::bounds::LightBounds;
use std::ops::Range;

/// From here on clusters are cut into halves of equal number: 11 such levels hold 2^32 lights, and the 21 levels of
/// both kinds fit a [`Trail`].
const MAX_UNEVEN_DEPTH: u32 = 10;

/// A light and what is known of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::light) struct TreeLight {
    /// Its index in the set.
    pub(in crate::light) light: u32,
    pub(in crate::light) bounds: LightBounds,
}

/// A node that waits for its children.
struct Open {
    lights: Range<usize>,
    bounds: LightBounds,
    /// Where the reference to it belongs; `None` for the root.
    parent: Option<(usize, usize)>,
    depth: u32,
    trail: Trail,
}

/// One child of a node in the making.
struct Part {
    lights: Range<usize>,
    bounds: LightBounds,
}

impl LightTree {
    /// A tree over `lights`; `on_light` receives the way to each. `None` if there are none.
    pub(in crate::light) fn build(
        mut lights: Vec<TreeLight>,
        mut on_light: impl FnMut(usize, Trail),
    ) -> Option<Self> {
        let bounds = (!lights.is_empty()).then(|| bounds_of(&lights))?;
        let is_oriented = lights.iter().any(|it| !it.bounds.cone.is_sphere());
        let root = Node { first: 0, is_wide: false };
        let mut tree = Self { lanes: Vec::new(), root, unit: 0.0, is_oriented };
        let all = 0..lights.len();
        let mut open = vec![Open { lights: all, bounds, parent: None, depth: 0, trail: Trail::default() }];
        let mut parts = Vec::with_capacity(WIDTH);
        while let Some(node) = open.pop() {
            gather(&mut lights, &node, &mut parts);
            let brightest = parts.iter().map(|part: &Part| part.bounds.intensity).fold(0.0, f64::max);
            let first = tree.add_node(&node, parts.len(), brightest);
            for (slot, part) in parts.drain(..).enumerate() {
                let (block, lane) = (first + slot / LANES, slot % LANES);
                tree.lanes[block].set(lane, &part.bounds, part.lights.len(), brightest);
                let trail = node.trail.then(node.depth, slot);
                if part.lights.len() == 1 {
                    let light = lights[part.lights.start].light as usize;
                    tree.lanes[block].child[lane] = Child::Light(light).encode();
                    on_light(light, trail);
                } else {
                    let Part { lights, bounds } = part;
                    open.push(Open {
                        lights,
                        bounds,
                        parent: Some((block, lane)),
                        depth: node.depth + 1,
                        trail,
                    });
                }
            }
        }
        Some(tree)
    }

    /// Makes room for `n_children` and tells the parent; returns the first block.
    fn add_node(&mut self, node: &Open, n_children: usize, brightest: f64) -> usize {
        let first = self.lanes.len();
        let n_blocks = n_children.div_ceil(LANES);
        self.lanes.resize(first + n_blocks, Lanes::EMPTY);
        let reference = Node { first, is_wide: n_blocks > 1 };
        match node.parent {
            Some((block, lane)) => self.lanes[block].child[lane] = Child::Node(reference).encode(),
            None => (self.root, self.unit) = (reference, brightest),
        }
        first
    }
}

/// Fills `parts` with up to eight clusters: the costliest is split until there are enough.
fn gather(lights: &mut [TreeLight], node: &Open, parts: &mut Vec<Part>) {
    parts.push(Part { lights: node.lights.clone(), bounds: node.bounds });
    while parts.len() < WIDTH {
        let is_even = node.depth >= MAX_UNEVEN_DEPTH;
        let cost = |part: &Part| if is_even { 0.0 } else { part.bounds.cost() };
        let openable = (0..parts.len()).filter(|&i| parts[i].lights.len() > 1);
        let costliest = openable.max_by(|&a, &b| {
            let (a, b) = (&parts[a], &parts[b]);
            cost(a).total_cmp(&cost(b)).then(a.lights.len().cmp(&b.lights.len()))
        });
        let Some(costliest) = costliest else { return };
        let Part { lights: range, bounds } = parts.swap_remove(costliest);
        let members = &mut lights[range.clone()];
        let n_lower = if is_even { halve_lights(members) } else { split(members, &bounds) };
        let middle = range.start + n_lower;
        for range in [range.start..middle, middle..range.end] {
            let bounds = bounds_of(&lights[range.clone()]);
            parts.push(Part { lights: range, bounds });
        }
    }
}

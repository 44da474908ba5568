//! Fewer regions: what can be spared of a field that has become too large.

use super::tree::{Node, Tree};
use super::{Field, Region};
use glam::Vec3A;

impl Field {
    /// Joins neighbouring regions, those with the fewest samples first, until there are no more than `most`; each class keeps
    /// its share, and one region at least.
    pub fn coarsen(&mut self, most: usize) {
        let all = self.surface.regions.len() + self.volume.regions.len();
        let max_lobes = self.settings.max_lobes as usize;
        for tree in [&mut self.surface, &mut self.volume] {
            let share = (tree.regions.len() * most).checked_div(all).unwrap_or(0).max(1);
            while tree.regions.len() > share {
                tree.join_pairs(tree.regions.len() - share, max_lobes);
            }
        }
    }
}

impl Tree {
    /// Joins at most `n` pairs of leaves that one plane divides.
    fn join_pairs(&mut self, n: usize, max_lobes: usize) {
        let region_of = |node: usize| self.nodes.get(node).and_then(|node| node.region());
        let pair = |(i, node): (usize, &Node)| {
            let (_, _, below) = node.children()?;
            let (one, other) = (region_of(below)?, region_of(below + 1)?);
            Some((self.regions[one].n_samples + self.regions[other].n_samples, i, one, other))
        };
        let mut pairs: Vec<_> = self.nodes.iter().enumerate().filter_map(pair).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, node, one, other) in pairs.into_iter().take(n) {
            let further = self.regions[other].clone();
            self.regions[one].join(&further, max_lobes);
            self.nodes[node] = Node::leaf(one);
        }
        *self = self.compact();
    }

    /// The same tree without nodes and regions that are out of reach.
    fn compact(&self) -> Self {
        let mut tree = Self { nodes: vec![Node::leaf(0)], regions: Vec::new() };
        let mut open = vec![(0, 0)];
        while let Some((old, new)) = open.pop() {
            let node = self.nodes[old];
            tree.nodes[new] = match (node.children(), node.region()) {
                (Some((axis, plane, below)), _) => {
                    let children = tree.nodes.len();
                    tree.nodes.extend([Node::leaf(0); 2]);
                    open.extend([(below, children), (below + 1, children + 1)]);
                    Node::inner(axis, plane, children)
                }
                (None, region) => {
                    tree.regions.extend(region.map(|region| self.regions[region].clone()));
                    Node::leaf(tree.regions.len() - 1)
                }
            };
        }
        tree
    }
}

impl Region {
    /// Makes this the region of its own space and that of its neighbour `other`.
    fn join(&mut self, other: &Self, max_lobes: usize) {
        let total = self.n_samples + other.n_samples;
        let part = if total > 0.0 { other.n_samples / total } else { 0.5 };
        let (a, b) = (Vec3A::from(self.pivot), Vec3A::from(other.pivot));
        let (spread, others) = (Vec3A::from(self.spread), Vec3A::from(other.spread));
        let within = (1.0 - part) * spread * spread + part * others * others;
        let between = part * (1.0 - part) * (b - a) * (b - a);
        self.spread = (within + between).to_array().map(f32::sqrt);
        self.move_to(a + part * (b - a));
        self.absorb(other, 1.0, max_lobes);
        self.depth = self.depth.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::trained_field;
    use crate::EventClass;
    use crate::cache::Cache;

    #[test]
    fn coarser_fields_keep_their_samples_and_stay_sound() {
        let field = trained_field();
        let size = field.statistics();
        let all = size.n_surface_regions + size.n_volume_regions;
        let mass = |field: &super::Field| {
            let (_, regions) = field.parts(EventClass::Volume);
            regions.iter().map(|region| f64::from(region.n_samples())).sum::<f64>()
        };
        for most in [all, all / 2, 3, 1, 0] {
            let mut coarse = field.clone();
            coarse.coarsen(most);
            let size = coarse.statistics();
            assert!(size.n_surface_regions + size.n_volume_regions <= most.max(2), "{most}: {size:?}");
            assert!((mass(&coarse) / mass(&field) - 1.0).abs() < 1e-4);
            let bytes = Cache { field: Some(coarse.clone()), ..Cache::default() }.to_bytes();
            assert!(Cache::from_bytes(&bytes).unwrap().field == Some(coarse));
        }
    }
}

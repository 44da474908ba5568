//! What was learned before or elsewhere: moved and weakened.

use super::Field;
use super::tree::{Node, Tree};

impl Field {
    /// The same field where all positions have `offset` added.
    pub fn translate(&mut self, offset: [f32; 3]) {
        for tree in [&mut self.surface, &mut self.volume] {
            tree.translate(offset);
        }
    }

    /// Weakens what was learned to `factor` in [0, 1] of its samples: directions and odds stay, newer samples count more.
    pub fn decay(&mut self, factor: f32) {
        let factor = if factor.is_nan() { 0.0 } else { factor.clamp(0.0, 1.0) };
        for region in self.surface.regions.iter_mut().chain(&mut self.volume.regions) {
            region.statistics.decay(factor);
            region.moments.scale(factor);
            region.n_samples *= factor;
        }
    }
}

impl Tree {
    fn translate(&mut self, offset: [f32; 3]) {
        let planes = self.nodes.iter_mut().filter_map(|node| node.children().map(|(axis, ..)| (node, axis)));
        planes.for_each(|(node, axis): (&mut Node, usize)| node.plane += offset[axis]);
        for region in &mut self.regions {
            region.pivot.iter_mut().zip(offset).for_each(|(v, o)| *v += o);
        }
    }
}

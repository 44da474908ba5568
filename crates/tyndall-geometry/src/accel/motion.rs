//! Instances that move while the shutter is open.

use super::Placement;
use crate::bvh::Bounds;
use glam::{Affine3A, Mat3A, Vec3A};

/// Boxes are larger by this part of their coordinates than those at the keys: transforms in between are rounded.
const ROUNDING: f32 = 1e-6;

/// Where a moving instance is at some moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InstanceKey {
    /// In [0, 1]: 0 when the shutter opens, 1 when it closes.
    pub time: f32,
    /// Places the object in the camera-relative world.
    pub world_from_object: Affine3A,
}

/// Between two keys matrices are interpolated linearly: every point goes straight, at an even pace.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    object: u32,
    /// One or more, at ascending times.
    keys: Vec<InstanceKey>,
}

impl Motion {
    pub(super) fn new(object: u32, keys: Vec<InstanceKey>) -> Self {
        Self { object, keys }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.keys.as_slice())
    }

    /// Where it is at `time`; before the first key and after the last one, where it is at those.
    pub(super) fn at(&self, time: f32) -> Placement {
        let next = self.keys.partition_point(|key| key.time <= time);
        let [a, b] = [next.saturating_sub(1), next.min(self.keys.len() - 1)].map(|i| &self.keys[i]);
        let share = if next == 0 || a.time == b.time { 0.0 } else { (time - a.time) / (b.time - a.time) };
        Placement::new(self.object, &between(&a.world_from_object, &b.world_from_object, share))
    }

    /// A box around it at all times: since points go straight between keys, they stay within the boxes at those.
    pub(super) fn world_bounds(&self, object: &Bounds) -> Bounds {
        let mut all = Bounds::EMPTY;
        for key in &self.keys {
            let m = &key.world_from_object;
            all = all.union(&object.transformed(&m.matrix3, m.translation));
        }
        if object.is_empty() || !all.is_finite() {
            return Bounds::EMPTY;
        }
        all.grown(ROUNDING)
    }
}

/// `a` at share 0, `b` at 1; what is the same in both stays so to the bit.
fn between(a: &Affine3A, b: &Affine3A, share: f32) -> Affine3A {
    let mix = |a: Vec3A, b: Vec3A| a + (b - a) * share;
    let (m, n) = (&a.matrix3, &b.matrix3);
    Affine3A {
        matrix3: Mat3A::from_cols(mix(m.x_axis, n.x_axis), mix(m.y_axis, n.y_axis), mix(m.z_axis, n.z_axis)),
        translation: mix(a.translation, b.translation),
    }
}

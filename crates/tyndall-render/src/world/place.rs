//! Where a prim is, at the frame's own time and while the shutter is open.

use super::placements;
use glam::{Affine3A, DAffine3, DMat3};
use tyndall_geometry::InstanceKey;
use tyndall_scene::prim::TransformKey;

/// Between two keys a product of two interpolated matrices is no straight line: so many parts of one follow it.
const PARTS_OF_PRODUCT: usize = 4;

/// One place of a prim, in f64.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    /// At the frame's own time.
    pub(super) at_frame: DAffine3,
    /// Times in [0, 1] that ascend, and where it is then; none if it stands still.
    keys: Vec<(f64, DAffine3)>,
}

impl Place {
    /// From a prim's keys; those that are out of order, outside of [0, 1] or not finite do not count.
    pub(super) fn new(at_frame: DAffine3, motion: &[TransformKey]) -> Self {
        Self::from_keys(at_frame, motion.iter().map(|key| (key.time, key.world_from_object)))
    }

    pub(super) fn from_keys(at_frame: DAffine3, given: impl Iterator<Item = (f64, DAffine3)>) -> Self {
        let mut keys = Vec::<(f64, DAffine3)>::new();
        for (time, placed) in given {
            let is_next = keys.last().is_none_or(|last| last.0 < time);
            if (0.0..=1.0).contains(&time) && is_next && placed.is_finite() {
                keys.push((time, placed));
            }
        }
        if keys.iter().all(|key| key.1 == keys[0].1) {
            keys.clear();
        }
        Self { at_frame, keys }
    }

    /// Whether it is not everywhere the same.
    pub(super) fn moves(&self) -> bool {
        !self.keys.is_empty()
    }

    /// Whether it can place a surface, at some time.
    pub(super) fn is_invertible(&self) -> bool {
        match self.keys.as_slice() {
            [] => placements::is_invertible(&self.at_frame),
            keys => keys.iter().any(|key| placements::is_invertible(&key.1)),
        }
    }

    /// `inner`, which is relative to this place.
    pub(super) fn then(&self, inner: &Self) -> Self {
        let product = |time: f64| (time, self.at(time) * inner.at(time));
        let keys = match (self.moves(), inner.moves()) {
            (false, false) => Vec::new(),
            (true, false) => self.keys.iter().map(|key| product(key.0)).collect(),
            (false, true) => inner.keys.iter().map(|key| product(key.0)).collect(),
            (true, true) => times_of_product(&self.keys, &inner.keys).into_iter().map(product).collect(),
        };
        Self { at_frame: self.at_frame * inner.at_frame, keys }
    }

    /// Its keys, each `placed` by the caller.
    pub(super) fn instance_keys(&self, placed: impl Fn(DAffine3) -> Affine3A) -> Vec<InstanceKey> {
        let keys = self.keys.iter();
        keys.map(|key| InstanceKey { time: key.0 as f32, world_from_object: placed(key.1) }).collect()
    }

    fn at(&self, time: f64) -> DAffine3 {
        let Some(last) = self.keys.len().checked_sub(1) else { return self.at_frame };
        let next = self.keys.partition_point(|key| key.0 <= time).clamp(1, last);
        let (a, b) = (&self.keys[next - 1], &self.keys[next]);
        let share = ((time - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
        if share == 1.0 { b.1 } else { between(&a.1, &b.1, share) }
    }
}

fn times_of_product(outer: &[(f64, DAffine3)], inner: &[(f64, DAffine3)]) -> Vec<f64> {
    let mut ends: Vec<f64> = outer.iter().chain(inner).map(|key| key.0).collect();
    ends.sort_unstable_by(f64::total_cmp);
    ends.dedup();
    let part = |a: f64, b: f64, i: usize| a + (b - a) * i as f64 / PARTS_OF_PRODUCT as f64;
    let within = ends.windows(2).flat_map(|w| (0..PARTS_OF_PRODUCT).map(move |i| part(w[0], w[1], i)));
    within.chain(ends.last().copied()).collect()
}

fn between(a: &DAffine3, b: &DAffine3, share: f64) -> DAffine3 {
    let (m, n) = (&a.matrix3, &b.matrix3);
    let [x, y, z] = [(m.x_axis, n.x_axis), (m.y_axis, n.y_axis), (m.z_axis, n.z_axis)]
        .map(|(from, to)| from + (to - from) * share);
    DAffine3 {
        matrix3: DMat3::from_cols(x, y, z),
        translation: a.translation + (b.translation - a.translation) * share,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn moving(keys: &[(f64, f64)]) -> Place {
        let at = |x: f64| DAffine3::from_translation(DVec3::X * x);
        Place::from_keys(at(9.0), keys.iter().map(|&(time, x)| (time, at(x))))
    }

    #[test]
    fn keys_that_say_nothing_are_none() {
        assert!(!moving(&[]).moves());
        assert!(!moving(&[(0.0, 1.0)]).moves());
        assert!(!moving(&[(0.0, 1.0), (1.0, 1.0)]).moves());
        assert!(!moving(&[(0.5, 1.0), (0.5, 2.0), (2.0, 3.0), (f64::NAN, 4.0)]).moves());
        assert!(!moving(&[(0.0, 1.0), (0.5, f64::NAN), (1.0, 1.0)]).moves());
        assert!(moving(&[(0.0, 1.0), (1.0, 2.0)]).moves());
    }

    #[test]
    fn a_product_follows_both() {
        let outer = Place::from_keys(
            DAffine3::IDENTITY,
            [(0.0, DAffine3::from_scale(DVec3::ONE)), (1.0, DAffine3::from_scale(DVec3::splat(2.0)))]
                .into_iter(),
        );
        let product = outer.then(&moving(&[(0.0, 0.0), (0.5, 1.0), (1.0, 0.0)]));
        for i in 0..=16 {
            let time = f64::from(i) / 16.0;
            let exact = (1.0 + time) * (1.0 - (2.0 * time - 1.0).abs());
            let error = product.at(time).translation.x - exact;
            // A parabola of second derivative 4, in parts of an eighth: 4 / 8 / 64.
            assert!(error.abs() <= 1.0 / 128.0 + 1e-12, "at {time}: {error}");
        }
        let still = Place::new(DAffine3::from_translation(DVec3::Y), &[]);
        let mixed = still.then(&moving(&[(0.25, 0.0), (1.0, 3.0)]));
        assert_eq!(mixed.at(0.0).translation, DVec3::Y);
        assert_eq!(mixed.at(0.5).translation, DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(mixed.at_frame.translation, DVec3::new(9.0, 1.0, 0.0));
        assert_eq!(mixed.keys.len(), 2);
    }
}

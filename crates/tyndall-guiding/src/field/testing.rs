//! Fields for the tests of other modules.

use super::tests::{SURFACE, samples, trained};
use super::{Field, TrainingSample};
use glam::Vec3A;

fn lit(seed: u64) -> Vec<TrainingSample> {
    let mut batch = samples(seed, 3000, |p, d| (8.0 * d.dot(Vec3A::Z) - 6.0 * p.x).exp() + 0.01);
    for (i, sample) in batch.iter_mut().enumerate() {
        sample.distance = if i % 3 == 0 { 2.0 } else { f32::INFINITY };
        if i % 4 == 0 {
            sample.vertex = SURFACE;
        }
    }
    batch
}

/// Some regions of both classes, with lobes near and far.
pub(crate) fn trained_field() -> Field {
    trained(&[lit(1), lit(2), lit(3)])
}

/// One more pass.
pub(crate) fn teach(field: &mut Field) {
    field.update(&lit(4));
}

//! A camera that moves while its shutter is open.

use super::rigid_part;
use glam::{DVec3, Mat3A, Quat, Vec3A};
use tyndall_scene::prim::TransformKey;
use tyndall_scene::{Diagnostics, PrimPath};

/// Where a camera is at some times, relative to the origin of camera-relative space. Between two of them it goes straight
/// and turns about one axis, each at an even pace.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    /// Two or more, at ascending times.
    places: Vec<Place>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    time: f32,
    rotation: Quat,
    position: Vec3A,
}

impl Motion {
    /// From the prim's keys; `None` of a camera that stands still.
    pub(super) fn new(
        path: &PrimPath,
        keys: &[TransformKey],
        origin: DVec3,
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        let mut places: Vec<Place> = Vec::new();
        for key in keys {
            let (rotation, position) = rigid_part(path, key.world_from_object, diagnostics);
            let (time, rotation) = (key.time as f32, Quat::from_mat3a(&rotation));
            let position = (position - origin).as_vec3a();
            let is_next = places.last().is_none_or(|last| last.time < time);
            if (0.0..=1.0).contains(&time) && is_next && position.is_finite() {
                places.push(Place { time, rotation, position });
            }
        }
        let [first, rest @ ..] = places.as_slice() else { return None };
        let moves = rest.iter().any(|p| p.rotation != first.rotation || p.position != first.position);
        moves.then_some(Self { places })
    }

    /// Rotation and position at `time` in [0, 1], 0 when the shutter opens and 1 when it closes.
    #[inline]
    pub(super) fn at(&self, time: f32) -> (Mat3A, Vec3A) {
        let next = self.places.partition_point(|place| place.time <= time).clamp(1, self.places.len() - 1);
        let (a, b) = (&self.places[next - 1], &self.places[next]);
        let share = ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0);
        (Mat3A::from_quat(a.rotation.slerp(b.rotation, share)), a.position.lerp(b.position, share))
    }
}

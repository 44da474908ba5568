//! A ray: half-open parameter interval along a line.

use glam::Vec3A;

/// Points `origin + t * direction` with `0 <= t <= t_max`.
///
/// There is no near limit: origins are moved off surfaces by [`crate::offset_ray_origin`].
/// `direction` need not be normalised (rays in object space keep the world's `t`).
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Start, in the space the name of the variable says.
    pub origin: Vec3A,
    /// Direction; `t` is measured in its length.
    pub direction: Vec3A,
    /// Far end; `f32::INFINITY` for an unbounded ray.
    pub t_max: f32,
}

impl Ray {
    /// An unbounded ray.
    #[inline]
    pub fn new(origin: Vec3A, direction: Vec3A) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// The same line ending at `t_max`.
    #[inline]
    pub fn up_to(self, t_max: f32) -> Self {
        Self { t_max, ..self }
    }

    /// The point at parameter `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3A {
        self.origin + self.direction * t
    }
}

//! Which ray belongs to a place of the image, and back: a pinhole or parallel camera as numbers.

use crate::cache::{CacheError, Reader, Writer};
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// A camera that looks along its -z, +y up. Places of the image are in [0, 1]², (0, 0) the upper left corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rotation and position on the stage.
    pub world_from_camera: DAffine3,
    /// Lower left corner of what is seen, on the plane z = -1 or, of a parallel camera, in stage units.
    pub window_min: DVec2,
    /// Its size.
    pub window_size: DVec2,
    /// Depth that rays, and their distances, begin at.
    pub near: f64,
    /// Whether all rays are parallel.
    pub is_parallel: bool,
}

impl Default for View {
    fn default() -> Self {
        Self {
            world_from_camera: DAffine3::IDENTITY,
            window_min: DVec2::splat(-0.5),
            window_size: DVec2::ONE,
            near: 0.0,
            is_parallel: false,
        }
    }
}

impl View {
    /// The point at `distance` along the ray through a place of the image.
    pub fn point(&self, image: DVec2, distance: f64) -> DVec3 {
        let film = self.window_min + self.window_size * DVec2::new(image.x, 1.0 - image.y);
        let in_camera = if self.is_parallel {
            film.extend(-(self.near + distance))
        } else {
            let direction = film.extend(-1.0);
            direction * (self.near + distance / direction.length())
        };
        self.world_from_camera.transform_point3(in_camera)
    }

    /// Where a point is seen, and its distance along that ray; `None` of points before the near plane. The place may
    /// lie outside the image.
    pub fn project(&self, point: DVec3) -> Option<(DVec2, f64)> {
        let in_camera =
            self.world_from_camera.matrix3.transpose() * (point - self.world_from_camera.translation);
        let depth = -in_camera.z;
        if depth.is_nan() || depth <= self.near {
            return None;
        }
        let (film, slant) = if self.is_parallel {
            (in_camera.truncate(), 1.0)
        } else {
            (in_camera.truncate() / depth, in_camera.length() / depth)
        };
        let place = (film - self.window_min) / self.window_size;
        Some((DVec2::new(place.x, 1.0 - place.y), (depth - self.near) * slant))
    }

    pub(crate) fn write(&self, out: &mut Writer) {
        let numbers = self.world_from_camera.to_cols_array();
        let window = [self.window_min, self.window_size].into_iter().flat_map(|v| v.to_array());
        numbers.into_iter().chain(window).chain([self.near]).for_each(|v| out.f64(v));
        out.u32(self.is_parallel.into());
    }

    pub(crate) fn read(input: &mut Reader<'_>) -> Result<Self, CacheError> {
        let mut numbers = [0.0; 17];
        for number in &mut numbers {
            *number = input.f64()?;
        }
        let [min_x, min_y, width, height, near] = std::array::from_fn(|i| numbers[12 + i]);
        let view = Self {
            world_from_camera: DAffine3::from_cols_slice(&numbers[..12]),
            window_min: DVec2::new(min_x, min_y),
            window_size: DVec2::new(width, height),
            near,
            is_parallel: input.u32()? != 0,
        };
        let is_rotation = |m: DMat3| (m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-3);
        let is_sane = numbers.iter().all(|v| v.is_finite())
            && is_rotation(view.world_from_camera.matrix3)
            && view.window_size.min_element() > 0.0;
        if is_sane { Ok(view) } else { Err(CacheError::Malformed("its camera makes no sense")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn points_are_seen_where_they_came_from(
            x in 0.0..1.0, y in 0.0..1.0, distance in 0.01..1e6, near in 0.0..3.0, is_parallel: bool, angle in -3.0..3.0
        ) {
            let turned = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle);
            let view = View {
                world_from_camera: DAffine3::from_rotation_translation(turned, DVec3::new(1e3, -7.0, 2.0)),
                window_min: DVec2::new(-0.7, -0.2),
                window_size: DVec2::new(1.3, 0.6),
                near,
                is_parallel,
            };
            let place = DVec2::new(x, y);
            let (seen, at) = view.project(view.point(place, distance)).unwrap();
            prop_assert!((seen - place).length() < 1e-6 && (at / distance - 1.0).abs() < 1e-6, "{seen} {at}");
        }
    }

    #[test]
    fn what_is_behind_is_not_seen() {
        assert_eq!(View::default().project(DVec3::Z), None);
        assert_eq!(View { near: 2.0, ..View::default() }.project(DVec3::NEG_Z), None);
    }
}

//! From a pixel position to a camera ray (UsdGeomCamera's model).

mod motion;

use glam::{DAffine3, DVec3, Mat3A, Vec2, Vec3A};
use motion::Motion;
use tyndall_guiding::image_space::View;
use tyndall_math::{Ray, sampling::concentric_disk};
use tyndall_scene::prim::{self, Projection};
use tyndall_scene::{Diagnostics, PrimPath};

/// A camera at the origin of camera-relative world space.
#[derive(Debug, Clone)]
pub struct CameraModel {
    world_from_camera: Mat3A,
    /// Of a camera that does not stand still.
    motion: Option<Motion>,
    projection: Projection,
    /// Lower left corner and size of the image on the plane z = -1 (perspective) or in stage units (orthographic).
    window_min: Vec2,
    window_size: Vec2,
    lens_radius: f32,
    focus_distance: f32,
    near: f32,
    far: f32,
    exposure_scale: f32,
}

/// A camera ray with what the integrator must know about it.
#[derive(Debug, Clone, Copy)]
pub struct CameraRay {
    /// The ray in camera-relative world space, starting at the near clipping plane, direction of unit length.
    pub ray: Ray,
    /// Depth along the viewing axis = `near_depth + t * axial_speed`.
    pub axial_speed: f32,
    /// Depth of the ray's origin.
    pub near_depth: f32,
}

impl CameraModel {
    /// From the prim; `path` is for messages. Also returns the world position that becomes the origin.
    pub fn from_prim(path: &PrimPath, camera: &prim::Camera, diagnostics: &mut Diagnostics) -> (Self, DVec3) {
        let (rotation, position) = rigid_part(path, camera.world_from_camera, diagnostics);
        let per_unit = match camera.projection {
            Projection::Perspective => camera.focal_length,
            Projection::Orthographic => 1.0,
        };
        let size = camera.aperture / per_unit;
        let center = camera.aperture_offset / per_unit;
        let is_valid = size.is_finite() && size.min_element() > 0.0 && center.is_finite();
        let (size, center) = if is_valid {
            (size.as_vec2(), center.as_vec2())
        } else {
            diagnostics.warn(
                path,
                format!(
                    "aperture {} at focal length {} has no field of view",
                    camera.aperture, camera.focal_length
                ),
                "a horizontal field of view of 45 degrees is used; author apertures and focalLength above 0",
            );
            (Vec2::new(0.828, 0.621), Vec2::ZERO)
        };
        let [near, far] = camera.clipping_range;
        let model = Self {
            world_from_camera: rotation,
            motion: Motion::new(path, &camera.motion, position, diagnostics),
            projection: camera.projection,
            window_min: center - size * 0.5,
            window_size: size,
            lens_radius: if camera.focus_distance > 0.0 { camera.lens_radius.max(0.0) as f32 } else { 0.0 },
            focus_distance: camera.focus_distance as f32,
            near: near.max(0.0) as f32,
            far: if far > near { far as f32 } else { f32::INFINITY },
            exposure_scale: camera.exposure_scale as f32,
        };
        (model, position)
    }

    /// Grows the window along one axis so that an image of `resolution` with this pixel aspect shows undistorted
    /// pixels and at least the camera's own window (UsdRender's `expandAperture`).
    pub fn fit_to(&mut self, resolution: [u32; 2], pixel_aspect: f32) {
        let image_aspect = resolution[0] as f32 * pixel_aspect / resolution[1] as f32;
        let center = self.window_min + self.window_size * 0.5;
        let size = self.window_size;
        self.window_size = if image_aspect > size.x / size.y {
            Vec2::new(size.y * image_aspect, size.y)
        } else {
            Vec2::new(size.x, size.x / image_aspect)
        };
        self.window_min = center - self.window_size * 0.5;
    }

    /// Whether rays start on a lens rather than at a point.
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Whether it moves while the shutter is open.
    pub fn moves(&self) -> bool {
        self.motion.is_some()
    }

    /// The ray through `image` in [0, 1]^2, (0, 0) the upper left corner; `lens` in [0, 1)^2; `time` in [0, 1], 0 when the
    /// shutter opens and 1 when it closes.
    #[inline]
    pub fn ray(&self, image: Vec2, lens: Vec2, time: f32) -> CameraRay {
        let film = self.window_min + self.window_size * Vec2::new(image.x, 1.0 - image.y);
        let (origin, direction) = match self.projection {
            Projection::Perspective => (Vec3A::ZERO, Vec3A::new(film.x, film.y, -1.0)),
            Projection::Orthographic => (Vec3A::new(film.x, film.y, 0.0), Vec3A::NEG_Z),
        };
        let (origin, direction) = self.through_lens(origin, direction, lens);
        let length = direction.length();
        let direction = direction / length;
        let axial_speed = -direction.z;
        let (t_near, t_far) = (self.near / axial_speed, self.far / axial_speed);
        let start = origin + direction * t_near;
        let (origin, direction) = match &self.motion {
            None => (self.world_from_camera * start, self.world_from_camera * direction),
            Some(motion) => {
                let (rotation, position) = motion.at(time);
                (rotation * start + position, rotation * direction)
            }
        };
        let ray = Ray { origin, direction, t_max: t_far - t_near };
        CameraRay { ray, axial_speed, near_depth: self.near }
    }

    /// Depth of a camera-relative point along the viewing axis.
    pub fn depth_of(&self, point: Vec3A) -> f32 {
        -self.world_from_camera.z_axis.dot(point)
    }

    /// The camera as guides know it; `position` is the stage's point that is the origin.
    pub fn view(&self, position: DVec3) -> View {
        View {
            world_from_camera: DAffine3::from_mat3_translation(self.world_from_camera.as_dmat3(), position),
            window_min: self.window_min.as_dvec2(),
            window_size: self.window_size.as_dvec2(),
            near: self.near.into(),
            is_parallel: self.projection == Projection::Orthographic,
        }
    }

    /// Nearest and farthest depth seen.
    pub fn clipping(&self) -> [f32; 2] {
        [self.near, self.far]
    }

    /// Sees everything from the camera on.
    pub fn ignore_clipping(&mut self) {
        (self.near, self.far) = (0.0, f32::INFINITY);
    }

    /// Factor on the image.
    pub fn exposure_scale(&self) -> f32 {
        self.exposure_scale
    }

    /// Moves the start over the lens, keeping the point in focus. `direction.z` is -1.
    #[inline]
    fn through_lens(&self, origin: Vec3A, direction: Vec3A, lens: Vec2) -> (Vec3A, Vec3A) {
        if self.lens_radius == 0.0 {
            return (origin, direction);
        }
        let shift = (concentric_disk(lens) * self.lens_radius).extend(0.0);
        let in_focus = origin + direction * self.focus_distance;
        let start = origin + Vec3A::from(shift);
        (start, (in_focus - start) / self.focus_distance)
    }
}

/// Rotation and position of a camera, without its scale. A matrix that has no rotation left looks along -z.
fn rigid_part(path: &PrimPath, m: DAffine3, diagnostics: &mut Diagnostics) -> (Mat3A, DVec3) {
    let position = if m.translation.is_finite() { m.translation } else { DVec3::ZERO };
    let back = m.matrix3.z_axis.try_normalize();
    let right = back.and_then(|back| m.matrix3.y_axis.cross(back).try_normalize());
    if let (Some(back), Some(right), true) = (back, right, m.is_finite()) {
        let up = back.cross(right);
        return (Mat3A::from_cols(right.as_vec3a(), up.as_vec3a(), back.as_vec3a()), position);
    }
    diagnostics.warn(
        path,
        "the camera's transform has no orientation (singular or not finite)",
        "it looks along -z; give it an invertible transform",
    );
    (Mat3A::IDENTITY, position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn model(camera: &prim::Camera) -> CameraModel {
        CameraModel::from_prim(&"/cam".into(), camera, &mut Diagnostics::default()).0
    }

    #[test]
    fn image_corners_map_to_the_film_with_row_zero_on_top() {
        let camera = prim::Camera {
            aperture: DVec2::new(20.0, 10.0),
            focal_length: 10.0,
            aperture_offset: DVec2::new(5.0, 0.0),
            ..Default::default()
        };
        let ray = model(&camera).ray(Vec2::ZERO, Vec2::ZERO, 0.0);
        let expected = Vec3A::new(-0.5, 0.5, -1.0).normalize();
        assert!((ray.ray.direction - expected).length() < 1e-6);
        assert!((ray.axial_speed - -expected.z).abs() < 1e-6);
    }

    #[test]
    fn wide_images_grow_the_window_sideways() {
        let mut m =
            model(&prim::Camera { aperture: DVec2::new(1.0, 1.0), focal_length: 0.5, ..Default::default() });
        m.fit_to([200, 100], 1.0);
        let d = m.ray(Vec2::new(1.0, 0.5), Vec2::ZERO, 0.0).ray.direction;
        assert!((d.x / -d.z - 2.0).abs() < 1e-6, "horizontal tangent doubled: {d}");
    }

    #[test]
    fn lens_rays_meet_in_the_focal_plane() {
        let camera = prim::Camera { lens_radius: 0.3, focus_distance: 4.0, ..Default::default() };
        let m = model(&camera);
        let image = Vec2::new(0.2, 0.7);
        let at_focus = |lens: Vec2| {
            let r = m.ray(image, lens, 0.0);
            r.ray.at(4.0 / r.axial_speed)
        };
        let sharp = at_focus(Vec2::splat(0.5));
        for lens in [Vec2::new(0.1, 0.2), Vec2::new(0.9, 0.6)] {
            assert!((at_focus(lens) - sharp).length() < 1e-5);
        }
    }

    #[test]
    fn near_plane_moves_the_origin_and_far_plane_ends_the_ray() {
        let m = model(&prim::Camera { clipping_range: [2.0, 10.0], ..Default::default() });
        let r = m.ray(Vec2::new(0.9, 0.1), Vec2::ZERO, 0.0);
        assert!((r.ray.origin.z + 2.0).abs() < 1e-5);
        assert!((r.ray.at(r.ray.t_max).z + 10.0).abs() < 1e-4);
    }

    #[test]
    fn singular_cameras_are_reported_and_look_along_minus_z() {
        let mut diagnostics = Diagnostics::default();
        let camera =
            prim::Camera { world_from_camera: DAffine3::from_scale(DVec3::ZERO), ..Default::default() };
        let (m, _) = CameraModel::from_prim(&"/cam".into(), &camera, &mut diagnostics);
        assert_eq!(diagnostics.as_slice().len(), 1);
        assert!(m.ray(Vec2::splat(0.5), Vec2::ZERO, 0.0).ray.direction.z < -0.99);
    }

    fn key(time: f64, world_from_object: DAffine3) -> prim::TransformKey {
        prim::TransformKey { time, world_from_object }
    }

    #[test]
    fn moving_cameras_go_straight_between_their_keys_and_turn_about_one_axis() {
        let at = |x: f64, angle: f64| {
            DAffine3::from_translation(DVec3::new(1e6 + x, 0.0, 0.0)) * DAffine3::from_rotation_y(angle)
        };
        let camera = prim::Camera {
            world_from_camera: at(1.0, 0.0),
            motion: vec![key(0.0, at(0.0, 0.0)), key(0.5, at(1.0, 0.0)), key(1.0, at(3.0, 0.5))],
            ..Default::default()
        };
        let m = model(&camera);
        assert!(m.moves());
        for (time, x, angle) in [(0.0, -1.0, 0.0), (0.25, -0.5, 0.0), (0.75, 1.0, 0.25), (1.0, 2.0, 0.5f32)] {
            let ray = m.ray(Vec2::splat(0.5), Vec2::ZERO, time).ray;
            assert!((ray.origin - Vec3A::X * x).length() < 1e-6, "at {time}: {}", ray.origin);
            let forth = Vec3A::new(-angle.sin(), 0.0, -angle.cos());
            assert!((ray.direction - forth).length() < 1e-6, "at {time}: {}", ray.direction);
        }
    }

    #[test]
    fn keys_without_motion_and_keys_out_of_order_are_none() {
        let here = DAffine3::from_translation(DVec3::X);
        let there = DAffine3::from_translation(DVec3::Y);
        for keys in [
            vec![],
            vec![key(0.0, there)],
            vec![key(0.0, here), key(1.0, here)],
            vec![key(0.5, here), key(0.5, there)],
            vec![key(f64::NAN, here), key(2.0, there)],
        ] {
            let camera = prim::Camera { world_from_camera: here, motion: keys, ..Default::default() };
            assert!(!model(&camera).moves());
        }
    }
}

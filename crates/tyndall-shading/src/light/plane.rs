//! The plane figure behind rectangles and disks: a centre, two half axes, and the side that emits.

use super::build::LightBuilder;
use glam::{DMat3, DVec3, Vec2, Vec3A};
use tyndall_math::Ray;

/// Points `center + x * axis_x + y * axis_y`; the figure is a part of `[-1, 1]^2`.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub center: Vec3A,
    pub axis_x: Vec3A,
    pub axis_y: Vec3A,
    /// Unit vector on the side that emits.
    pub normal: Vec3A,
    /// Vectors whose dot products with `p - center` are x and y.
    dual_x: Vec3A,
    dual_y: Vec3A,
}

/// A ray's hit with a plane.
pub(super) struct PlaneHit {
    pub t: f32,
    pub xy: Vec2,
}

impl Plane {
    /// The figure with half extents `half_x`, `half_y` in the light's xy plane, and the world area of the unit square;
    /// `None` if that is 0.
    pub(super) fn build(builder: &LightBuilder, half_x: f64, half_y: f64) -> Option<(Self, f64)> {
        let linear: DMat3 = builder.linear;
        let (x, y) = (linear.x_axis * half_x, linear.y_axis * half_y);
        let cross = x.cross(y);
        let area = cross.length();
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        // The side is that of the transformed -z axis, which a mirroring transform turns around.
        let side = if cross.dot(linear * DVec3::NEG_Z) > 0.0 { 1.0 } else { -1.0 };
        let unit = cross / area;
        let plane = Self {
            center: builder.center.as_vec3a(),
            axis_x: x.as_vec3a(),
            axis_y: y.as_vec3a(),
            normal: (unit * side).as_vec3a(),
            dual_x: (y.cross(unit) / area).as_vec3a(),
            dual_y: (unit.cross(x) / area).as_vec3a(),
        };
        Some((plane, area))
    }

    #[inline]
    pub(super) fn at(&self, xy: Vec2) -> Vec3A {
        self.center + self.axis_x * xy.x + self.axis_y * xy.y
    }

    /// Where the line through `origin` meets the plane, either way.
    #[inline]
    pub(super) fn hit(&self, origin: Vec3A, direction: Vec3A) -> PlaneHit {
        let to_center = self.center - origin;
        let t = self.normal.dot(to_center) / self.normal.dot(direction);
        let p = direction * t - to_center;
        PlaneHit { t, xy: Vec2::new(p.dot(self.dual_x), p.dot(self.dual_y)) }
    }

    /// The hit of a ray with the part of the plane for which `contains`.
    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, contains: impl Fn(Vec2) -> bool) -> Option<f32> {
        let hit = self.hit(ray.origin, ray.direction);
        ((0.0..=ray.t_max).contains(&hit.t) && contains(hit.xy)).then_some(hit.t)
    }

    /// Whether `from` sees the side that emits.
    #[inline]
    pub(super) fn is_seen_from(&self, from: Vec3A) -> bool {
        (from - self.center).dot(self.normal) > 0.0
    }

    /// The box around a part of the plane whose half width along each world axis is `half`.
    pub(super) fn bounds(&self, half: Vec3A) -> (Vec3A, Vec3A) {
        (self.center - half, self.center + half)
    }

    /// Density per steradian at a point `distance` away of a density per area.
    #[inline]
    pub(super) fn solid_angle_pdf(&self, pdf_area: f32, distance: f32, direction: Vec3A) -> f32 {
        let cos = -self.normal.dot(direction);
        if cos > 0.0 { pdf_area * distance * distance / cos } else { 0.0 }
    }
}

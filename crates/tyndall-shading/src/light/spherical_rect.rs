//! Uniform directions towards a rectangle.
//!
//! Ureña, Fajardo, King 2013, "An Area-Preserving Parametrization for Spherical Rectangles", doi:10.1111/cgf.12151.
//! Names follow the paper.

use super::plane::Plane;
use glam::{Vec2, Vec3A};
use std::f32::consts::PI;

/// Below this solid angle area sampling is as good, and the angles of the paper cancel in f32.
pub(super) const MIN_SOLID_ANGLE: f32 = 0.02;

/// A rectangle seen from a point.
pub(super) struct SphericalRect {
    origin: Vec3A,
    x: Vec3A,
    y: Vec3A,
    /// Pointing away from the rectangle, so that `z0` is negative.
    z: Vec3A,
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    z0: f32,
    b0: f32,
    b1: f32,
    k: f32,
    /// S.
    pub solid_angle: f32,
}

impl SphericalRect {
    /// The rectangle `plane` seen from `origin`, whose axes must be perpendicular.
    pub(super) fn new(plane: &Plane, origin: Vec3A) -> Self {
        let (half_x, half_y) = (plane.axis_x.length(), plane.axis_y.length());
        let (x, y) = (plane.axis_x / half_x, plane.axis_y / half_y);
        let d = plane.center - origin;
        let (cx, cy) = (d.dot(x), d.dot(y));
        let mut z = x.cross(y);
        let mut z0 = d.dot(z);
        if z0 > 0.0 {
            (z, z0) = (-z, -z0);
        }
        let (x0, x1, y0, y1) = (cx - half_x, cx + half_x, cy - half_y, cy + half_y);
        // Normals of the four planes through the edges: n_i is (0, z0, -y0) and so on, of which only z is needed.
        let nz = |a: f32| a / a.hypot(z0);
        let n = [nz(-y0), nz(x1), nz(y1), nz(-x0)];
        let g = |i: usize| (-n[i] * n[(i + 1) % 4]).clamp(-1.0, 1.0).acos();
        let k = 2.0 * PI - g(2) - g(3);
        let solid_angle = g(0) + g(1) - k;
        Self { origin, x, y, z, x0, x1, y0, y1, z0, b0: n[0], b1: n[2], k, solid_angle }
    }

    /// The point of the rectangle for `u`.
    pub(super) fn sample(&self, u: Vec2) -> Vec3A {
        let au = u.x * self.solid_angle + self.k;
        let fu = (au.cos() * self.b0 - self.b1) / au.sin();
        let cu = (1.0f32.copysign(fu) / (fu * fu + self.b0 * self.b0).sqrt()).clamp(-1.0, 1.0);
        let xu = (-(cu * self.z0) / (1.0 - cu * cu).max(1e-12).sqrt()).clamp(self.x0, self.x1);
        let d = xu.hypot(self.z0);
        let h0 = self.y0 / d.hypot(self.y0);
        let h1 = self.y1 / d.hypot(self.y1);
        let hv = h0 + u.y * (h1 - h0);
        let yv = (hv * d / (1.0 - hv * hv).max(1e-12).sqrt()).clamp(self.y0, self.y1);
        self.origin + self.x * xu + self.y * yv + self.z * self.z0
    }
}

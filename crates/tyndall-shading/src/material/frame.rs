//! The two normals of a hit.
//!
//! The geometric normal decides on which side a direction lies, so no light leaks through; the shading normal gives the
//! cosines. A shading normal that the viewer could not see is bent until he can (as in Keller et al. 2017, "The Iray
//! Light Transport Simulation", arXiv:1705.01263), which avoids black rims.

use glam::Vec3A;
use tyndall_math::Frame;

/// Smallest cosine between `wo` and the bent shading normal.
const MIN_COS: f32 = 1e-3;

/// Shading frame and geometric normal of a hit.
#[derive(Debug, Clone, Copy)]
pub struct ShadingFrame {
    /// z is the shading normal, on the side of the geometric normal.
    pub frame: Frame,
    /// Unit normal of the surface itself; outward for closed surfaces.
    pub geometric_normal: Vec3A,
}

impl ShadingFrame {
    /// From unit normals; the shading normal is turned to the side of the geometric one.
    #[inline]
    pub fn new(geometric_normal: Vec3A, shading_normal: Vec3A) -> Self {
        let sign = 1f32.copysign(shading_normal.dot(geometric_normal));
        Self { frame: Frame::from_normal(shading_normal * sign), geometric_normal }
    }

    /// A surface without interpolated normals.
    #[inline]
    pub fn flat(normal: Vec3A) -> Self {
        Self { frame: Frame::from_normal(normal), geometric_normal: normal }
    }

    /// This frame with the shading normal replaced by `normal` in tangent space (z along the present shading normal,
    /// x along `tangent` made perpendicular, y along `bitangent_sign` times their cross product).
    pub fn with_tangent_space_normal(&self, normal: Vec3A, tangent: Vec3A, bitangent_sign: f32) -> Self {
        let n = self.frame.normal;
        let Some(t) = (tangent - n * n.dot(tangent)).try_normalize() else { return *self };
        let b = n.cross(t) * bitangent_sign;
        let shading = t * normal.x + b * normal.y + n * normal.z;
        shading.try_normalize().map_or(*self, |shading| Self::new(self.geometric_normal, shading))
    }

    /// The frame seen from `wo`.
    #[inline]
    pub(super) fn local(&self, wo: Vec3A) -> LocalFrame {
        let is_outside = self.geometric_normal.dot(wo) >= 0.0;
        let side = if is_outside { 1.0 } else { -1.0 };
        let normal = self.frame.normal * side;
        let cos = normal.dot(wo);
        let frame = if cos >= MIN_COS {
            Frame { normal, bitangent: self.frame.bitangent * side, ..self.frame }
        } else {
            Frame::from_normal((normal + wo * (2.0 * MIN_COS - cos)).normalize())
        };
        LocalFrame { frame, geometric_normal: self.geometric_normal * side, is_outside }
    }
}

/// A [`ShadingFrame`] turned to the side of `wo`.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalFrame {
    /// z is the shading normal.
    pub frame: Frame,
    /// On the side of `wo`.
    pub geometric_normal: Vec3A,
    /// `wo` lies on the side to which the surface's own geometric normal points.
    pub is_outside: bool,
}

impl LocalFrame {
    /// Whether `wi`, given in both spaces, lies on the same side of the surface for both normals.
    #[inline]
    pub(super) fn side(&self, wi_world: Vec3A, wi_local: Vec3A) -> Option<Side> {
        let geometric = self.geometric_normal.dot(wi_world);
        if geometric > 0.0 && wi_local.z > 0.0 {
            Some(Side::Reflection)
        } else if geometric < 0.0 && wi_local.z < 0.0 {
            Some(Side::Transmission)
        } else {
            None
        }
    }
}

/// On which side of the surface `wi` lies, seen from `wo`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Reflection,
    Transmission,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_see_an_upward_frame() {
        let f = ShadingFrame::new(Vec3A::Z, Vec3A::new(0.3, 0.1, 0.9).normalize());
        for wo in [Vec3A::new(0.1, 0.2, 0.8), Vec3A::new(0.1, 0.2, -0.8), Vec3A::new(-1.0, 0.0, 0.01)] {
            let local = f.local(wo.normalize());
            let g = local.frame;
            assert!(g.normal.dot(wo.normalize()) >= 0.5 * MIN_COS);
            assert!((g.tangent.cross(g.bitangent) - g.normal).length() < 1e-5, "right-handed");
            assert_eq!(local.is_outside, wo.z > 0.0);
        }
    }
}

//! A scattering event: what direct light and the next direction need to know about it.

use glam::Vec3A;
use tyndall_math::{Ray, Rgb, offset_ray_origin};
use tyndall_shading::{Bsdf, LightSample, ShadingFrame};
use tyndall_volume::PhaseMix;

/// Where and how light scatters.
pub(super) enum Vertex<'a> {
    /// In a medium.
    Medium {
        /// Position in camera-relative world space.
        position: Vec3A,
        /// Direction in which the path travelled before.
        travel: Vec3A,
        /// Phase functions, weighted by their scattering coefficients.
        phase: PhaseMix,
    },
    /// At a surface.
    Surface {
        /// Position in camera-relative world space.
        position: Vec3A,
        /// Bound of its rounding error per axis.
        error: Vec3A,
        /// Shading frame and geometric normal.
        frame: ShadingFrame,
        /// Direction back along the path.
        wo: Vec3A,
        /// Reflection and transmission.
        bsdf: &'a Bsdf,
    },
}

impl Vertex<'_> {
    /// Position in camera-relative world space.
    #[inline]
    pub(super) fn position(&self) -> Vec3A {
        match self {
            Self::Medium { position, .. } | Self::Surface { position, .. } => *position,
        }
    }

    /// A ray origin for leaving along `direction`.
    #[inline]
    pub(super) fn origin_towards(&self, direction: Vec3A) -> Vec3A {
        match self {
            Self::Medium { position, .. } => *position,
            Self::Surface { position, error, frame, .. } => {
                offset_ray_origin(*position, *error, frame.geometric_normal, direction)
            }
        }
    }

    /// The ray to a sampled point of a light.
    #[inline]
    pub(super) fn shadow_ray(&self, light: &LightSample) -> Ray {
        Ray {
            origin: self.origin_towards(light.direction),
            direction: light.direction,
            t_max: light.distance,
        }
    }

    /// Value for light arriving from `wi` (with the cosine at surfaces), and the density per steradian with which the
    /// vertex itself would choose `wi`.
    #[inline]
    pub(super) fn evaluate(&self, wi: Vec3A) -> (Rgb, f32) {
        match self {
            Self::Medium { travel, phase, .. } => {
                let value = phase.eval_between(*travel, wi);
                (Rgb::splat(value), value)
            }
            Self::Surface { frame, wo, bsdf, .. } => {
                let value = bsdf.evaluate(frame, *wo, wi);
                (value.total(), value.pdf)
            }
        }
    }

    /// Whether no light sample can contribute.
    #[inline]
    pub(super) fn is_delta_only(&self) -> bool {
        match self {
            Self::Medium { .. } => false,
            Self::Surface { bsdf, .. } => bsdf.is_delta_only(),
        }
    }
}

//! A scattering event: what direct light and the next direction need to know about it.

use super::guided::NextDirection;
use glam::{Vec2, Vec3A};
use tyndall_math::{Ray, Rgb, SplitPoint, offset_ray_origin};
use tyndall_shading::{Bsdf, LightSample, ShadingFrame, Spread};
use tyndall_volume::PhaseMix;

/// Where and how light scatters.
pub(super) enum Vertex<'a> {
    /// In a medium.
    Medium {
        /// Position in camera-relative world space.
        point: SplitPoint,
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
            Self::Medium { point, .. } => point.high,
            Self::Surface { position, .. } => *position,
        }
    }

    /// A ray origin for leaving along `direction`. It is the vertex itself; at surfaces its `high` is on the side to
    /// which `direction` points.
    #[inline]
    pub(super) fn origin_towards(&self, direction: Vec3A) -> SplitPoint {
        match self {
            Self::Medium { point, .. } => *point,
            Self::Surface { position, error, frame, .. } => {
                let high = offset_ray_origin(*position, *error, frame.geometric_normal, direction);
                SplitPoint { high, low: *position - high }
            }
        }
    }

    /// The ray to a sampled point of a light, and what rounding took from its origin.
    #[inline]
    pub(super) fn shadow_ray(&self, light: &LightSample) -> (Ray, Vec3A) {
        let SplitPoint { high, low } = self.origin_towards(light.direction);
        (Ray { origin: high, direction: light.direction, t_max: light.distance }, low)
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

    /// A direction of the vertex's own; `None` if the light is absorbed.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 3]) -> Option<NextDirection> {
        match self {
            Self::Medium { travel, phase, .. } => {
                let sample = phase.sample(*travel, Vec2::new(u[0], u[1]));
                Some(NextDirection {
                    direction: sample.direction,
                    weight: Rgb::splat(sample.value / sample.pdf),
                    pdf: sample.pdf,
                    is_delta: false,
                })
            }
            Self::Surface { frame, wo, bsdf, .. } => {
                let sample = bsdf.sample(frame, *wo, u)?;
                Some(NextDirection {
                    direction: sample.direction,
                    weight: sample.weight,
                    pdf: sample.pdf,
                    is_delta: sample.is_delta,
                })
            }
        }
    }

    /// How widely it scatters.
    #[inline]
    pub(super) fn spread(&self) -> Spread {
        match self {
            Self::Medium { .. } => Spread::BothSides,
            Self::Surface { bsdf, .. } => bsdf.spread(),
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

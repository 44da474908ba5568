//! Ramps from 0 to 1.

use glam::Vec3A;
use std::f32::consts::TAU;

/// The shape of a ramp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Gradient {
    /// x.
    #[default]
    Linear,
    /// x squared.
    Quadratic,
    /// x, slow at both ends.
    Easing,
    /// Along x and y.
    Diagonal,
    /// 1 at the origin, 0 a unit away.
    Spherical,
    /// The square of that.
    QuadraticSphere,
    /// Around z.
    Radial,
}

impl Gradient {
    /// The ramp at `p`, in [0, 1].
    pub(crate) fn at(self, p: Vec3A) -> f32 {
        let ball = || (0.999_999 - p.length()).max(0.0);
        let value = match self {
            Self::Linear => p.x,
            Self::Quadratic => p.x.max(0.0).powi(2),
            Self::Easing => {
                let t = p.x.clamp(0.0, 1.0);
                t * t * (3.0 - 2.0 * t)
            }
            Self::Diagonal => 0.5 * (p.x + p.y),
            Self::Spherical => ball(),
            Self::QuadraticSphere => ball().powi(2),
            Self::Radial => p.y.atan2(p.x) / TAU + 0.5,
        };
        crate::material::unit(value)
    }
}

//! For whom a light is chosen.

use glam::Vec3A;

/// What receives the light. Camera-relative world space, stage units.
#[derive(Debug, Clone, Copy)]
pub enum Receiver {
    /// A point that scatters light from all directions: in a medium, or anywhere the orientation is not known.
    Point {
        /// Where.
        position: Vec3A,
    },
    /// A point on a surface.
    Surface {
        /// Where.
        position: Vec3A,
        /// Unit vector. Lights that lie entirely behind it are not asked, unless `both_sides`.
        normal: Vec3A,
        /// Light from behind counts as well: the surface transmits, or does not know its sides.
        both_sides: bool,
    },
    /// The part of a ray from which a scattering point will be chosen after the light (equi-angular sampling: Kulla &
    /// Fajardo 2012, doi:10.1111/j.1467-8659.2012.03148.x).
    Segment {
        /// Where the ray starts.
        origin: Vec3A,
        /// Unit vector.
        direction: Vec3A,
        /// Near end, a distance from `origin`.
        t0: f32,
        /// Far end; may be infinite.
        t1: f32,
    },
}

impl Receiver {
    /// What the lights send to the receiver is a mean over the length of a segment; times this it is comparable with
    /// the irradiance of lights at infinity. Of a segment longer than the scene they light only `scene_diameter`, or
    /// they would outweigh everything finite.
    #[inline]
    pub(super) fn local_factor(&self, scene_diameter: f64) -> f64 {
        match self {
            Self::Segment { t0, t1, .. } => {
                let length = f64::from(segment_length(*t0, *t1).max(f32::MIN_POSITIVE));
                length / length.min(scene_diameter)
            }
            _ => 1.0,
        }
    }
}

/// Length of a segment, with a finite stand-in for infinite ones whose square is finite.
#[inline]
pub(super) fn segment_length(t0: f32, t1: f32) -> f32 {
    const MAX_LENGTH: f32 = 1e18;
    (t1 - t0).clamp(0.0, MAX_LENGTH)
}

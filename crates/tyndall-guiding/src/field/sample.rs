//! What one segment of a path teaches the region of the vertex it leaves.

use crate::{EventClass, SegmentSample};
use glam::Vec3A;

/// The least density a sample is divided by: a direction that is almost never sampled must not teach all at once.
const PDF_MIN: f32 = 0.01;
/// Positions are kept this far from the end of f32's range, so that their differences are finite.
const POSITION_MAX: f32 = 1e30;

/// A unit vector in 4 bytes: the octahedron of Meyer et al. 2010, "On Floating-Point Normal Vectors", unfolded to a
/// square. The error is below 6.5e-5 rad, a thirtieth of the width of the sharpest lobe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PackedDirection([i16; 2]);

impl PackedDirection {
    const SCALE: f32 = 32767.0;

    /// The nearest packed direction to the unit vector `d`; one that is not finite becomes +z.
    #[inline]
    pub fn new(d: Vec3A) -> Self {
        let norm = d.x.abs() + d.y.abs() + d.z.abs();
        let (x, y) = (d.x / norm, d.y / norm);
        let (x, y) = if d.z < 0.0 { fold(x, y) } else { (x, y) };
        // The cast makes NaN 0.
        Self([x, y].map(|v| (v * Self::SCALE).round() as i16))
    }

    /// The unit vector.
    #[inline]
    pub fn unpack(self) -> Vec3A {
        let [x, y] = self.0.map(|v| (f32::from(v) / Self::SCALE).max(-1.0));
        let z = 1.0 - x.abs() - y.abs();
        let (x, y) = if z < 0.0 { fold(x, y) } else { (x, y) };
        Vec3A::new(x, y, z).normalize()
    }
}

/// Mirrors a point of the square at the edge of the upper half's diamond.
#[inline]
fn fold(x: f32, y: f32) -> (f32, f32) {
    ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y))
}

/// One segment, from the vertex it leaves to the one it ends at: 48 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainingSample {
    /// Of the vertex, world.
    pub position: [f32; 3],
    /// Away from the vertex, to where light comes from.
    pub direction: PackedDirection,
    /// X ≥ 0: radiance (largest channel) that came through the choice of the segment's end, *including* the weight W/P_v or
    /// T̂/(1-P_v) of that choice.
    pub radiance: f32,
    /// Radiance ≥ 0 collected along the segment whatever it ended with, such as the emission of media. It is guided
    /// towards, but does not enter the odds.
    pub emission: f32,
    /// Density > 0 the direction was sampled with, per steradian; values below 0.01 count as that.
    pub pdf: f32,
    /// To the next vertex; infinite for background.
    pub distance: f32,
    /// Probability of the class the segment ended with: P_v or 1-P_v.
    pub selection_probability: f32,
    /// W of the segment; 0 without media.
    pub w: f32,
    /// T̂ of the segment; 1 without media.
    pub t_hat: f32,
    /// What the vertex is on.
    pub vertex: EventClass,
    /// What the segment ended with.
    pub end: EventClass,
}

impl TrainingSample {
    /// Whether something can be learned from it.
    pub(super) fn is_usable(&self) -> bool {
        let is_amount = |v: f32| v.is_finite() && v >= 0.0;
        self.position.iter().all(|v| v.abs() <= POSITION_MAX)
            && is_amount(self.radiance)
            && is_amount(self.emission)
            && is_amount(self.pdf)
            && self.pdf > 0.0
    }

    /// The density to divide by.
    #[inline]
    pub(super) fn density(&self) -> f32 {
        self.pdf.max(PDF_MIN)
    }

    /// All light over the density.
    #[inline]
    pub(super) fn light(&self) -> f32 {
        (self.radiance + self.emission) / self.density()
    }

    /// For the odds: every segment as if it stood for all directions, 1/pdf of them. Squares then have the factor 1/pdf²,
    /// in which the published code approximates the throughput up to here.
    #[inline]
    pub(super) fn segment(&self) -> SegmentSample {
        let scale = 1.0 / self.density();
        SegmentSample {
            class: self.end,
            value: self.radiance * scale,
            probability: self.selection_probability,
            w: self.w * scale,
            t_hat: self.t_hat * scale,
            volume_depth: 0.0,
            surface_depth: 0.0,
        }
    }
}

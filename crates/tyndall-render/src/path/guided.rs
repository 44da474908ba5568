//! Directions from the field, mixed with the vertex's own: what its distribution times what the vertex does to light has
//! beyond the latter, as often as that is of all.
//!
//! One of the two is drawn, and the density of both counts (balance heuristic), so that neither a wrong field nor a
//! narrow phase function can lose light. Light sampling weighs itself against the same density.

use super::Path;
use super::guidance::{Directions, Guidance};
use super::record::Recorder;
use super::vertex::Vertex;
use glam::{Vec2, Vec3A};
use tyndall_math::Rgb;

/// A direction to go on in.
pub(super) struct NextDirection {
    pub(super) direction: Vec3A,
    /// Factor on the throughput.
    pub(super) weight: Rgb,
    /// Density per steradian; meaningless if `is_delta`.
    pub(super) pdf: f32,
    pub(super) is_delta: bool,
}

/// A vertex, and what the field says about the light that arrives there.
pub(super) struct GuidedVertex<'a, D> {
    pub(super) vertex: Vertex<'a>,
    /// See [`Guidance::directions`].
    guide: Option<D>,
}

impl<'a, D: Directions> GuidedVertex<'a, D> {
    /// Asks the field, if there is one.
    #[inline]
    pub(super) fn new(path: &mut Path<'_, impl Guidance<Directions = D>>, vertex: Vertex<'a>) -> Self {
        let guide = path.guidance.directions(&vertex, &mut path.rng);
        Self { vertex, guide }
    }

    /// Whether the field has a say.
    #[inline]
    pub(super) fn is_guided(&self) -> bool {
        self.guide.is_some()
    }

    /// Tells what guides it, if anything does.
    #[inline]
    pub(super) fn record(&self, recorder: &mut Recorder) {
        if let Some(guide) = &self.guide {
            guide.record(recorder);
        }
    }

    /// Value for light arriving from `wi` (with the cosine at surfaces), and the density per steradian with which
    /// [`Self::sample`] chooses `wi`.
    #[inline]
    pub(super) fn evaluate(&self, wi: Vec3A) -> (Rgb, f32) {
        let (value, own) = self.vertex.evaluate(wi);
        (value, self.mixed(own, wi))
    }

    #[inline]
    fn mixed(&self, own: f32, wi: Vec3A) -> f32 {
        match &self.guide {
            Some(guide) => guide.share() * guide.pdf(wi) + (1.0 - guide.share()) * own,
            None => own,
        }
    }

    /// The next direction; `None` if the light is absorbed.
    #[inline]
    pub(super) fn sample(&self, [u, v, lobe, choice]: [f32; 4]) -> Option<NextDirection> {
        let Some(guide) = &self.guide else { return self.vertex.sample([u, v, lobe]) };
        if choice < guide.share() {
            let direction = guide.sample(Vec2::new(u, v));
            let (value, pdf) = self.evaluate(direction);
            return (value != Rgb::ZERO && pdf > 0.0).then(|| NextDirection {
                direction,
                weight: value / pdf,
                pdf,
                is_delta: false,
            });
        }
        let mut own = self.vertex.sample([u, v, lobe])?;
        if own.is_delta {
            own.weight /= 1.0 - guide.share();
        } else {
            let mixed = self.mixed(own.pdf, own.direction);
            own.weight *= own.pdf / mixed;
            own.pdf = mixed;
        }
        Some(own)
    }
}

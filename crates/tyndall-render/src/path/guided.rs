//! Directions from the field: its distribution times what the vertex does to light, mixed with the vertex's own.
//!
//! One of the two is drawn, and the density of both counts (balance heuristic), so that neither a wrong field nor a
//! narrow phase function can lose light. Light sampling weighs itself against the same density.

use super::Path;
use super::record::Recorder;
use super::vertex::Vertex;
use glam::{Vec2, Vec3A};
use tyndall_guiding::directional::VmfMixture;
use tyndall_math::Rgb;
use tyndall_shading::Spread;

/// How often a direction is drawn from the field.
const SHARE: f32 = 0.5;

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
pub(super) struct GuidedVertex<'a> {
    pub(super) vertex: Vertex<'a>,
    /// Proportional to incident light times the phase function, or times the cosine.
    guide: Option<Guide>,
}

/// What is drawn from instead of the vertex's own distribution.
struct Guide {
    mixture: VmfMixture,
    /// Training samples behind it.
    n_samples: f32,
}

impl<'a> GuidedVertex<'a> {
    /// Asks the field, if there is one and the vertex scatters widely enough to follow it.
    #[inline]
    pub(super) fn new(path: &mut Path<'_>, vertex: Vertex<'a>) -> Self {
        let guide = path.field.and_then(|field| {
            let spread = vertex.spread();
            if spread == Spread::Narrow {
                return None;
            }
            let position = vertex.position();
            let region = field.region(position, vertex.class(), path.rng.next_f32())?;
            let incident = region.incident(position);
            let mixture = match &vertex {
                Vertex::Medium { travel, phase, .. } => {
                    incident.product_with_hg(-*travel, phase.mean_cosine())
                }
                Vertex::Surface { frame, wo, .. } if spread == Spread::Reflection => {
                    let normal = frame.frame.normal;
                    incident.product_with_cosine(if wo.dot(normal) < 0.0 { -normal } else { normal })
                }
                Vertex::Surface { .. } => incident.mixture().clone(),
            };
            Some(Guide { mixture, n_samples: region.n_samples() })
        });
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
        if let Some(Guide { mixture, n_samples }) = &self.guide {
            recorder.guide(*n_samples, mixture.len());
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
            Some(guide) => SHARE * guide.mixture.pdf(wi) + (1.0 - SHARE) * own,
            None => own,
        }
    }

    /// The next direction; `None` if the light is absorbed.
    #[inline]
    pub(super) fn sample(&self, [u, v, lobe, choice]: [f32; 4]) -> Option<NextDirection> {
        let Some(guide) = &self.guide else { return self.vertex.sample([u, v, lobe]) };
        if choice < SHARE {
            let direction = guide.mixture.sample(Vec2::new(u, v)).direction;
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
            own.weight /= 1.0 - SHARE;
        } else {
            let mixed = self.mixed(own.pdf, own.direction);
            own.weight *= own.pdf / mixed;
            own.pdf = mixed;
        }
        Some(own)
    }
}

//! What a path teaches the field of directions and odds: one sample for every segment it left a vertex by.

use super::guidance::Guidance;
use super::{Path, Vertex};
use arrayvec::ArrayVec;
use glam::Vec3A;
use tyndall_guiding::EventClass;
use tyndall_guiding::field::{PackedDirection, TrainingSample};
use tyndall_math::{Rgb, mean_component};
use tyndall_volume::CandidateSums;

/// Segments of a path that teach; later ones carry little.
const MAX_SEGMENTS: usize = 32;

/// How a segment ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct SegmentEnding {
    pub(super) class: EventClass,
    /// Probability of the class.
    pub(super) probability: f32,
    /// What there was to choose between.
    pub(super) sums: CandidateSums,
    /// Distance of the next vertex.
    pub(super) t: f32,
}

/// A segment whose light is not yet known.
struct Open {
    position: Vec3A,
    direction: Vec3A,
    pdf: f32,
    vertex: EventClass,
    /// Mean channel of the throughput that the segment began with.
    throughput: f32,
    /// What the path had gathered before the segment, and before its end was chosen.
    before: Rgb,
    before_choice: Rgb,
    ending: Option<SegmentEnding>,
}

/// The segments of one path that teaches.
#[derive(Default)]
pub(super) struct Trail {
    segments: ArrayVec<Open, MAX_SEGMENTS>,
}

impl SegmentEnding {
    /// Without a choice: by tracking, or where there are no media.
    pub(super) fn tracked(class: EventClass, t: f32) -> Self {
        let w = if class == EventClass::Volume { 1.0 } else { 0.0 };
        let sums = CandidateSums { w, t_hat: 1.0 - w, majorant_depth: 0.0 };
        Self { class, probability: 1.0, sums, t }
    }
}

impl Vertex<'_> {
    /// What the vertex is on.
    #[inline]
    pub(super) fn class(&self) -> EventClass {
        match self {
            Self::Medium { .. } => EventClass::Volume,
            Self::Surface { .. } => EventClass::Surface,
        }
    }
}

impl<G: Guidance> Path<'_, G> {
    /// A segment begins, its direction chosen with a finite density and its roulette survived.
    #[inline]
    pub(super) fn begin_lesson(&mut self) {
        let Some(trail) = self.guidance.trail().filter(|_| !self.origin.is_delta) else { return };
        let Some(vertex) = self.origin.vertex.take() else { return };
        let before = self.recorder.radiance();
        // Full: the rest of the path teaches nothing.
        let _ = trail.segments.try_push(Open {
            position: self.origin.position,
            direction: self.ray.direction,
            pdf: self.origin.pdf,
            vertex,
            throughput: mean_component(self.throughput),
            before,
            before_choice: before,
            ending: None,
        });
    }

    /// The current segment's end has been chosen; what it emits or scatters along it has been gathered.
    #[inline]
    pub(super) fn end_lesson(&mut self, ending: SegmentEnding) {
        let Some(trail) = self.guidance.trail() else { return };
        if let Some(open) = trail.segments.last_mut().filter(|open| open.ending.is_none()) {
            open.ending = Some(ending);
            open.before_choice = self.recorder.radiance();
        }
    }

    /// All that the path taught, once it is over.
    pub(super) fn teach(&mut self, samples: &mut Vec<TrainingSample>) {
        let gathered = self.recorder.radiance();
        let Some(trail) = self.guidance.trail() else { return };
        for open in trail.segments.drain(..) {
            let Some(ending) = open.ending else { continue };
            let per_throughput = open.throughput.recip();
            let light = |to: Rgb, from: Rgb| (mean_component(to - from) * per_throughput).max(0.0);
            samples.push(TrainingSample {
                position: open.position.to_array(),
                direction: PackedDirection::new(open.direction),
                radiance: light(gathered, open.before_choice),
                emission: light(open.before_choice, open.before),
                pdf: open.pdf,
                distance: ending.t,
                selection_probability: ending.probability,
                w: ending.sums.w,
                t_hat: ending.sums.t_hat,
                vertex: open.vertex,
                end: ending.class,
            });
        }
    }
}

//! What a path teaches about its choice between volume and surface.

use super::PathStatistics;
use super::record::Recorder;
use super::training::SegmentEnding;
use tyndall_guiding::{EventClass, SegmentSample};
use tyndall_math::{Rgb, max_component};
use tyndall_volume::CandidateSums;

/// A choice whose outcome is not yet known.
pub(super) struct Lesson {
    sums: CandidateSums,
    class: EventClass,
    /// Probability of `class`.
    probability: f32,
    /// Distance of the scattering; of the segment's end.
    depths: [f32; 2],
    /// What the path had gathered, and the rays it had traced, before.
    radiance: Rgb,
    rays: u64,
}

/// A lesson for [`tyndall_guiding::Moments`], with the rays that were traced after the choice.
pub(crate) struct Learned {
    pub(crate) sample: SegmentSample,
    pub(crate) rays: u64,
}

impl Lesson {
    /// The choice that ended a segment of length `end`.
    pub(super) fn new(
        recorder: &Recorder,
        ending: &SegmentEnding,
        end: f32,
        statistics: &PathStatistics,
    ) -> Self {
        let SegmentEnding { class, probability, sums, t } = *ending;
        Self {
            sums,
            class,
            probability,
            depths: [t, end],
            radiance: recorder.radiance(),
            rays: statistics.rays(),
        }
    }

    /// What came of it by the end of the path: X is the largest channel of what was gathered since.
    pub(super) fn learn(self, recorder: &Recorder, statistics: &PathStatistics) -> Learned {
        let sample = SegmentSample {
            class: self.class,
            value: max_component(recorder.radiance() - self.radiance).max(0.0),
            probability: self.probability,
            w: self.sums.w,
            t_hat: self.sums.t_hat,
            volume_depth: self.depths[0],
            surface_depth: self.depths[1],
        };
        Learned { sample, rays: statistics.rays() - self.rays }
    }
}

//! What happens along a segment, up to its end.

use super::equiangular::Rival;
use super::{Path, PathStatistics, Scratch};
use crate::world::SegmentEnd;
use tyndall_volume::PhaseMix;

/// Where the path goes on.
pub(super) enum Event {
    /// Scattered in a medium at this distance.
    Scatter { t: f64, phase: PhaseMix },
    /// Reached the segment's end.
    Pass,
}

impl Path<'_> {
    /// Adds the media's emission along the segment, chooses between scattering and passing, and updates the throughput.
    #[inline]
    pub(super) fn sample_segment<const MEDIA: bool>(
        &mut self,
        end: &SegmentEnd,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> Event {
        if !MEDIA {
            self.recorder.pass_first_segment(tyndall_math::Rgb::ONE);
            return Event::Pass;
        }
        let end = self.world.distance(end, &self.ray, self.low);
        let ray = self.ray.up_to(end.min(self.ray.t_max));
        self.world.find_spans(&ray, self.low, scratch);
        if scratch.spans.is_empty() {
            self.recorder.pass_first_segment(tyndall_math::Rgb::ONE);
            return Event::Pass;
        }
        let lit = self.lit_segment(&ray, scratch);
        if let Some(lit) = &lit {
            self.add_segment_light::<MEDIA>(lit, &ray, scratch, statistics);
        }
        if let Some(u) = self.first_distance.take() {
            self.rng.lead_with(u);
        }
        let walk = tyndall_volume::sample_collision(
            self.world.media(),
            &scratch.spans,
            &ray,
            self.throughput,
            &mut self.rng,
            &mut statistics.walks,
        );
        self.recorder.add_medium_light(self.throughput * walk.emission);
        self.throughput *= walk.weight;
        match walk.event {
            tyndall_volume::Event::Scatter { t, phase } => {
                self.rival = lit.map(|lit| Rival::new(self, lit, &scratch.spans, &ray, t));
                Event::Scatter { t, phase }
            }
            tyndall_volume::Event::Pass => {
                self.recorder.pass_first_segment(walk.weight);
                Event::Pass
            }
        }
    }
}

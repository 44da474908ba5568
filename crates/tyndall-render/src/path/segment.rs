//! What happens along a segment, up to its end.

use super::equiangular::{LitSegment, Rival};
use super::guidance::Guidance;
use super::lesson::Lesson;
use super::training::SegmentEnding;
use super::{Path, PathStatistics, Scratch};
use crate::world::SegmentEnd;
use tyndall_guiding::{EventClass, NormalizedFlights, SegmentGuide};
use tyndall_math::{Ray, Rgb};
use tyndall_volume::{
    Normalization, PhaseMix, ResampleOptions, Resampled, Walk, needs_candidates, resample_collision,
    sample_collision,
};

/// Where the path goes on.
pub(super) enum Event {
    /// Scattered in a medium at this distance.
    Scatter { t: f64, phase: PhaseMix },
    /// Reached the segment's end.
    Pass,
}

impl<G: Guidance> Path<'_, G> {
    /// Adds the media's emission along the segment, chooses between scattering and passing, and updates the throughput.
    #[inline]
    pub(super) fn sample_segment<const MEDIA: bool>(
        &mut self,
        end: &SegmentEnd,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> Event {
        if !MEDIA {
            return self.pass_freely(end.t());
        }
        let end = self.world.distance(end, &self.ray, self.time, self.low);
        let ray = self.ray.up_to(end.min(self.ray.t_max));
        self.world.find_spans(&ray, self.low, scratch);
        if scratch.spans.is_empty() {
            return self.pass_freely(end);
        }
        let lit = self.lit_segment(&ray, scratch);
        if let Some(lit) = &lit {
            self.add_segment_light::<MEDIA>(lit, &ray, scratch, statistics);
        }
        let walk = match self.first_choice.take() {
            Some(u) => self.sample_camera_segment::<MEDIA>(u, &ray, lit, scratch, statistics),
            None => match self.guidance.further(ray.direction) {
                Some(guide) => {
                    let u = self.rng.next_f32();
                    self.sample_guided(&guide, u, false, &ray, scratch, statistics).0.walk
                }
                None => self.track(&ray, scratch, statistics).0,
            },
        };
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

    /// Reaches the end: nothing is in the way.
    #[inline]
    fn pass_freely(&mut self, t: f32) -> Event {
        self.recorder.pass_first_segment(Rgb::ONE);
        self.end_lesson(SegmentEnding::tracked(EventClass::Surface, t));
        Event::Pass
    }

    /// The camera's: it has a guide of its own, teaches it, and may light its candidate.
    fn sample_camera_segment<const MEDIA: bool>(
        &mut self,
        u: f32,
        ray: &Ray,
        lit: Option<LitSegment>,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> Walk {
        let keeps_candidate = self.guidance.lights_candidates();
        // What a pixel chooses with is shifted also where it only tracks: that it does depends on its earlier samples.
        let may_track = !keeps_candidate && needs_candidates(self.world.media(), &scratch.spans);
        let (walk, ending) =
            match self.guidance.camera().filter(|guide| !may_track || guide.is_worth_walking()) {
                Some(guide) => {
                    let (resampled, ending) =
                        self.sample_guided(&guide, u, keeps_candidate, ray, scratch, statistics);
                    if let Some((tyndall_volume::Event::Scatter { t, phase }, weight)) = resampled.candidate {
                        self.add_candidate_light::<MEDIA>(t, phase, weight, ray, lit, scratch, statistics);
                        if ending.class == EventClass::Volume {
                            self.guidance.mark_lit();
                        }
                    }
                    (resampled.walk, ending)
                }
                None => {
                    self.rng.lead_with(u);
                    self.track(ray, scratch, statistics)
                }
            };
        if self.guidance.learns_choice() {
            self.guidance.remember(Lesson::new(&self.recorder, &ending, ray.t_max, statistics));
        }
        walk
    }

    /// By transmittance.
    fn track(
        &mut self,
        ray: &Ray,
        scratch: &Scratch,
        statistics: &mut PathStatistics,
    ) -> (Walk, SegmentEnding) {
        let walk = sample_collision(
            self.world.media(),
            &scratch.spans,
            ray,
            self.throughput,
            &mut self.rng,
            &mut statistics.walks,
        );
        self.recorder.add_medium_light(self.throughput * walk.emission, self.scatter_count);
        let (class, t) = outcome(&walk, ray);
        let ending = SegmentEnding::tracked(class, t);
        self.end_lesson(ending);
        // An unbiased estimate of what tracking's probability was.
        let scatters = class == EventClass::Volume;
        self.recorder.choose(f32::from(u8::from(scatters)), scatters);
        (walk, ending)
    }

    /// With the probability to scatter that `guide` gives.
    fn sample_guided(
        &mut self,
        guide: &SegmentGuide,
        u: f32,
        keeps_candidate: bool,
        ray: &Ray,
        scratch: &Scratch,
        statistics: &mut PathStatistics,
    ) -> (Resampled, SegmentEnding) {
        statistics.guided_segments += 1;
        let flights = guide.normalized_flights();
        let options = ResampleOptions {
            majorant_scale: guide.majorant_scale(),
            faint: guide.faint(),
            normalization: flights.map(|NormalizedFlights { target, exponent, alpha }| Normalization {
                target,
                exponent,
                alpha,
            }),
            keeps_candidate,
        };
        let resampled = resample_collision(
            self.world.media(),
            &scratch.spans,
            ray,
            self.throughput,
            options,
            |sums| guide.select_probability(sums.w, sums.t_hat, sums.majorant_depth),
            u,
            &mut self.rng,
            &mut statistics.walks,
        );
        self.recorder.add_medium_light(self.throughput * resampled.walk.emission, self.scatter_count);
        let (class, t) = outcome(&resampled.walk, ray);
        let scatters = class == EventClass::Volume;
        let probability = if scatters { resampled.probability } else { 1.0 - resampled.probability };
        let ending = SegmentEnding { class, probability, sums: resampled.sums, t };
        self.end_lesson(ending);
        // Normalised flights do not know their probability, only what it should be.
        let wanted = flights.map_or(resampled.probability, |flights| flights.target);
        self.recorder.choose(wanted, scatters);
        (resampled, ending)
    }
}

/// What a walk ended with, and where.
#[inline]
fn outcome(walk: &Walk, ray: &Ray) -> (EventClass, f32) {
    match walk.event {
        tyndall_volume::Event::Scatter { t, .. } => (EventClass::Volume, t as f32),
        tyndall_volume::Event::Pass => (EventClass::Surface, ray.t_max),
    }
}

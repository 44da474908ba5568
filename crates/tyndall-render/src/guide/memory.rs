//! Guides that outlive a render.

use super::{Earlier, LAST_LESSON, RenderGuide, trial};
use tyndall_guiding::cache::Cache;

impl RenderGuide {
    /// Takes what guides of this kind have learned before out of `memory`, and goes on from there.
    ///
    /// The lessons are counted on: they were learned from the very numbers that this render draws if it has the same seed,
    /// so those that are compared with guided probabilities must be others from the first sample on.
    ///
    /// Guides that have learned all they would from this very scene are left as they are: a render that finds them does
    /// not pay for lessons.
    pub(crate) fn recall(&mut self, memory: &mut Cache) {
        self.earlier = Earlier { samples: memory.samples, frames: memory.frames.clone() };
        let mut misses = false;
        if let Some(camera) = &mut self.camera {
            if let Some(image) = memory.image.take_if(|image| image.is_like(camera)) {
                *camera = image;
                self.recalled.camera = true;
                self.epoch = memory.lessons.max(1);
            } else {
                misses = true;
            }
        }
        if self.field.is_some() {
            if memory.field.is_some() {
                self.field = memory.field.take();
                self.recalled.field = true;
                self.epoch = memory.lessons.max(1);
            } else {
                misses = true;
            }
        }
        if !misses {
            self.last_lesson = LAST_LESSON.saturating_sub(memory.samples);
        }
    }

    /// Puts what was learned into `memory`; what it holds of guides that there were none of stays, and what others had
    /// learned stays if it did not pay here. Samples and frames are those before this render.
    pub(crate) fn remember(&self, memory: &mut Cache) {
        memory.field = self.field.clone().or_else(|| self.set_aside.field.clone()).or(memory.field.take());
        memory.image = self.camera.clone().or_else(|| self.set_aside.camera.clone()).or(memory.image.take());
        memory.lessons = memory.lessons.max(self.epoch);
        memory.samples = self.earlier.samples;
        memory.frames.clone_from(&self.earlier.frames);
    }

    /// Of the first `samples` of a pixel, those that taught every guide that is kept; `None` if nothing was learned in this
    /// render.
    pub(crate) fn taught(&self, samples: u32) -> Option<u32> {
        let last = if self.set_aside.field.is_some() || self.set_aside.camera.is_some() {
            trial::FIRST_SAMPLE
        } else {
            self.last_lesson
        };
        self.has_learned.then_some(samples.min(last).min(self.last_lesson))
    }
}

#[cfg(test)]
mod tests {
    use super::super::TileLessons;
    use super::*;
    use crate::film::Film;
    use tyndall_guiding::field::{Field, FieldSettings, PackedDirection, TrainingSample};
    use tyndall_guiding::{ClassCosts, EventClass};
    use tyndall_scene::{Guiding, RenderSettings};

    fn film() -> Film {
        Film::new(3, 1, &[]).unwrap()
    }

    fn samples() -> Vec<TrainingSample> {
        let sample = |i: u16| TrainingSample {
            position: [f32::from(i) * 0.01; 3],
            direction: PackedDirection::new(glam::Vec3A::Z),
            radiance: 1.0,
            emission: 0.0,
            pdf: 1.0,
            distance: 1.0,
            selection_probability: 0.5,
            w: 0.5,
            t_hat: 0.5,
            vertex: EventClass::Volume,
            end: EventClass::Volume,
        };
        (0..99).map(sample).collect()
    }

    fn known() -> Field {
        let mut field = Field::new(FieldSettings::default());
        field.update(&samples());
        field
    }

    /// Goes through a trial that guiding loses, for lack of pixels, and returns what is remembered.
    fn after_lost_trial(mut memory: Cache) -> (RenderGuide, Cache) {
        let film = film();
        let settings = RenderSettings { guiding: Guiding::Auto, samples: 256, ..RenderSettings::default() };
        let mut guide = RenderGuide::new(&film, &settings, true);
        guide.recall(&mut memory);
        let lesson = || TileLessons {
            moments: Vec::new(),
            costs: ClassCosts::default(),
            training: Vec::new(),
            trial: None,
        };
        for (first, end) in [(0, 16), (16, 32)] {
            if let (0, Some(field)) = (first, &mut guide.field) {
                field.update(&samples());
            }
            guide.begin_pass(first, end);
            guide.learn(&film, vec![guide.lessons(&film.tiles()[0], first, end).unwrap_or_else(lesson)]);
        }
        guide.has_learned = true;
        guide.remember(&mut memory);
        (guide, memory)
    }

    #[test]
    fn a_lost_trial_does_not_destroy_what_others_learned() {
        let others = Cache { field: Some(known()), lessons: 7, ..Cache::default() };
        let (guide, memory) = after_lost_trial(others.clone());
        assert!(guide.trial.as_ref().is_some_and(|trial| trial.chosen.is_empty()) && guide.field().is_none());
        let n_samples = |cache: &Cache| cache.field.as_ref().map(|field| field.statistics().n_samples);
        assert_eq!(n_samples(&memory), n_samples(&others).map(|n| 2 * n));
        assert_eq!(guide.taught(256), Some(trial::FIRST_SAMPLE), "it was not taught after the trial began");
    }

    #[test]
    fn a_lost_trial_forgets_the_guide_that_is_new_and_keeps_the_other() {
        let image = RenderGuide::new(&film(), &RenderSettings::default(), true).camera.expect("odds");
        let (_, memory) = after_lost_trial(Cache { image: Some(image), lessons: 7, ..Cache::default() });
        assert!(memory.image.is_some() && memory.field.is_none());
        let (_, memory) = after_lost_trial(Cache { field: Some(known()), lessons: 7, ..Cache::default() });
        assert!(memory.image.is_none() && memory.field.is_some());
    }

    #[test]
    fn a_lost_trial_forgets_what_it_was_held_for() {
        let (guide, memory) = after_lost_trial(Cache::default());
        assert!(guide.trial.as_ref().is_some_and(|trial| trial.chosen.is_empty()));
        assert!(memory.field.is_none() && guide.taught(256) == Some(LAST_LESSON));
    }
}

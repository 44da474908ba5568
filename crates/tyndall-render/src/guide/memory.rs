//! Guides that outlive a render.

use super::{LAST_LESSON, RenderGuide};
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
        let mut misses = false;
        if let Some(camera) = &mut self.camera {
            if let Some(image) = memory.image.take_if(|image| image.is_like(camera)) {
                *camera = image;
                self.epoch = memory.lessons.max(1);
            } else {
                misses = true;
            }
        }
        if self.field.is_some() {
            if memory.field.is_some() {
                self.field = memory.field.take();
                self.epoch = memory.lessons.max(1);
            } else {
                misses = true;
            }
        }
        if !misses {
            self.last_lesson = LAST_LESSON.saturating_sub(memory.samples);
        }
    }

    /// Puts what was learned into `memory`; what it holds of guides that there were none of stays.
    pub(crate) fn remember(&self, memory: &mut Cache) {
        memory.field = self.field.clone().or(memory.field.take());
        memory.image = self.camera.clone().or(memory.image.take());
        memory.lessons = memory.lessons.max(self.epoch);
    }

    /// Of the first `samples` of a pixel, those that taught; `None` if nothing was learned in this render.
    pub(crate) fn taught(&self, samples: u32) -> Option<u32> {
        self.has_learned.then_some(samples.min(self.last_lesson))
    }
}

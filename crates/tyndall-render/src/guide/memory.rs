//! Guides that outlive a render.

use super::RenderGuide;
use tyndall_guiding::cache::Cache;

impl RenderGuide {
    /// Takes what guides of this kind have learned before out of `memory`, and goes on from there.
    ///
    /// The lessons are counted on: they were learned from the very numbers that this render draws if it has the same seed,
    /// so those that are compared with guided probabilities must be others from the first sample on.
    pub(crate) fn recall(&mut self, memory: &mut Cache) {
        if let Some(camera) = &mut self.camera
            && let Some(image) = memory.image.take_if(|image| image.is_like(camera))
        {
            *camera = image;
            self.epoch = memory.lessons.max(1);
        }
        if self.field.is_some() && memory.field.is_some() {
            self.field = memory.field.take();
            self.epoch = memory.lessons.max(1);
        }
    }

    /// Puts what was learned into `memory`; what it holds of guides that there were none of stays.
    pub(crate) fn remember(&self, memory: &mut Cache) {
        memory.field = self.field.clone().or(memory.field.take());
        memory.image = self.camera.clone().or(memory.image.take());
        memory.lessons = memory.lessons.max(self.epoch);
    }
}

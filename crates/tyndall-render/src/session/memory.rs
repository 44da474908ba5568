//! What a session learned, for the next one.

use super::Session;
use std::sync::PoisonError;
use tyndall_guiding::cache::{Cache, Fingerprint, FrameRecord, Present, Reuse};

impl Session {
    /// Begins the next render with what `cache` holds, as far as it fits a scene with the fingerprint `now`.
    pub fn recall(&self, mut cache: Cache, now: &Fingerprint) -> Reuse {
        let resolution = self.settings.resolution.map(|n| n as usize);
        let (origin, view) = (self.world.origin(), self.world.camera().view(self.world.origin()));
        let now = Present { fingerprint: *now, origin: origin.into(), view, resolution };
        let reuse = self.pool.install(|| cache.reuse(&now));
        *self.memory.lock().unwrap_or_else(PoisonError::into_inner) = cache;
        reuse
    }

    /// What is known after the last render, which was of `frame` of a scene with the fingerprint `now`; `None` if nothing was
    /// learned in it, or it is not over.
    pub fn learned(&self, now: &Fingerprint, frame: f64) -> Option<Cache> {
        // The film first, as renders do.
        let film = self.film.lock().unwrap_or_else(PoisonError::into_inner);
        let (samples, of_whole_passes) = (film.min_samples(), film.next_sample());
        let guide = self.guide.lock().unwrap_or_else(PoisonError::into_inner);
        let guide = guide.as_ref().filter(|guide| guide.statistics().is_some())?;
        // A pass that was stopped has taught nothing.
        let taught = guide.taught(samples.min(of_whole_passes))?;
        let mut cache = self.memory.lock().unwrap_or_else(PoisonError::into_inner).clone();
        guide.remember(&mut cache);
        cache.fingerprint = *now;
        cache.origin = self.world.origin().into();
        cache.view = self.world.camera().view(self.world.origin());
        cache.samples = cache.samples.saturating_add(taught);
        cache.frames.extend((samples > 0).then_some(FrameRecord { frame, samples }));
        Some(cache)
    }
}

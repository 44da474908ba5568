//! What a session learned, for the next one.

use super::Session;
use std::sync::PoisonError;
use tyndall_guiding::cache::{Cache, Fingerprint, FrameRecord, Reuse};

impl Session {
    /// Begins the next render with what `cache` holds, as far as it fits a scene with the fingerprint `now`.
    pub fn recall(&self, mut cache: Cache, now: &Fingerprint) -> Reuse {
        let reuse = cache.reuse(now, self.world.origin().into());
        *self.memory.lock().unwrap_or_else(PoisonError::into_inner) = cache;
        reuse
    }

    /// What is known after the last render, which was of `frame` of a scene with the fingerprint `now`; `None` if nothing was
    /// learned in it, or it is not over.
    pub fn learned(&self, now: &Fingerprint, frame: f64) -> Option<Cache> {
        let guide = self.guide.lock().unwrap_or_else(PoisonError::into_inner);
        let guide = guide.as_ref().filter(|guide| guide.statistics().is_some())?;
        let samples = self.film().min_samples();
        let taught = guide.taught(samples)?;
        let mut cache = self.memory.lock().unwrap_or_else(PoisonError::into_inner).clone();
        guide.remember(&mut cache);
        cache.fingerprint = *now;
        cache.origin = self.world.origin().into();
        cache.camera = self.camera_matrix();
        cache.samples = cache.samples.saturating_add(taught);
        cache.frames.extend((samples > 0).then_some(FrameRecord { frame, samples }));
        Some(cache)
    }

    /// `world_from_camera`, row by row.
    fn camera_matrix(&self) -> [f64; 12] {
        let (rotation, origin) = (self.world.camera().rotation(), self.world.origin());
        std::array::from_fn(|i| {
            let (row, column) = (i / 4, i % 4);
            if column < 3 { f64::from(rotation.col(column)[row]) } else { origin[row] }
        })
    }
}

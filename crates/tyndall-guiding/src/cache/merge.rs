//! Caches of several machines or frames become one.

use super::{Cache, FrameRecord, Section};
use std::cmp::Reverse;

/// Why caches do not go together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// There are none.
    #[error("there are no caches to merge")]
    Nothing,
    /// They are of different light.
    #[error("their {} differ: what one learned is wrong for the other", section.name())]
    Differ {
        /// The two caches' places in the list.
        pair: [usize; 2],
        /// In what they differ.
        section: Section,
    },
}

/// One cache of many.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// The cache.
    pub cache: Cache,
    /// Image guides that were of other cameras or images than its own, and are not in it.
    pub images_left_out: usize,
}

impl Cache {
    /// One cache with what all of these learned. Geometry, media and cameras may differ, as those of the frames of a shot
    /// do; the result then counts as learned of the finest of them. Does not depend on the order of `caches`.
    ///
    /// # Errors
    /// There are none, or lights, materials or settings differ.
    pub fn merged(caches: Vec<Self>) -> Result<Merged, MergeError> {
        check(&caches)?;
        let mut caches = in_order_of_content(caches).into_iter();
        let Some(mut all) = caches.next() else { return Err(MergeError::Nothing) };
        let fingerprint = all.fingerprint;
        let mut images_left_out = 0;
        for mut other in caches {
            other.move_to(all.origin);
            match (&mut all.field, other.field) {
                (Some(field), Some(further)) => field.merge(&further),
                (None, further) => all.field = further,
                (Some(_), None) => {}
            }
            let sees_the_same = all.view == other.view;
            match (&mut all.image, other.image) {
                (Some(image), Some(further)) if sees_the_same && image.is_like(&further) => {
                    image.merge(&further)
                }
                (Some(_), Some(_)) => images_left_out += 1,
                (None, Some(further)) => (all.image, all.view) = (Some(further), other.view),
                (_, None) => {}
            }
            all.lessons = all.lessons.saturating_add(other.lessons).min(1 << 31);
            if other.fingerprint == fingerprint {
                all.samples = all.samples.saturating_add(other.samples);
            }
            all.frames.extend(other.frames);
        }
        all.frames.sort_by(|a: &FrameRecord, b| a.frame.total_cmp(&b.frame).then(a.samples.cmp(&b.samples)));
        Ok(Merged { cache: all, images_left_out })
    }
}

fn check(caches: &[Cache]) -> Result<(), MergeError> {
    for (i, cache) in caches.iter().enumerate() {
        let changes = cache.fingerprint.changes(&caches[0].fingerprint);
        if let Some(section) = changes.into_iter().find(|section| section.invalidates()) {
            return Err(MergeError::Differ { pair: [0, i], section });
        }
    }
    Ok(())
}

/// The finest field first; what is as fine, by its bytes.
fn in_order_of_content(caches: Vec<Cache>) -> Vec<Cache> {
    let regions = |cache: &Cache| {
        let size = cache.field.as_ref().map(|field| field.statistics());
        size.map_or(0, |size| size.n_surface_regions + size.n_volume_regions)
    };
    let key = |cache: &Cache| (Reverse(regions(cache)), *blake3::hash(&cache.to_bytes()).as_bytes());
    let mut keyed: Vec<_> = caches.into_iter().map(|cache| (key(&cache), cache)).collect();
    keyed.sort_by_key(|(key, _)| *key);
    keyed.into_iter().map(|(_, cache)| cache).collect()
}

//! Guides in the middle of a render as bytes and back, for checkpoints.
//!
//! First what a cache does not hold, in [`RECORD`] little-endian bytes: lessons so far, the last lesson, flags, who follows
//! the field, and what the trial found; then a [`Cache`] with the field and the image guide, which are read back bit for
//! bit. A render that goes on from there draws the numbers, and is guided by the odds, of one that was never stopped.

use super::{Followers, RenderGuide, TrialResult};
use tyndall_guiding::cache::Cache;

/// Bytes before those of the cache.
const RECORD: usize = 4 + 4 + 1 + 1 + 3 * 8;
const FOLLOWERS: [Followers; 3] = [Followers::All, Followers::None, Followers::Trial];

const HAS_LEARNED: u8 = 1;
const IS_RECALLED: u8 = 1 << 1;
const IS_SET_ASIDE: u8 = 1 << 2;
const WAS_TRIED: u8 = 1 << 3;
const TRIAL_GUIDES: u8 = 1 << 4;

/// What the guides of a render knew at some moment of it.
#[derive(Debug, Clone)]
pub struct GuideState(pub(crate) RenderGuide);

impl RenderGuide {
    /// As the content of a checkpoint.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let trial =
            self.trial.unwrap_or(TrialResult { error: 0.0, uncertainty: 0.0, cost: 0.0, guided: false });
        let flags = [
            (HAS_LEARNED, self.has_learned),
            (IS_RECALLED, self.is_recalled),
            (IS_SET_ASIDE, self.set_aside.is_some()),
            (WAS_TRIED, self.trial.is_some()),
            (TRIAL_GUIDES, trial.guided),
        ];
        let flags = flags.iter().filter(|(_, is_set)| *is_set).fold(0, |bits, (flag, _)| bits | flag);
        let followers = FOLLOWERS.iter().position(|&followers| followers == self.followers).unwrap_or(0);
        let mut bytes = Vec::new();
        bytes.extend(self.epoch.to_le_bytes());
        bytes.extend(self.last_lesson.to_le_bytes());
        bytes.extend([flags, followers as u8]);
        [trial.error, trial.uncertainty, trial.cost].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        debug_assert_eq!(bytes.len(), RECORD);
        // Only a field that guides nothing is set aside.
        let field = self.field.as_ref().or(self.set_aside.as_ref()).cloned();
        let cache = Cache { field, image: self.camera.clone(), ..Cache::default() };
        bytes.extend(cache.to_bytes());
        bytes
    }

    /// Whether a render that begins with `fresh` guides can have come to these.
    pub(crate) fn continues(&self, fresh: &Self) -> bool {
        let cameras_agree = match (&self.camera, &fresh.camera) {
            (Some(camera), Some(of_fresh)) => camera.is_like(of_fresh),
            (camera, of_fresh) => camera.is_some() == of_fresh.is_some(),
        };
        let lost_a_trial = self.trial.is_some_and(|trial| !trial.guided);
        cameras_agree && (self.field.is_some() || lost_a_trial) == fresh.field.is_some()
    }
}

impl GuideState {
    /// What [`RenderGuide::to_bytes`] wrote; `None` if it is anything else.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (record, cache) = bytes.split_first_chunk::<RECORD>()?;
        let mut cache = Cache::from_bytes(cache).ok()?;
        let u32_at = |i: usize| u32::from_le_bytes(std::array::from_fn(|k| record[i + k]));
        let f64_at = |i: usize| f64::from_le_bytes(std::array::from_fn(|k| record[i + k]));
        let flags = record[8];
        let is_set = |flag: u8| flags & flag != 0;
        let trial = TrialResult {
            error: f64_at(10),
            uncertainty: f64_at(18),
            cost: f64_at(26),
            guided: is_set(TRIAL_GUIDES),
        };
        let set_aside = cache.field.take_if(|_| is_set(IS_SET_ASIDE));
        if let Some(image) = &mut cache.image {
            image.make_odds();
        }
        Some(Self(RenderGuide {
            camera: cache.image,
            field: cache.field,
            followers: *FOLLOWERS.get(usize::from(record[9]))?,
            trial: is_set(WAS_TRIED).then_some(trial),
            set_aside,
            is_recalled: is_set(IS_RECALLED),
            epoch: u32_at(0),
            last_lesson: u32_at(4),
            has_learned: is_set(HAS_LEARNED),
        }))
    }
}

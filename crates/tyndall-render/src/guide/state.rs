//! Guides in the middle of a render as bytes and back, for checkpoints.
//!
//! First what a cache does not hold; then a [`Cache`] with the field and the image guide, which are read back bit for bit, and what they were taught by before. A
//! render that goes on from there draws the numbers, and is guided by the odds, of one that was never stopped.

use super::{Arm, Earlier, Phase, Recalled, RenderGuide, SetAside, TrialResult};
use serde::{Deserialize, Serialize};
use tyndall_guiding::cache::Cache;

/// What the guides of a render knew at some moment of it.
#[derive(Debug, Clone)]
pub struct GuideState(pub(crate) RenderGuide);

/// Beside what was learned.
#[derive(Serialize, Deserialize)]
struct Record {
    phase: Phase,
    arms: Vec<Arm>,
    trial: Option<TrialResult>,
    recalled: Recalled,
    epoch: u32,
    last_lesson: u32,
    has_learned: bool,
    /// Camera and field.
    are_set_aside: [bool; 2],
}

impl RenderGuide {
    /// As the content of a checkpoint.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let record = Record {
            phase: self.phase,
            arms: self.arms.clone(),
            trial: self.trial.clone(),
            recalled: self.recalled,
            epoch: self.epoch,
            last_lesson: self.last_lesson,
            has_learned: self.has_learned,
            are_set_aside: [self.set_aside.camera.is_some(), self.set_aside.field.is_some()],
        };
        // Only guides that guide nothing are set aside.
        let field = self.field.as_ref().or(self.set_aside.field.as_ref()).cloned();
        let image = self.camera.as_ref().or(self.set_aside.camera.as_ref()).cloned();
        let Earlier { samples, frames } = self.earlier.clone();
        let cache = Cache { field, image, samples, frames, ..Cache::default() };
        // Plain numbers in memory: nothing can fail.
        let mut bytes = postcard::to_stdvec(&record).expect("memory suffices");
        bytes.extend(cache.to_bytes());
        bytes
    }

    /// Whether a render that begins with `fresh` guides can have come to these.
    pub(crate) fn continues(&self, fresh: &Self) -> bool {
        let chosen = match self.phase {
            Phase::Decided(arm) => Some(arm),
            Phase::Learning | Phase::Trial => None,
        };
        let cameras_agree = match (&self.camera, &fresh.camera) {
            (Some(camera), Some(of_fresh)) => camera.is_like(of_fresh),
            (None, Some(_)) => chosen.is_some_and(|arm| !arm.odds),
            (camera, None) => camera.is_none(),
        };
        let fields_agree = match (&self.field, &fresh.field) {
            (None, Some(_)) => chosen.is_some_and(Arm::is_empty),
            (field, of_fresh) => field.is_some() == of_fresh.is_some(),
        };
        self.arms == fresh.arms && cameras_agree && fields_agree
    }
}

impl GuideState {
    /// What [`RenderGuide::to_bytes`] wrote; `None` if it is anything else.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (record, cache) = postcard::take_from_bytes::<Record>(bytes).ok()?;
        let mut cache = Cache::from_bytes(cache).ok()?;
        let [camera_aside, field_aside] = record.are_set_aside;
        if let Some(image) = &mut cache.image {
            image.make_odds();
        }
        let set_aside = SetAside {
            camera: cache.image.take_if(|_| camera_aside),
            field: cache.field.take_if(|_| field_aside),
        };
        let earlier = Earlier { samples: cache.samples, frames: cache.frames };
        let has_arms = !record.arms.is_empty() && record.arms.len() <= 4;
        has_arms.then_some(Self(RenderGuide {
            camera: cache.image,
            field: cache.field,
            phase: record.phase,
            arms: record.arms,
            trial: record.trial,
            set_aside,
            recalled: record.recalled,
            earlier,
            epoch: record.epoch,
            last_lesson: record.last_lesson,
            has_learned: record.has_learned,
        }))
    }
}

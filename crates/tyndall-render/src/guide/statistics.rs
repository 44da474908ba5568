//! How much a render has learned, and what it takes.

use super::{RenderGuide, TrialResult};
use serde::Serialize;
use tyndall_guiding::field::FieldStatistics;

/// Sizes of the guides of a render; fields of a guide that there is not are absent.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct GuideStatistics {
    /// Passes that something was learned from.
    pub lessons: u32,
    /// Bytes of the image guide.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_bytes: Option<usize>,
    /// The guide of directions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field: Option<FieldSize>,
    /// What trying the guides found, if they were tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trial: Option<TrialResult>,
}

/// How large the field is, and what it was made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct FieldSize {
    /// Regions of vertices on surfaces.
    pub surface_regions: usize,
    /// Regions of vertices in media.
    pub volume_regions: usize,
    /// Lobes in use, over all regions.
    pub lobes: usize,
    /// Size in memory.
    pub bytes: usize,
    /// Samples that were learned from.
    pub samples: u64,
    /// Samples that could not be.
    pub rejected_samples: u64,
}

impl From<FieldStatistics> for FieldSize {
    fn from(size: FieldStatistics) -> Self {
        Self {
            surface_regions: size.n_surface_regions,
            volume_regions: size.n_volume_regions,
            lobes: size.n_lobes,
            bytes: size.n_bytes,
            samples: size.n_samples,
            rejected_samples: size.n_rejected,
        }
    }
}

impl RenderGuide {
    /// `None` if nothing is guided.
    pub(crate) fn statistics(&self) -> Option<GuideStatistics> {
        let image_bytes = self.camera.as_ref().map(|camera| camera.n_bytes());
        let field = self.field.as_ref().map(|field| FieldSize::from(field.statistics()));
        let guides = image_bytes.is_some() || field.is_some() || self.trial.is_some();
        guides.then_some(GuideStatistics {
            lessons: self.epoch,
            image_bytes,
            field,
            trial: self.trial.clone(),
        })
    }
}

//! How a field learns.

use crate::directional::MAX_LOBES;

/// How a field learns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldSettings {
    /// A region with more samples than this is cut in two. At least 64.
    pub region_samples: u32,
    /// So is one with more *effective* samples (Σw)²/Σw² than this, w being light over density: what is well known can be
    /// known in finer parts, while rare light needs all samples to be found. At least 16.
    pub effective_samples: u32,
    /// Planes above a region at most, up to 32.
    pub max_depth: u32,
    /// Lobes of a region that has learned nothing yet, with the uniform one.
    pub initial_lobes: u32,
    /// Lobes of a region at most, up to [`MAX_LOBES`].
    pub max_lobes: u32,
    /// Steps of expectation maximisation per update at most, not counting those after lobes were split.
    pub max_iterations: u32,
}

impl Default for FieldSettings {
    /// By `examples/guided_balls.rs`, after 32 samples per pixel: 64 effective samples do a tenth better than 256 there, but
    /// leave odds few samples where light is even; 32 do worse, and so do regions of 4,096 samples whatever
    /// they have seen (2.6 times the variance).
    fn default() -> Self {
        Self {
            region_samples: 32_768,
            effective_samples: 256,
            max_depth: 32,
            initial_lobes: 8,
            max_lobes: MAX_LOBES as u32,
            max_iterations: 8,
        }
    }
}

impl FieldSettings {
    /// Every value moved into its range.
    pub(super) fn sane(self) -> Self {
        let max_lobes = self.max_lobes.clamp(1, MAX_LOBES as u32);
        Self {
            region_samples: self.region_samples.max(64),
            effective_samples: self.effective_samples.max(16),
            max_depth: self.max_depth.min(32),
            initial_lobes: self.initial_lobes.clamp(1, max_lobes),
            max_lobes,
            max_iterations: self.max_iterations.max(1),
        }
    }
}

//! How a field learns.

use crate::directional::MAX_LOBES;

/// How a field learns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldSettings {
    /// A region with more samples than this is cut in two. At least 64.
    pub region_samples: u32,
    /// Planes above a region at most, up to 32.
    pub max_depth: u32,
    /// Lobes of a region that has learned nothing yet, with the uniform one.
    pub initial_lobes: u32,
    /// Lobes of a region at most, up to 32.
    pub max_lobes: u32,
    /// Steps of expectation maximisation per update at most, not counting those after lobes were split.
    pub max_iterations: u32,
}

impl Default for FieldSettings {
    fn default() -> Self {
        Self {
            region_samples: 4096,
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
            max_depth: self.max_depth.min(32),
            initial_lobes: self.initial_lobes.clamp(1, max_lobes),
            max_lobes,
            max_iterations: self.max_iterations.max(1),
        }
    }
}

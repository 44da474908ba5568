//! Counts of what paths did.

use tyndall_volume::WalkStats;

/// Sums over paths; plain counts, so their order does not matter.
#[derive(Debug, Clone, Default)]
pub struct PathStatistics {
    /// Camera paths.
    pub paths: u64,
    /// Segments traced.
    pub segments: u64,
    /// Shadow rays traced.
    pub shadow_rays: u64,
    /// Scattering events at surfaces.
    pub surface_events: u64,
    /// Scattering events in media.
    pub volume_events: u64,
    /// Scattering events at which the field was asked for directions.
    pub guided_events: u64,
    /// Segments whose choice between volume and surface was guided.
    pub guided_segments: u64,
    /// Candidates, look-ups and majorant violations.
    pub walks: WalkStats,
}

impl PathStatistics {
    /// Rays of all kinds.
    pub fn rays(&self) -> u64 {
        self.segments + self.shadow_rays
    }

    /// Adds the counts of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.paths += other.paths;
        self.segments += other.segments;
        self.shadow_rays += other.shadow_rays;
        self.surface_events += other.surface_events;
        self.volume_events += other.volume_events;
        self.guided_events += other.guided_events;
        self.guided_segments += other.guided_segments;
        self.walks += other.walks;
    }
}

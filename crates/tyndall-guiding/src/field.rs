//! Light and scattering odds by place and direction, learned from paths.
//!
//! Two trees of regions, one for vertices on surfaces and one for vertices in media: the light that meets a surface comes
//! from its upper side, that inside the medium next to it from everywhere, and each deserves regions of its own size. A
//! region holds a parallax-aware mixture of von Mises–Fisher lobes (Ruppert et al. 2020, "Robust Fitting of
//! Parallax-Aware Mixtures for Path Guiding", ACM TOG 39(4), doi:10.1145/3386569.3392421) and, per lobe, the sums that
//! scattering odds are made of (Xu et al. 2024, "Volume Scattering Probability Guiding", ACM TOG 43(6)).
//!
//! ```text
//! samples ─► Field::update ─► regions ─► Field::region ─► Region::incident ─► pdf, sample, radiance, odds, products
//! ```
//!
//! | module | what |
//! |---|---|
//! | `sample` | what one segment of a path teaches |
//! | `tree` | where: planes, regions, look-ups |
//! | `refine` | which samples belong to which region; regions with many are cut |
//! | `region` | what a region has learned |
//! | `train` | what it learns from a pass |
//! | `adapt` | how many lobes it takes: those that fit badly are split |
//! | `similar` | those that are alike are merged |
//! | `parallax` | what its lobes look like from elsewhere |
//! | `incident` | what a vertex asks |
//! | `reuse` | what was learned elsewhere: moved, weakened |
//! | `coarsen` | fewer regions |
//! | `merge` | two fields that learned apart |
//! | `persist` | as bytes and back |
//! | `cells` | the boxes of all regions, for pictures |
//!
//! Cost on one core of a busy Xeon (SSE2 code, CPU time): finding one of 67,000 regions at random places takes 0.6 µs, as
//! their planes are in no cache; its lobes as seen from the vertex, with a pdf, 0.5 µs more, their product with a cosine
//! 0.6 µs, with a phase function 0.7 µs, the odds of a direction 0.5 µs (`benches/field.rs`: the same of a small field).
//! A region is 800 bytes, a mixture on the stack 224.
//!
//! Radiance may be in any linear unit; lengths and positions are in world units. Everything is plain data.
//!
//! Invariants
//! - An update is a function of the samples in their order. The number of threads does not enter; tiles that finish in
//!   another order do, so their samples must be concatenated in the order of tiles.
//! - Dark samples are samples: they lower means and odds.
//! - Look-ups do not allocate.

mod adapt;
mod cells;
mod coarsen;
mod incident;
mod merge;
mod parallax;
mod persist;
mod refine;
mod region;
mod reuse;
mod sample;
mod settings;
mod similar;
mod train;
mod tree;

pub use cells::Cell;
pub use incident::Incident;
pub use region::Region;
pub use sample::{PackedDirection, TrainingSample};
pub use settings::FieldSettings;
pub use tree::Node;

use crate::EventClass;
use glam::Vec3A;
use tree::Tree;

/// What was learned about all of space.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    settings: FieldSettings,
    surface: Tree,
    volume: Tree,
    statistics: Totals,
}

/// Samples of all updates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Totals {
    n_samples: u64,
    n_rejected: u64,
    n_updates: u32,
}

/// How large a field is and what it was made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FieldStatistics {
    /// Regions of vertices on surfaces.
    pub n_surface_regions: usize,
    /// Regions of vertices in media.
    pub n_volume_regions: usize,
    /// Lobes of all regions.
    pub n_lobes: usize,
    /// Size in memory.
    pub n_bytes: usize,
    /// Planes above the deepest region.
    pub max_depth: u32,
    /// Samples that were learned from, over all updates.
    pub n_samples: u64,
    /// Samples that could not be: a position, pdf or radiance that is not finite, or is negative.
    pub n_rejected: u64,
    /// Updates.
    pub n_updates: u32,
}

impl Field {
    /// A field that knows nothing.
    pub fn new(settings: FieldSettings) -> Self {
        let settings = settings.sane();
        Self { settings, surface: Tree::default(), volume: Tree::default(), statistics: Totals::default() }
    }

    /// How it learns.
    pub fn settings(&self) -> &FieldSettings {
        &self.settings
    }

    /// Learns from the samples of a pass, on the threads of the current rayon pool. The result depends on the order of
    /// the samples, but not on the number of threads.
    pub fn update(&mut self, samples: &[TrainingSample]) {
        self.statistics.n_updates += 1;
        let classes = [(&mut self.surface, EventClass::Surface), (&mut self.volume, EventClass::Volume)];
        for (tree, class) in classes {
            let n_used = tree.update(samples, class, &self.settings);
            self.statistics.n_samples += n_used as u64;
        }
        self.statistics.n_rejected += samples.iter().filter(|s| !s.is_usable()).count() as u64;
    }

    /// The region to ask at a vertex of this class; `None` before anything was learned about such vertices.
    ///
    /// `u` in [0, 1) blurs the borders of regions: the position is moved at random along one axis by up to half the size
    /// of its region, and the region there is taken. The choice must not change while a vertex is worked on, or its
    /// densities contradict each other.
    #[inline]
    pub fn region(&self, position: Vec3A, class: EventClass, u: f32) -> Option<&Region> {
        self.tree(class).lookup(position, u)
    }

    /// Splitting planes and leaves, and the regions that the leaves name.
    pub fn parts(&self, class: EventClass) -> (&[Node], &[Region]) {
        let tree = self.tree(class);
        (tree.nodes(), tree.regions())
    }

    /// Size and history.
    pub fn statistics(&self) -> FieldStatistics {
        let regions = || self.surface.regions().iter().chain(self.volume.regions());
        FieldStatistics {
            n_surface_regions: self.surface.regions().len(),
            n_volume_regions: self.volume.regions().len(),
            n_lobes: regions().map(|r| r.lobes().len()).sum(),
            n_bytes: self.surface.n_bytes() + self.volume.n_bytes() + size_of::<Self>(),
            max_depth: regions().map(Region::depth).max().unwrap_or(0),
            n_samples: self.statistics.n_samples,
            n_rejected: self.statistics.n_rejected,
            n_updates: self.statistics.n_updates,
        }
    }

    fn tree(&self, class: EventClass) -> &Tree {
        match class {
            EventClass::Surface => &self.surface,
            EventClass::Volume => &self.volume,
        }
    }
}

#[cfg(test)]
mod absurd_tests;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

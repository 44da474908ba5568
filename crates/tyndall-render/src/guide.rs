//! What camera rays learn: the guide of a render, and the lessons of a pass.
//!
//! A pass looks up a guide that is frozen; what its paths teach is merged after it, tile by tile in a fixed order.

use crate::film::{Film, Tile};
use crate::path::Learned;
use tyndall_guiding::image_space::ImageGuide;
use tyndall_guiding::{ClassCosts, EventClass, Moments, SegmentGuide, Strategy};
use tyndall_scene::DistanceSampling;

/// Samples a pixel after which nothing more is learned: what the last passes could still teach would guide too few.
const LAST_LESSON: u32 = 128;

/// Guides the camera rays of one render.
pub(crate) struct CameraGuide {
    image: ImageGuide,
}

/// What the paths of one tile taught in one pass.
pub(crate) struct TileLessons {
    moments: Vec<Moments>,
    costs: ClassCosts,
}

impl CameraGuide {
    /// `None` if the settings ask for none.
    pub(crate) fn new(film: &Film, sampling: DistanceSampling) -> Option<Self> {
        let strategy = match sampling {
            DistanceSampling::Auto => Strategy::Auto,
            DistanceSampling::Odds => Strategy::Odds,
            DistanceSampling::Target => Strategy::Target,
            DistanceSampling::Delta => return None,
        };
        Some(Self {
            image: ImageGuide::new([0, 0], film.width() as usize, film.height() as usize, strategy),
        })
    }

    /// What a camera ray through a pixel is told.
    #[inline]
    pub(crate) fn lookup(&self, [x, y]: [u32; 2]) -> SegmentGuide {
        self.image.lookup(x as i32, y as i32)
    }

    /// Whether a pass that ends at `target` samples a pixel is still to be learned from.
    pub(crate) fn learns_from(target: u32) -> bool {
        target <= LAST_LESSON
    }

    /// Merges the lessons of a pass, one entry a tile of `film` in its order.
    pub(crate) fn learn(&mut self, film: &Film, lessons: &[TileLessons]) {
        let width = film.width() as usize;
        let mut pass = vec![Moments::default(); width * film.height() as usize];
        let mut costs = ClassCosts::default();
        for (tile, of_tile) in film.tiles().iter().zip(lessons) {
            costs.merge(&of_tile.costs);
            for (index, moments) in of_tile.moments.iter().enumerate() {
                let (x, y) = tile.pixel(index);
                pass[y as usize * width + x as usize] = *moments;
            }
        }
        // One entry a pixel by construction: nothing to be refused.
        let learned = self.image.learn(&pass, &costs);
        debug_assert!(learned.is_ok());
    }
}

impl TileLessons {
    pub(crate) fn new(tile: &Tile) -> Self {
        Self { moments: vec![Moments::default(); tile.len()], costs: ClassCosts::default() }
    }

    /// Adds what a path through pixel `index` taught.
    pub(crate) fn add(&mut self, index: usize, learned: &Learned, guide: &SegmentGuide) {
        self.moments[index].add(&learned.sample, guide.outlier_limit());
        let costs = match learned.sample.class {
            EventClass::Volume => &mut self.costs.volume,
            EventClass::Surface => &mut self.costs.surface,
        };
        *costs = (costs.0 + learned.rays, costs.1 + 1);
    }
}

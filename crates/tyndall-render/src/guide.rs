//! What a render learns between passes: odds of camera rays, and directions and odds everywhere.
//!
//! A pass looks up guides that are frozen; what its paths teach is merged after it, tile by tile in a fixed order, so
//! that nothing depends on threads.

mod memory;
mod statistics;

pub use statistics::{FieldSize, GuideStatistics};

use crate::film::{Film, Tile};
use crate::path::{Guides, PathSample};
use tyndall_guiding::field::{Field, FieldSettings, TrainingSample};
use tyndall_guiding::image_space::ImageGuide;
use tyndall_guiding::{ClassCosts, EventClass, Moments, Strategy};
use tyndall_scene::{DistanceSampling, Guiding, RenderSettings};

/// Samples a pixel after which nothing more is learned: what the last passes could still teach would guide too few.
const LAST_LESSON: u32 = 128;

/// Paths of a pass that teach the field, at the most: bounds the memory of samples, some four of 48 bytes a path.
const TEACHING_PATHS: u64 = 1 << 19;

/// The guides of one render.
pub(crate) struct RenderGuide {
    camera: Option<ImageGuide>,
    field: Option<Field>,
    /// Lessons so far.
    epoch: u32,
}

/// What the paths of one tile teach in one pass.
pub(crate) struct TileLessons {
    /// One entry a pixel; empty without a camera guide.
    moments: Vec<Moments>,
    costs: ClassCosts,
    pub(crate) training: Vec<TrainingSample>,
}

impl RenderGuide {
    /// What the settings ask for in a scene with or without media.
    pub(crate) fn new(film: &Film, settings: &RenderSettings, has_media: bool) -> Self {
        let strategy = match settings.distance_sampling {
            DistanceSampling::Odds => Some(Strategy::Odds),
            DistanceSampling::Target => Some(Strategy::Target),
            DistanceSampling::Nds => Some(Strategy::Normalized),
            DistanceSampling::NdsPlus => Some(Strategy::NormalizedPlus),
            // `Auto` would have to measure what pays; until it does, tracking is the better bet.
            DistanceSampling::Auto | DistanceSampling::Delta => None,
        };
        let [width, height] = [film.width() as usize, film.height() as usize];
        let camera =
            strategy.filter(|_| has_media).map(|strategy| ImageGuide::new([0, 0], width, height, strategy));
        // With one event there is direct light only, and nothing to be guided.
        let has_indirect_light = settings.max_bounces > 1;
        // `Auto` would have to measure whether the field pays; until it does, it is asked for by name.
        let field = (settings.guiding == Guiding::On && has_indirect_light)
            .then(|| Field::new(FieldSettings::default()));
        Self { camera, field, epoch: 0 }
    }

    /// The field of directions, if there is one.
    pub(crate) fn field(&self) -> Option<&Field> {
        self.field.as_ref()
    }

    /// What paths through a pixel are told.
    #[inline]
    pub(crate) fn lookup(&self, [x, y]: [u32; 2]) -> Guides<'_> {
        Guides {
            camera: self.camera.as_ref().map(|camera| camera.lookup(x as i32, y as i32)),
            field: self.field.as_ref(),
            epoch: self.epoch,
        }
    }

    /// Room for what a tile teaches in a pass that ends at `target` samples a pixel; `None` if nothing is to be learned.
    pub(crate) fn lessons(&self, tile: &Tile, target: u32) -> Option<TileLessons> {
        let learns = target <= LAST_LESSON && (self.camera.is_some() || self.field.is_some());
        let n_moments = if self.camera.is_some() { tile.len() } else { 0 };
        learns.then(|| TileLessons {
            moments: vec![Moments::default(); n_moments],
            costs: ClassCosts::default(),
            training: Vec::new(),
        })
    }

    /// Of every how many samples of a pass one teaches the field; 0 if none does.
    pub(crate) fn teaching_stride(&self, pass_samples: u64) -> u64 {
        if self.field.is_some() { pass_samples.div_ceil(TEACHING_PATHS).max(1) } else { 0 }
    }

    /// Merges the lessons of a pass, one entry a tile of `film` in its order.
    pub(crate) fn learn(&mut self, film: &Film, lessons: Vec<TileLessons>) {
        self.epoch += 1;
        if let Some(camera) = &mut self.camera {
            let (pass, costs) = gather(film, &lessons);
            // One entry a pixel by construction: nothing to be refused.
            let learned = camera.learn(&pass, &costs);
            debug_assert!(learned.is_ok());
        }
        if let Some(field) = &mut self.field {
            let samples: Vec<_> = lessons.into_iter().flat_map(|of_tile| of_tile.training).collect();
            field.update(&samples);
        }
    }
}

/// The moments of all tiles as one image, and the sum of their costs.
fn gather(film: &Film, lessons: &[TileLessons]) -> (Vec<Moments>, ClassCosts) {
    let width = film.width() as usize;
    let mut image = vec![Moments::default(); width * film.height() as usize];
    let mut costs = ClassCosts::default();
    for (tile, of_tile) in film.tiles().iter().zip(lessons) {
        costs.merge(&of_tile.costs);
        for (index, moments) in of_tile.moments.iter().enumerate() {
            let (x, y) = tile.pixel(index);
            image[y as usize * width + x as usize] = *moments;
        }
    }
    (image, costs)
}

impl TileLessons {
    /// Adds what a path through pixel `index` taught.
    pub(crate) fn add(&mut self, index: usize, path: &PathSample, told: &Guides<'_>) {
        let (Some(learned), Some(camera)) = (&path.learned, &told.camera) else { return };
        self.moments[index].add(&learned.sample, camera.outlier_limit());
        let costs = match learned.sample.class {
            EventClass::Volume => &mut self.costs.volume,
            EventClass::Surface => &mut self.costs.surface,
        };
        *costs = (costs.0 + learned.rays, costs.1 + 1);
    }
}

//! What a render learns between passes: odds of camera rays, and directions and odds everywhere.
//!
//! A pass looks up guides that are frozen; what its paths teach is merged after it, tile by tile in a fixed order, so
//! that nothing depends on threads.

mod memory;
mod state;
mod statistics;
mod trial;

pub use state::GuideState;
pub use statistics::{FieldSize, GuideStatistics};
pub use trial::TrialResult;

use crate::film::{Film, Tile};
use crate::path::{Guides, PathSample, PathStatistics};
use trial::TileTrial;
use tyndall_guiding::field::{Field, FieldSettings, TrainingSample};
use tyndall_guiding::image_space::ImageGuide;
use tyndall_guiding::{ClassCosts, EventClass, Moments, Strategy};
use tyndall_scene::{DistanceSampling, Guiding, RenderSettings};

/// Samples a pixel after which nothing more is learned, those of earlier renders of the same scene included: what the last passes could still teach would guide too few.
const LAST_LESSON: u32 = 128;

/// Paths of a pass that teach the field, at the most: bounds the memory of samples, some four of 48 bytes a path.
const TEACHING_PATHS: u64 = 1 << 19;

/// Of so many samples one teaches the field: learning from a path costs about as much as the path (the kitchen after 32
/// samples: .20 of error at 2.7 times the time, for .17 at 3.6 where all teach).
const TEACHING_STRIDE: u64 = 16;

/// Paths of a pass of which none is left out of teaching: a small image or a first pass has few.
const FEW_PATHS: u64 = 1 << 14;

/// Lobes of a region at most. More are hardly better and each vertex pays for them (kitchen, 32 samples: .197 of error with
/// up to 32 lobes, .204 with 8, at 1.5 times the time).
const MAX_LOBES: u32 = 8;

/// The guides of one render.
#[derive(Debug, Clone)]
pub(crate) struct RenderGuide {
    camera: Option<ImageGuide>,
    field: Option<Field>,
    followers: Followers,
    trial: Option<TrialResult>,
    /// A field of earlier renders that did not pay in this one: it may well pay in theirs.
    set_aside: Option<Field>,
    /// Whether the field knew something before this render.
    is_recalled: bool,
    /// Lessons so far.
    epoch: u32,
    /// Samples a pixel after which nothing more is learned.
    last_lesson: u32,
    /// Whether anything was learned in this render.
    has_learned: bool,
}

/// Which pixels' paths the field guides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Followers {
    /// All of them, or all from the end of the trial on.
    All,
    /// None yet: it learns for a trial.
    None,
    /// Those of the trial.
    Trial,
}

/// What the paths of one tile teach in one pass.
pub(crate) struct TileLessons {
    /// One entry a pixel; empty without a camera guide.
    moments: Vec<Moments>,
    costs: ClassCosts,
    pub(crate) training: Vec<TrainingSample>,
    trial: Option<TileTrial>,
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
        let strategy = strategy.filter(|_| has_media);
        let camera = strategy.map(|strategy| ImageGuide::new([0, 0], width, height, strategy));
        // With one event there is direct light only, and nothing to be guided.
        let has_indirect_light = settings.max_bounces > 1;
        let followers = match settings.guiding {
            Guiding::On => Some(Followers::All),
            Guiding::Auto if settings.samples >= trial::FEWEST_SAMPLES => Some(Followers::None),
            Guiding::Auto | Guiding::Off => None,
        };
        let field_settings = FieldSettings { max_lobes: MAX_LOBES, ..FieldSettings::default() };
        let field = followers.filter(|_| has_indirect_light).map(|_| Field::new(field_settings));
        let followers = followers.unwrap_or(Followers::All);
        let last_lesson = LAST_LESSON;
        Self {
            camera,
            field,
            followers,
            trial: None,
            set_aside: None,
            is_recalled: false,
            epoch: 0,
            last_lesson,
            has_learned: false,
        }
    }

    /// A pass that takes all pixels from `first` to `end` samples comes next.
    pub(crate) fn begin_pass(&mut self, first: u32, end: u32) {
        let is_time = first >= trial::FIRST_SAMPLE && end - first >= 2 && self.epoch > 0;
        if self.followers == Followers::None && is_time {
            self.followers = Followers::Trial;
        }
    }

    /// Whether passes depend on what those before them taught.
    pub(crate) fn learns(&self) -> bool {
        self.camera.is_some() || self.field.is_some()
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
            field: self.field.as_ref().filter(|_| match self.followers {
                Followers::All => true,
                Followers::None => false,
                Followers::Trial => trial::is_guided(x, y),
            }),
            further: self.camera.as_ref().map(ImageGuide::further_segments),
            epoch: self.epoch,
        }
    }

    /// Room for what a tile teaches in a pass from `first` to `target` samples a pixel; `None` if nothing is to be learned.
    pub(crate) fn lessons(&self, tile: &Tile, first: u32, target: u32) -> Option<TileLessons> {
        let is_trial = self.followers == Followers::Trial;
        let learns = target <= self.last_lesson && self.learns();
        let n_moments = if learns && self.camera.is_some() { tile.len() } else { 0 };
        (learns || is_trial).then(|| TileLessons {
            moments: vec![Moments::default(); n_moments],
            costs: ClassCosts::default(),
            training: Vec::new(),
            trial: is_trial.then(|| TileTrial::new(tile, first, target)),
        })
    }

    /// Of every how many samples of a pass one teaches the field; 0 if none does.
    pub(crate) fn teaching_stride(&self, pass_samples: u64) -> u64 {
        let teaches = self.field.is_some() && self.followers != Followers::Trial;
        let stride = pass_samples.div_ceil(FEW_PATHS).clamp(1, TEACHING_STRIDE);
        if teaches { pass_samples.div_ceil(TEACHING_PATHS).max(stride) } else { 0 }
    }

    /// Merges the lessons of a pass, one entry a tile of `film` in its order.
    pub(crate) fn learn(&mut self, film: &Film, lessons: Vec<TileLessons>) {
        self.epoch += 1;
        let is_lesson =
            lessons.iter().any(|of_tile| !of_tile.moments.is_empty() || !of_tile.training.is_empty());
        self.has_learned |= is_lesson;
        if let Some(camera) = self.camera.as_mut().filter(|_| is_lesson) {
            let (pass, costs) = gather(film, &lessons);
            // One entry a pixel by construction: nothing to be refused.
            let learned = camera.learn(&pass, &costs);
            debug_assert!(learned.is_ok());
        }
        if self.followers == Followers::Trial {
            let result = trial::decide(film, lessons.iter().filter_map(|of_tile| of_tile.trial.as_ref()));
            self.trial = Some(result);
            self.followers = Followers::All;
            if !result.guided {
                self.set_aside = self.field.take().filter(|_| self.is_recalled);
            }
        } else if let Some(field) = &mut self.field {
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
    /// Adds what sample number `sample` of pixel `index` taught; `statistics` are those of the tile in this pass so far.
    pub(crate) fn add(
        &mut self,
        index: usize,
        sample: u32,
        path: &PathSample,
        told: &Guides<'_>,
        statistics: &PathStatistics,
    ) {
        if let Some(trial) = &mut self.trial {
            trial.add(index, sample, path, told.field.is_some(), statistics);
        }
        let (Some(learned), Some(camera)) = (&path.learned, &told.camera) else { return };
        let Some(moments) = self.moments.get_mut(index) else { return };
        moments.add(&learned.sample, camera.outlier_limit());
        let costs = match learned.sample.class {
            EventClass::Volume => &mut self.costs.volume,
            EventClass::Surface => &mut self.costs.surface,
        };
        *costs = (costs.0 + learned.rays, costs.1 + 1);
    }
}

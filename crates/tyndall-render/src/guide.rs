//! What a render learns between passes: odds of camera rays, and directions and odds everywhere.
//!
//! A pass looks up guides that are frozen; what its paths teach is merged after it, tile by tile in a fixed order, so
//! that nothing depends on threads.

mod arm;
mod memory;
mod state;
mod statistics;
mod trial;

pub use arm::Arm;
pub use state::GuideState;
pub use statistics::{FieldSize, GuideStatistics};
pub use trial::{ArmResult, TrialResult};

use crate::film::{Film, Tile};
use crate::path::{Guides, PathSample, PathStatistics};
use serde::{Deserialize, Serialize};
use trial::TileTrial;
use tyndall_guiding::cache::FrameRecord;
use tyndall_guiding::field::{Field, FieldSettings, TrainingSample};
use tyndall_guiding::image_space::ImageGuide;
use tyndall_guiding::{ClassCosts, EventClass, Moments};
use tyndall_scene::RenderSettings;

/// Samples a pixel after which nothing more is learned, those of earlier renders of the same scene included: what the last passes could still teach would guide too few.
const LAST_LESSON: u32 = 128;

/// Paths of a pass that teach the field, at the most: bounds the memory of samples, some four of 48 bytes a path.
const TEACHING_PATHS: u64 = 1 << 19;

/// Of so many samples one teaches the field: learning from a path costs about as much as the path (the kitchen after 32
/// samples: .20 of error at 2.7 times the time, for .17 at 3.6 where all teach).
const TEACHING_STRIDE: u64 = 16;

/// Paths of a pass of which none is left out of teaching: a small image or a first pass has few.
const FEW_PATHS: u64 = 1 << 14;

/// The guides of one render.
#[derive(Debug, Clone)]
pub(crate) struct RenderGuide {
    /// For the odds of camera rays.
    camera: Option<ImageGuide>,
    /// For directions, and for the odds of all other segments.
    field: Option<Field>,
    phase: Phase,
    /// What there is to choose from.
    arms: Vec<Arm>,
    trial: Option<TrialResult>,
    /// Guides of earlier renders that did not pay in this one: they may well pay in theirs.
    set_aside: SetAside,
    recalled: Recalled,
    earlier: Earlier,
    /// Lessons so far.
    epoch: u32,
    /// Samples a pixel after which nothing more is learned.
    last_lesson: u32,
    /// Whether anything was learned in this render.
    has_learned: bool,
}

/// How far the decision about what guides the paths is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    /// Guides learn for a trial; paths have the plainest arm.
    Learning,
    /// Some pixels try each arm.
    Trial,
    /// All paths have this one.
    Decided(Arm),
}

#[derive(Debug, Clone, Default)]
struct SetAside {
    camera: Option<ImageGuide>,
    field: Option<Field>,
}

/// Which guides knew something before this render.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Recalled {
    camera: bool,
    field: bool,
}

/// Of the cache that a render began with, what it had been taught by. A render that was stopped may find its own first part
/// in the file when it goes on: that is not added to.
#[derive(Debug, Clone, Default)]
struct Earlier {
    samples: u32,
    frames: Vec<FrameRecord>,
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
        let arms = Arm::candidates(settings, has_media);
        let phase = if arms.len() > 1 { Phase::Learning } else { Phase::Decided(arms[0]) };
        let [width, height] = [film.width() as usize, film.height() as usize];
        let strategy = arm::strategy(settings).filter(|_| arms.iter().any(|arm| arm.odds));
        let camera = strategy.map(|strategy| ImageGuide::new([0, 0], width, height, strategy));
        let needs_field = arms.iter().any(|arm| arm.needs_field(settings));
        let field = needs_field.then(|| Field::new(FieldSettings::default()));
        Self {
            camera,
            field,
            phase,
            arms,
            trial: None,
            set_aside: SetAside::default(),
            recalled: Recalled::default(),
            earlier: Earlier::default(),
            epoch: 0,
            last_lesson: LAST_LESSON,
            has_learned: false,
        }
    }

    /// A pass that takes all pixels from `first` to `end` samples comes next.
    pub(crate) fn begin_pass(&mut self, first: u32, end: u32) {
        let is_time = first >= trial::FIRST_SAMPLE && end - first >= 2 && self.epoch > 0;
        if self.phase == Phase::Learning && is_time {
            self.phase = Phase::Trial;
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

    /// What guides the paths of a pixel, and its number among the arms.
    #[inline]
    fn arm(&self, [x, y]: [u32; 2]) -> (usize, Arm) {
        match self.phase {
            Phase::Learning => (0, self.arms[0]),
            Phase::Trial => {
                let number = trial::arm_of(x, y, self.arms.len());
                (number, self.arms[number])
            }
            Phase::Decided(arm) => (0, arm),
        }
    }

    /// What paths through a pixel are told.
    #[inline]
    pub(crate) fn lookup(&self, [x, y]: [u32; 2]) -> Guides<'_> {
        let (number, arm) = self.arm([x, y]);
        let camera = self.camera.as_ref().filter(|_| arm.odds);
        Guides {
            arm: number,
            camera: camera.map(|camera| camera.lookup(x as i32, y as i32)),
            field: self.field.as_ref().filter(|_| !arm.is_empty()),
            directs: arm.directions,
            learns_choice: self.camera.is_some(),
            further: camera.map(ImageGuide::further_segments),
            // Paths that are told nothing may stay stratified against those before them.
            epoch: if arm.is_empty() { 0 } else { self.epoch },
        }
    }

    /// Room for what a tile teaches in a pass from `first` to `target` samples a pixel; `None` if nothing is to be learned.
    pub(crate) fn lessons(&self, tile: &Tile, first: u32, target: u32) -> Option<TileLessons> {
        let is_trial = self.phase == Phase::Trial;
        let learns = target <= self.last_lesson && self.learns();
        let n_moments = if learns && self.camera.is_some() { tile.len() } else { 0 };
        (learns || is_trial).then(|| TileLessons {
            moments: vec![Moments::default(); n_moments],
            costs: ClassCosts::default(),
            training: Vec::new(),
            trial: is_trial.then(|| TileTrial::new(tile, first, target, self.arms.len())),
        })
    }

    /// Of every how many samples of a pass one teaches the field; 0 if none does.
    pub(crate) fn teaching_stride(&self, pass_samples: u64) -> u64 {
        let teaches = self.field.is_some() && self.phase != Phase::Trial;
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
        if self.phase == Phase::Trial {
            let of_tiles = lessons.iter().filter_map(|of_tile| of_tile.trial.as_ref());
            self.decide(trial::decide(film, &self.arms, of_tiles));
        } else if let Some(field) = &mut self.field {
            let samples: Vec<_> = lessons.into_iter().flat_map(|of_tile| of_tile.training).collect();
            field.update(&samples);
        }
    }
}

impl RenderGuide {
    /// Keeps the guides that the arm chosen needs.
    fn decide(&mut self, result: TrialResult) {
        let arm = result.chosen;
        self.phase = Phase::Decided(arm);
        self.trial = Some(result);
        if !arm.odds {
            self.set_aside.camera = self.camera.take().filter(|_| self.recalled.camera);
        }
        if arm.is_empty() {
            self.set_aside.field = self.field.take().filter(|_| self.recalled.field);
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
            trial.add(index, sample, path, told.arm, statistics);
        }
        let Some(learned) = &path.learned else { return };
        let Some(moments) = self.moments.get_mut(index) else { return };
        let limit = told.camera.map_or(f32::INFINITY, |camera| camera.outlier_limit());
        moments.add(&learned.sample, limit);
        let costs = match learned.sample.class {
            EventClass::Volume => &mut self.costs.volume,
            EventClass::Surface => &mut self.costs.surface,
        };
        *costs = (costs.0 + learned.rays, costs.1 + 1);
    }
}

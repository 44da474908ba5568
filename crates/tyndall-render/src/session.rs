//! Rendering a world into a film: passes, tiles, threads, cancelling.
//!
//! Every sample is a pure function of (seed, pixel, sample index), tiles own their pixels and sums are taken in an order
//! that belongs to the film, so neither the number of threads nor a stop and a fresh start between two passes changes a
//! bit of the image. A pass that was stopped teaches nothing: it is rendered again, and teaches then.

mod memory;
mod snapshot;
mod stopwatch;

use crate::film::{Film, SAMPLE_GRID, Tile, leaf_end};
use crate::guide::{GuideState, GuideStatistics, RenderGuide, TileLessons};
use crate::path::{Integrator, PathStatistics};
use crate::world::World;
use rayon::prelude::*;
pub use snapshot::Snapshot;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use stopwatch::Stopwatch;
use tyndall_guiding::cache::Cache;
use tyndall_guiding::field::Field;
use tyndall_scene::RenderSettings;

/// Why a session could not start.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SessionError {
    /// The film cannot be made.
    #[error("{0}")]
    Film(String),
    /// Worker threads could not be started.
    #[error("cannot start {threads} worker threads: {why}; ask for fewer with --threads")]
    Threads {
        /// How many were asked for.
        threads: u32,
        /// The system's answer.
        why: String,
    },
}

/// What others may read and write while a render runs.
#[derive(Debug, Default)]
pub struct Control {
    stop: AtomicBool,
    cancel: AtomicBool,
    samples: AtomicU64,
    passes: AtomicU64,
    learning: Stopwatch,
}

impl Control {
    /// With a clock (the time since any fixed moment), so that what learning takes can be told.
    pub fn with_clock(clock: fn() -> Duration) -> Self {
        Self { learning: Stopwatch::new(clock), ..Self::default() }
    }

    /// Time spent learning so far; 0 without a clock.
    pub fn time_learning(&self) -> Duration {
        self.learning.total()
    }

    /// Asks the render to end soon; what has been done is kept. A pass that is cut off teaches nothing.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Asks the render to end at once: somebody is waiting. What has been done is kept; not even a pass that was just
    /// completed teaches, because learning takes longer than people care to wait.
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
        self.stop();
    }

    /// Whether the render is to end, soon or at once.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Pixel samples done so far.
    pub fn samples_done(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Passes over the whole image completed so far.
    pub fn passes_done(&self) -> u64 {
        self.passes.load(Ordering::Relaxed)
    }
}

/// One render of one world.
pub struct Session {
    world: Arc<World>,
    settings: RenderSettings,
    pool: rayon::ThreadPool,
    /// Shared with those who look at it between two renders: copies are large.
    film: Mutex<Arc<Film>>,
    /// The samples to be rendered.
    range: Range<u32>,
    learns: bool,
    statistics: Mutex<PathStatistics>,
    /// What renders have learned so far.
    guide: Mutex<Option<RenderGuide>>,
    /// What earlier renders learned.
    memory: Mutex<Cache>,
}

impl Session {
    /// Prepares a render.
    ///
    /// # Errors
    /// Unknown AOVs, or no threads to be had.
    pub fn new(world: Arc<World>, settings: RenderSettings) -> Result<Self, SessionError> {
        let [width, height] = settings.resolution;
        let film = Film::new(width, height, &settings.aovs).map_err(SessionError::Film)?;
        let film = film.with_matte_names(|matte| world.matte_names(matte));
        let film = if settings.noise_threshold > 0.0 { film.adaptive() } else { film };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads as usize)
            .thread_name(|i| format!("tyndall-{i}"))
            .build()
            .map_err(|e| SessionError::Threads { threads: settings.threads, why: e.to_string() })?;
        let range = 0..settings.samples;
        let learns = RenderGuide::new(&film, &settings, world.has_media()).learns();
        let film = Mutex::new(Arc::new(film));
        let (statistics, guide, memory) = (Mutex::default(), Mutex::default(), Mutex::default());
        Ok(Self { world, settings, pool, film, range, learns, statistics, guide, memory })
    }

    /// The session, rendering only these samples of every pixel: a part that [`Film::append`] adds to others.
    ///
    /// # Errors
    /// The range is empty or ends beyond the settings' samples, or other parts could not go on from its borders.
    pub fn restricted_to(mut self, range: Range<u32>) -> Result<Self, SessionError> {
        let refuse = |why: String| Err(SessionError::Film(why));
        let (Range { start, end }, samples) = (range, self.settings.samples);
        if start >= end || end > samples {
            return refuse(format!("samples {start}:{end} are not a range within 0:{samples}"));
        }
        if self.settings.noise_threshold > 0.0 {
            return refuse(
                "a noise threshold decides by all samples of a pixel, and a part has only some".to_owned(),
            );
        }
        if !end.is_multiple_of(SAMPLE_GRID) && end != samples {
            return refuse(format!(
                "a part ends before sample {end}, which is neither a multiple of {SAMPLE_GRID} nor the end, {samples}"
            ));
        }
        let [width, height] = self.settings.resolution;
        let film =
            Film::starting_at(start, width, height, &self.settings.aovs).map_err(SessionError::Film)?;
        let film = film.with_matte_names(|matte| self.world.matte_names(matte));
        self.film = Mutex::new(Arc::new(film));
        self.range = start..end;
        Ok(self)
    }

    /// Goes on from the film of an earlier session with the same world and settings, and from what its guides knew then.
    ///
    /// # Errors
    /// The film has another size, other AOVs or another first sample than the next one to be made; or guides learn here
    /// and `guide` is not of such a render.
    pub fn resume(&self, earlier: &Film, guide: Option<&GuideState>) -> Result<(), SessionError> {
        let mut film = self.film.lock().unwrap_or_else(PoisonError::into_inner);
        let fresh = self.fresh_guide(&film);
        let fitting = guide.filter(|state| state.0.continues(&fresh));
        if fitting.is_none() && self.learns && earlier.total_samples() > 0 {
            return Err(SessionError::Film("it does not keep what guides had learned".to_owned()));
        }
        Arc::make_mut(&mut film).append(earlier).map_err(SessionError::Film)?;
        *self.guide.lock().unwrap_or_else(PoisonError::into_inner) = fitting.map(|state| state.0.clone());
        Ok(())
    }

    /// Guides that have learned nothing in this session.
    fn fresh_guide(&self, film: &Film) -> RenderGuide {
        RenderGuide::new(film, &self.settings, self.world.has_media())
    }

    /// Renders all passes, or until `control` is stopped.
    pub fn render(&self, control: &Control) {
        self.render_watched(control, &mut |_| ());
    }

    /// As [`Self::render`], and shows what there is after every pass, the one that was stopped too.
    pub fn render_watched(&self, control: &Control, after_pass: &mut dyn FnMut(Snapshot<'_>)) {
        let integrator = Integrator::new(&self.world, &self.settings);
        let mut film = self.film.lock().unwrap_or_else(PoisonError::into_inner);
        let film = Arc::make_mut(&mut film);
        let earlier = self.guide.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut guide = earlier.unwrap_or_else(|| {
            let mut guide = self.fresh_guide(film);
            guide.recall(&mut self.memory.lock().unwrap_or_else(PoisonError::into_inner));
            guide
        });
        control.samples.fetch_add(film.total_samples(), Ordering::Relaxed);
        let mut done = film.next_sample();
        while done < self.range.end && !film.is_clean(done) && !control.is_stopped() {
            let target = leaf_end(done).min(self.range.end);
            guide.begin_pass(done, target);
            let pass = self.pool.install(|| render_pass(&integrator, film, target, &guide, control));
            if !pass.lessons.is_empty() && !control.cancel.load(Ordering::Relaxed) {
                control.learning.time(|| self.pool.install(|| guide.learn(film, pass.lessons)));
            }
            self.statistics.lock().unwrap_or_else(PoisonError::into_inner).merge(&pass.statistics);
            if film.next_sample() == target {
                let threshold = f64::from(self.settings.noise_threshold);
                self.pool.install(|| film.update_noise(target, threshold));
            }
            control.passes.fetch_add(1, Ordering::Relaxed);
            after_pass(Snapshot::new(film, &guide));
            done = target;
        }
        *self.guide.lock().unwrap_or_else(PoisonError::into_inner) = Some(guide);
    }

    /// Whether there is nothing left to be rendered: every pixel has all samples, or as many as it needs.
    pub fn is_complete(&self) -> bool {
        let film = self.film.lock().unwrap_or_else(PoisonError::into_inner);
        film.next_sample() >= self.range.end || film.is_clean(film.next_sample())
    }

    /// Pixel samples a complete render takes, at the most.
    pub fn samples_total(&self) -> u64 {
        let [width, height] = self.settings.resolution;
        u64::from(width) * u64::from(height) * self.range.len() as u64
    }

    /// Whether guides learn during the render: then samples depend on those before them, and an image that is made in
    /// parts or resumed has other noise than one made at once.
    pub fn learns(&self) -> bool {
        self.learns
    }

    /// The image so far; waits for the end of a render that runs.
    pub fn film(&self) -> Arc<Film> {
        Arc::clone(&self.film.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Counts of what the paths did.
    pub fn statistics(&self) -> PathStatistics {
        self.statistics.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How much the last render learned; `None` if it was not guided, or is not over.
    pub fn guide_statistics(&self) -> Option<GuideStatistics> {
        let guide = self.guide.lock().unwrap_or_else(PoisonError::into_inner);
        guide.as_ref().and_then(RenderGuide::statistics)
    }

    /// A copy of the field of directions that the last render learned, in camera-relative space.
    pub fn field(&self) -> Option<Field> {
        let guide = self.guide.lock().unwrap_or_else(PoisonError::into_inner);
        guide.as_ref().and_then(RenderGuide::field).cloned()
    }

    /// The world being rendered.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }
}

/// What a pass did, and what it taught: an entry a tile, none if it teaches nothing or was stopped.
struct PassOutcome {
    statistics: PathStatistics,
    lessons: Vec<TileLessons>,
}

/// Brings every pixel to `target` samples.
fn render_pass(
    integrator: &Integrator,
    film: &mut Film,
    target: u32,
    guide: &RenderGuide,
    control: &Control,
) -> PassOutcome {
    let pixels = u64::from(film.width()) * u64::from(film.height());
    let first = film.next_sample();
    let stride = guide.teaching_stride(pixels * u64::from(target - first));
    let pass = Pass { integrator, guide, control, first, target, stride };
    let (tiles, is_clean) = film.tiles_to_render();
    let of_tiles: Vec<_> = tiles.par_iter_mut().map(|tile| pass.render(tile, &is_clean)).collect();
    let is_complete = of_tiles.iter().all(|of_tile| of_tile.is_complete);
    let mut statistics = PathStatistics::default();
    let mut lessons = Vec::new();
    for of_tile in of_tiles {
        statistics.merge(&of_tile.statistics);
        lessons.extend(of_tile.lessons.filter(|_| is_complete));
    }
    if is_complete {
        tiles.iter_mut().for_each(Tile::finish);
    }
    PassOutcome { statistics, lessons }
}

/// What was done in one tile.
struct TileOutcome {
    statistics: PathStatistics,
    lessons: Option<TileLessons>,
    is_complete: bool,
}

/// What is the same for all tiles of a pass.
struct Pass<'a> {
    integrator: &'a Integrator<'a>,
    guide: &'a RenderGuide,
    control: &'a Control,
    /// Samples of a pixel before and after the pass.
    first: u32,
    target: u32,
    /// Every how many samples one teaches the field.
    stride: u64,
}

impl Pass<'_> {
    fn render(&self, tile: &mut Tile, is_clean: &impl Fn(u32, u32, u32) -> bool) -> TileOutcome {
        let mut statistics = PathStatistics::default();
        let mut lessons = self.guide.lessons(tile, self.first, self.target);
        // Memory for the sums of a tile is not free; after a stop there are thousands of tiles to come.
        if self.control.is_stopped() {
            return TileOutcome { statistics, lessons, is_complete: false };
        }
        let mut scratch = self.integrator.scratch();
        let mut number = 0;
        let first = tile.begin(self.target);
        for index in 0..tile.len() {
            let (x, y) = tile.pixel(index);
            if is_clean(x, y, first) {
                continue;
            }
            let told = self.guide.lookup([x, y]);
            for sample in first..self.target {
                if self.control.is_stopped() {
                    return TileOutcome { statistics, lessons, is_complete: false };
                }
                number += 1;
                let teaches = self.stride > 0 && number % self.stride == 0;
                let path = self.integrator.sample(
                    [x, y],
                    u64::from(sample),
                    told,
                    lessons.as_mut().filter(|_| teaches).map(|lessons| &mut lessons.training),
                    &mut scratch,
                    &mut statistics,
                );
                tile.add(index, path.record);
                if let Some(lessons) = &mut lessons {
                    lessons.add(index, sample, &path, &told, &statistics);
                }
            }
            let taken = u64::from(self.target.saturating_sub(first));
            self.control.samples.fetch_add(taken, Ordering::Relaxed);
        }
        // A pass that teaches is closed as a whole, or some of its lessons would be lost with a stop.
        if lessons.is_none() {
            tile.finish();
        }
        TileOutcome { statistics, lessons, is_complete: true }
    }
}

//! Sessions: build the world, render with progress, stop on Ctrl-C.

use crate::cache::SessionCache;
use crate::checkpoint::{Checkpoint, replace};
use crate::delegate::{Diagnostic, Scene};
use crate::error::{FileError, RenderError, SceneError, SettingsError, guarded};
use crate::field::Field;
use crate::film::Film;
use crate::prims::from_json;
use numpy::{IntoPyArray, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tyndall_render::{Control, World};
use tyndall_scene::RenderSettings;

/// How often a running render looks at Python: often enough for Ctrl-C to feel immediate.
const POLL: Duration = Duration::from_millis(20);

/// The clock that renders are timed by.
fn clock() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
}

/// How far a render has got.
#[pyclass(frozen, get_all, module = "tyndall")]
pub(crate) struct Progress {
    fraction: f64,
    samples_done: u64,
    samples_total: u64,
    elapsed_secs: f64,
    remaining_secs: Option<f64>,
}

/// Renders one scene with one set of settings.
#[pyclass(frozen, module = "tyndall")]
pub(crate) struct Session {
    session: tyndall_render::Session,
    cache: Option<SessionCache>,
    diagnostics: Vec<Diagnostic>,
    build_secs: f64,
    render_secs: Mutex<f64>,
    train_secs: Mutex<f64>,
    checkpoint_failure: Mutex<Option<String>>,
    interrupted: AtomicBool,
    preview: Preview,
}

/// The picture while it is being made: without what it is made of, which is ten times as large.
#[derive(Default)]
struct Preview {
    is_wanted: AtomicBool,
    /// Samples that every pixel has, and `rgba`.
    picture: Mutex<Option<(u32, Vec<f32>)>>,
}

impl Preview {
    /// A pass has ended. Pictures are made only if somebody looks, and if no pixel is missing.
    fn show(&self, film: &tyndall_render::Film) {
        let samples = film.min_samples();
        if samples > 0
            && self.is_wanted.swap(false, Ordering::Relaxed)
            && let Ok(image) = film.image("rgba")
        {
            self.picture.lock().unwrap_or_else(PoisonError::into_inner).replace((samples, image));
        }
    }

    fn take(&self) -> Option<(u32, Vec<f32>)> {
        let picture = self.picture.lock().unwrap_or_else(PoisonError::into_inner).take();
        self.is_wanted.store(true, Ordering::Relaxed);
        picture
    }
}

#[pymethods]
impl Session {
    /// Builds the world of `scene`. `settings` are `tyndall.setting_specs()`' names; absent ones have their defaults.
    /// With `sample_range`, renders these samples of every pixel only.
    #[new]
    #[pyo3(signature = (scene, settings, *, sample_range = None))]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        settings: &Bound<'_, PyDict>,
        sample_range: Option<(u32, u32)>,
    ) -> PyResult<Self> {
        let json: String = py.import("json")?.call_method1("dumps", (settings,))?.extract()?;
        let settings = RenderSettings::from_json(&json).map_err(|e| SettingsError::new_err(e.to_string()))?;
        for name in &settings.aovs {
            tyndall_render::aov::find(name).map_err(SettingsError::new_err)?;
        }
        let start = Instant::now();
        let world = guarded(py, || {
            let mut cache = scene.cache.lock().unwrap_or_else(PoisonError::into_inner);
            World::build(&scene.scene, &settings, scene.assets.as_ref(), &mut cache)
        })?
        .map_err(|e| SceneError::new_err(e.to_string()))?;
        scene.assets.drop_unused();
        let mut diagnostics: Vec<_> = world.diagnostics().as_slice().iter().map(Diagnostic::from).collect();
        let build_secs = start.elapsed().as_secs_f64();
        let mut session = tyndall_render::Session::new(Arc::new(world), settings)
            .map_err(|e| RenderError::new_err(e.to_string()))?;
        if let Some((first, end)) = sample_range {
            session = session.restricted_to(first..end).map_err(|e| SettingsError::new_err(e.to_string()))?;
        }
        let cache = guarded(py, || SessionCache::open(&scene.scene, session.settings(), &session))?;
        diagnostics.extend(cache.as_ref().and_then(SessionCache::diagnostic));
        Ok(Self {
            session,
            cache,
            diagnostics,
            build_secs,
            render_secs: Mutex::new(0.0),
            train_secs: Mutex::new(0.0),
            checkpoint_failure: Mutex::default(),
            interrupted: AtomicBool::new(false),
            preview: Preview::default(),
        })
    }

    /// Messages of the front end and of building the world.
    #[getter]
    fn diagnostics(&self) -> Vec<Diagnostic> {
        self.diagnostics.clone()
    }

    /// Whether guides learn during the render, so that a render made in parts or resumed has other noise.
    #[getter]
    fn learns(&self) -> bool {
        self.session.learns()
    }

    /// Whether there is nothing left to be rendered.
    #[getter]
    fn is_complete(&self) -> bool {
        self.session.is_complete()
    }

    /// Goes on from the checkpoint of an earlier session of the same scene and settings. Raises if guides learn here and
    /// it does not say what they knew.
    fn resume(&self, earlier: &Film) -> PyResult<()> {
        let resumed = self.session.resume(&earlier.film, earlier.guide.as_ref());
        resumed.map_err(|e| RenderError::new_err(e.to_string()))
    }

    /// Saves what there is after a render, for sessions that go on from here.
    fn write_state(&self, py: Python<'_>, path: PathBuf, description: &str) -> PyResult<()> {
        guarded(py, || replace(&path, |file| self.session.write_state(description, file)))?
            .map_err(FileError::new_err)
    }

    /// Renders to the end, the time limit, or until `progress` returns False. An exception raised by `progress` and
    /// Ctrl-C come out as they are; `film()` has what was done until then, and the guiding cache what was learned. It
    /// remembers `frame`. A `checkpoint` (path, seconds, text) saves film and guides at most so often.
    #[pyo3(signature = (progress = None, checkpoint = None, frame = 0.0))]
    fn render(
        &self,
        py: Python<'_>,
        progress: Option<Bound<'_, PyAny>>,
        checkpoint: Option<(PathBuf, f64, String)>,
        frame: f64,
    ) -> PyResult<Film> {
        let control = Control::with_clock(clock);
        let start = Instant::now();
        let mut checkpoint = match checkpoint {
            Some((path, seconds, text)) => {
                let every = Duration::try_from_secs_f64(seconds)
                    .map_err(|e| SettingsError::new_err(format!("checkpoint every {seconds} s: {e}")))?;
                Some(Checkpoint::new(path, every, text))
            }
            None => None,
        };
        let outcome = self.run(py, &control, progress.as_ref(), start, checkpoint.as_mut());
        *self.render_secs.lock().unwrap_or_else(PoisonError::into_inner) += start.elapsed().as_secs_f64();
        *self.train_secs.lock().unwrap_or_else(PoisonError::into_inner) +=
            control.time_learning().as_secs_f64();
        self.interrupted.store(matches!(outcome, Ok(false) | Err(_)), Ordering::Relaxed);
        let saved =
            guarded(py, || self.cache.as_ref().map_or(Ok(()), |cache| cache.save(&self.session, frame)))?;
        outcome?;
        if let Some(failure) = checkpoint.and_then(|checkpoint| checkpoint.failure) {
            self.checkpoint_failure.lock().unwrap_or_else(PoisonError::into_inner).replace(failure);
        }
        saved.map_err(FileError::new_err)?;
        Ok(self.film())
    }

    /// Why the last checkpoint could not be written; None if it was.
    #[getter]
    fn checkpoint_failure(&self) -> Option<String> {
        self.checkpoint_failure.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// While a render runs: after a pass that ended since the last call, the samples that every pixel has and `rgba`,
    /// float32, shape (height, width, 4), row 0 on top; None if there was none. Each call asks for the next one, so begin
    /// with a call before the render.
    fn preview<'py>(&self, py: Python<'py>) -> PyResult<Option<(u32, Bound<'py, PyArray3<f32>>)>> {
        let Some((samples, image)) = self.preview.take() else { return Ok(None) };
        let [width, height] = self.session.settings().resolution;
        let array = image.into_pyarray(py).reshape([height as usize, width as usize, 4])?;
        Ok(Some((samples, array)))
    }

    /// The image so far; waits for the end of a render that runs.
    fn film(&self) -> Film {
        Film::new(
            self.session.film(),
            self.session.settings().pixel_aspect,
            self.interrupted.load(Ordering::Relaxed),
        )
    }

    /// What the render has learned of the light; None without guided directions, or before a render.
    #[getter]
    fn field(&self) -> Option<Field> {
        self.session.field().map(|field| Field::new(field, self.session.world().origin()))
    }

    /// Counts of what paths did, sizes and seconds.
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let film = self.session.film();
        let paths = self.session.statistics();
        let seconds = *self.render_secs.lock().unwrap_or_else(PoisonError::into_inner);
        let mut value = serde_json::json!({
            "samples": film.min_samples(),
            "meanSamples": film.mean_samples(),
            "paths": paths.paths,
            "segments": paths.segments,
            "shadowRays": paths.shadow_rays,
            "surfaceEvents": paths.surface_events,
            "volumeEvents": paths.volume_events,
            "guidedEvents": paths.guided_events,
            "guidedSegments": paths.guided_segments,
            "candidates": paths.walks.candidates,
            "candidatesPerRay": paths.walks.candidates as f64 / paths.rays().max(1) as f64,
            "densityLookups": paths.walks.lookups,
            "majorantViolations": paths.walks.majorant_violations,
            "nonFiniteSamples": film.non_finite_samples(),
            "world": self.session.world().summary(),
            "seconds": { "build": self.build_secs, "render": seconds },
        });
        if let Some(guide) = self.session.guide_statistics() {
            value["guide"] = serde_json::to_value(guide).unwrap_or_default();
            let seconds = *self.train_secs.lock().unwrap_or_else(PoisonError::into_inner);
            value["seconds"]["train"] = seconds.into();
        }
        if let Some(cache) = &self.cache {
            value["cache"] = cache.status();
        }
        from_json(py, &value)
    }
}

impl Session {
    /// Renders on a worker thread while this one looks at signals, the clock and `progress`; returns whether the
    /// render was left to end by itself.
    fn run(
        &self,
        py: Python<'_>,
        control: &Control,
        progress: Option<&Bound<'_, PyAny>>,
        start: Instant,
        mut checkpoint: Option<&mut Checkpoint>,
    ) -> PyResult<bool> {
        let finished = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let worker = scope.spawn(|| {
                let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                    self.session.render_watched(control, &mut |snapshot| {
                        self.preview.show(snapshot.film());
                        if let Some(checkpoint) = &mut checkpoint {
                            checkpoint.save_when_due(&snapshot);
                        }
                    });
                }));
                finished.store(true, Ordering::Release);
                outcome
            });
            let watched = self.watch(py, control, progress, start, &finished);
            if watched.is_err() {
                control.cancel();
            }
            let joined = py.detach(|| worker.join());
            let was_left_alone = watched?;
            match joined {
                Ok(Ok(())) => Ok(was_left_alone),
                Ok(Err(panic)) | Err(panic) => guarded(py, || std::panic::resume_unwind(panic)),
            }
        })
    }

    fn watch(
        &self,
        py: Python<'_>,
        control: &Control,
        progress: Option<&Bound<'_, PyAny>>,
        start: Instant,
        finished: &AtomicBool,
    ) -> PyResult<bool> {
        let mut was_left_alone = true;
        while !finished.load(Ordering::Acquire) {
            py.detach(|| {
                // Short renders should not wait for a whole poll interval.
                let until = Instant::now() + POLL;
                while Instant::now() < until && !finished.load(Ordering::Acquire) {
                    std::thread::sleep(Duration::from_millis(1));
                }
            });
            py.check_signals()?;
            let limit = f64::from(self.session.settings().time_limit);
            // The first pass always completes: every pixel has a sample.
            if limit > 0.0 && start.elapsed().as_secs_f64() >= limit && control.passes_done() > 0 {
                control.stop();
            }
            if let Some(callback) = progress {
                let answer = callback.call1((self.progress(control, start),))?;
                if answer.extract::<bool>().is_ok_and(|goes_on| !goes_on) {
                    was_left_alone = false;
                    control.cancel();
                }
            }
        }
        Ok(was_left_alone)
    }

    fn progress(&self, control: &Control, start: Instant) -> Progress {
        let (done, total) = (control.samples_done(), self.session.samples_total());
        let elapsed_secs = start.elapsed().as_secs_f64();
        let limit = f64::from(self.session.settings().time_limit);
        let by_samples = done as f64 / total as f64;
        let by_time = if limit > 0.0 { elapsed_secs / limit } else { 0.0 };
        let fraction = by_samples.max(by_time).min(1.0);
        let remaining_secs = (fraction > 0.0).then(|| elapsed_secs * (1.0 - fraction) / fraction);
        Progress { fraction, samples_done: done, samples_total: total, elapsed_secs, remaining_secs }
    }
}

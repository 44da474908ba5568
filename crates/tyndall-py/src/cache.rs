//! The guiding cache of a session: which file, what of it is used, what became of it.

use crate::delegate::Diagnostic;
use crate::error::{FileError, guarded};
use crate::prims::from_json;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tyndall_guiding::cache::{Cache, CacheError, Fingerprint, MAGIC, MergeError, Reuse, Section};
use tyndall_io::{read_if_present, replace_exclusively};
use tyndall_render::{FieldSize, Session};
use tyndall_scene::{CacheMode, RenderSettings, Scene, SceneFingerprint, Severity};

/// The cache that settings ask for.
pub(crate) struct SessionCache {
    path: PathBuf,
    mode: CacheMode,
    fingerprint: Fingerprint,
    found: Found,
    load_secs: f64,
    /// Of the file that was read.
    bytes: usize,
}

/// What was in the file.
enum Found {
    /// There is none, or it is to be learned anew.
    Nothing,
    /// A cache.
    Usable(Reuse),
    /// It cannot be read; it stays as it is.
    Unreadable(String),
    /// It holds something else.
    Foreign(String),
}

impl SessionCache {
    /// Reads the cache that `settings` name into `session`, as far as it fits; `None` if they name none.
    pub(crate) fn open(scene: &Scene, settings: &RenderSettings, session: &Session) -> Option<Self> {
        let (path, mode) = (PathBuf::from(&settings.cache_path), settings.cache_mode);
        if settings.cache_path.is_empty() || mode == CacheMode::Off {
            return None;
        }
        let fingerprint = fingerprint(&SceneFingerprint::new(scene, settings));
        let start = Instant::now();
        let (found, bytes) = match read_if_present(&path) {
            Ok(None) => (Found::Nothing, 0),
            Ok(Some(bytes)) if mode == CacheMode::Train => (Self::to_replace(&bytes), bytes.len()),
            Ok(Some(bytes)) => match Cache::from_bytes(&bytes) {
                Ok(cache) => (Found::Usable(session.recall(cache, &fingerprint)), bytes.len()),
                Err(error) => (Found::Foreign(error.to_string()), bytes.len()),
            },
            Err(error) => (Found::Unreadable(error.to_string()), 0),
        };
        let load_secs = start.elapsed().as_secs_f64();
        Some(Self { path, mode, fingerprint, found, load_secs, bytes })
    }

    /// A cache that is learned anew may replace an old one, of whatever version or state, but no picture.
    fn to_replace(bytes: &[u8]) -> Found {
        if bytes.starts_with(&MAGIC) {
            Found::Nothing
        } else {
            Found::Foreign(CacheError::NotACache.to_string())
        }
    }

    /// Whether the file may be written.
    fn is_ours(&self) -> bool {
        matches!(self.found, Found::Nothing | Found::Usable(_))
    }

    /// What makes the cache useless where it should be of use.
    pub(crate) fn diagnostic(&self) -> Option<Diagnostic> {
        let file = &self.path;
        let what = match &self.found {
            Found::Foreign(why) => format!("guiding cache: {file:?} {why}"),
            Found::Unreadable(why) => format!("guiding cache: {why}"),
            Found::Nothing if self.mode == CacheMode::Read => {
                format!("guiding cache: there is no file {file:?}")
            }
            _ => return None,
        };
        let action = "the render learns from nothing, and the file is left as it is";
        let severity = Severity::Warning;
        Some(Diagnostic::from(&tyndall_scene::Diagnostic {
            severity,
            path: String::new(),
            what,
            action: action.to_owned(),
        }))
    }

    /// Writes what `session` learned, if it may and there is something.
    ///
    /// # Errors
    /// The file cannot be written; the text says why.
    pub(crate) fn save(&self, session: &Session, frame: f64) -> Result<(), String> {
        if self.mode == CacheMode::Read || !self.is_ours() {
            return Ok(());
        }
        let Some(mut cache) = session.learned(&self.fingerprint, frame) else { return Ok(()) };
        cache.renderer = renderer();
        replace_exclusively(&self.path, &cache.to_bytes()).map_err(|e| e.to_string())
    }

    /// For statistics and images.
    pub(crate) fn status(&self) -> serde_json::Value {
        let (status, why) = match &self.found {
            Found::Nothing if self.mode == CacheMode::Train => ("rebuilt", "asked for".to_owned()),
            Found::Nothing => ("rebuilt", "there was no file".to_owned()),
            Found::Unreadable(why) | Found::Foreign(why) => ("ignored", why.clone()),
            Found::Usable(reuse) => reused(reuse),
        };
        serde_json::json!({
            "file": self.path.display().to_string(),
            "mode": self.mode,
            "status": status,
            "why": why,
            "bytes": self.bytes,
            "loadSeconds": self.load_secs,
        })
    }
}

/// In one word, and why.
fn reused(reuse: &Reuse) -> (&'static str, String) {
    let names: Vec<_> = reuse.changes.iter().map(|section| section.name()).collect();
    let changed = format!("changed: {}", names.join(", "));
    match (reuse.changes.is_empty(), reuse.field || reuse.image) {
        (true, true) => ("hit", String::new()),
        (true, false) => ("rebuilt", "it was empty".to_owned()),
        (false, true) => ("partly stale", changed),
        (false, false) => ("rebuilt", changed),
    }
}

fn fingerprint(scene: &SceneFingerprint) -> Fingerprint {
    Fingerprint::new(|section| match section {
        Section::Geometry => scene.geometry,
        Section::Media => scene.media,
        Section::Materials => scene.materials,
        Section::Lights => scene.lights,
        Section::Camera => scene.camera,
        Section::Integrator => scene.integrator,
    })
}

/// What is in the guiding cache at `path`.
#[pyfunction]
pub(crate) fn read_cache_info(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let info = guarded(py, || describe(&path))?.map_err(FileError::new_err)?;
    from_json(py, &info)
}

fn describe(path: &Path) -> Result<serde_json::Value, String> {
    let (cache, n_bytes) = read(path)?;
    let frames: Vec<_> =
        cache.frames.iter().map(|f| serde_json::json!({ "frame": f.frame, "samples": f.samples })).collect();
    let fingerprint = |section: Section| {
        let digits: String = cache.fingerprint.of(section).iter().map(|byte| format!("{byte:02x}")).collect();
        (section.name().to_owned(), digits.into())
    };
    let field = cache.field.as_ref().map(|field| FieldSize::from(field.statistics()));
    let image = cache.image.as_ref().map(|image| {
        let n = image.width() * image.height();
        let samples: f64 = image.moments().iter().map(|m| f64::from(m.n)).sum();
        serde_json::json!({
            "resolution": [image.width(), image.height()],
            "samplesPerPixel": samples / n.max(1) as f64,
        })
    });
    Ok(serde_json::json!({
        "file": path.display().to_string(),
        "bytes": n_bytes,
        "renderer": cache.renderer,
        "lessons": cache.lessons,
        "samples": cache.samples,
        "frames": frames,
        "field": field,
        "image": image,
        "fingerprints": Section::ALL.map(fingerprint).into_iter().collect::<serde_json::Map<_, _>>(),
    }))
}

/// Writes what the caches at `inputs` have learned together to `output`; returns how many image guides were left out for being
/// of other cameras.
#[pyfunction]
pub(crate) fn merge_caches(py: Python<'_>, inputs: Vec<PathBuf>, output: PathBuf) -> PyResult<usize> {
    guarded(py, || merge(&inputs, &output))?.map_err(FileError::new_err)
}

fn merge(inputs: &[PathBuf], output: &Path) -> Result<usize, String> {
    let caches = inputs.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let merged = Cache::merged(caches.into_iter().map(|(cache, _)| cache).collect()).map_err(|error| {
        let names = match &error {
            MergeError::Differ { pair, .. } => pair.map(|i| format!("{:?}", inputs[i])).join(" and "),
            MergeError::Nothing => String::new(),
        };
        format!("{names}: {error}")
    })?;
    write(merged.cache, output)?;
    Ok(merged.images_left_out)
}

/// Writes the cache at `input` without the sections `drop` ("field", "image") and with at most `most_bytes` to `output`;
/// returns whether it could be made as small.
#[pyfunction]
#[pyo3(signature = (input, output, *, most_bytes = None, drop = Vec::new()))]
pub(crate) fn prune_cache(
    py: Python<'_>,
    input: PathBuf,
    output: PathBuf,
    most_bytes: Option<usize>,
    drop: Vec<String>,
) -> PyResult<bool> {
    guarded(py, || prune(&input, &output, most_bytes, &drop))?.map_err(FileError::new_err)
}

fn prune(input: &Path, output: &Path, most_bytes: Option<usize>, drop: &[String]) -> Result<bool, String> {
    let (mut cache, _) = read(input)?;
    cache.field = cache.field.filter(|_| !drop.iter().any(|name| name == "field"));
    cache.image = cache.image.filter(|_| !drop.iter().any(|name| name == "image"));
    let is_small = most_bytes.is_none_or(|most| cache.shrink_to(most));
    if is_small {
        write(cache, output)?;
    }
    Ok(is_small)
}

/// The cache at `path`, and its size.
fn read(path: &Path) -> Result<(Cache, usize), String> {
    let bytes = read_if_present(path).map_err(|e| e.to_string())?;
    let bytes = bytes.ok_or_else(|| format!("{path:?} does not exist"))?;
    let cache = Cache::from_bytes(&bytes).map_err(|e| format!("{path:?} {e}"))?;
    Ok((cache, bytes.len()))
}

fn write(mut cache: Cache, path: &Path) -> Result<(), String> {
    let there = read_if_present(path).map_err(|e| e.to_string())?;
    if there.is_some_and(|bytes| !bytes.starts_with(&MAGIC)) {
        return Err(format!("{path:?} {}, and is left as it is", CacheError::NotACache));
    }
    cache.renderer = renderer();
    replace_exclusively(path, &cache.to_bytes()).map_err(|e| e.to_string())
}

/// Who writes caches here.
fn renderer() -> String {
    format!("tyndall {}", env!("CARGO_PKG_VERSION"))
}

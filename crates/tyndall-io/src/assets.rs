//! The files a committed scene asks for, read once.

use crate::load_image;
use rustc_hash::FxHashMap;
use std::fs;
use std::hash::Hash;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;
use tyndall_scene::prim::FieldSource;
use tyndall_scene::{AssetError, AssetLoader, ColorSpace, FieldGrid, ImageData};
use tyndall_vdb::{VdbError, VdbFile};

/// Loads images and grids from disk and keeps them until the file changes (its length or modification time), or nobody
/// asks for it any more ([`drop_unused`]). Thread-safe; two threads that ask for a new file at the same moment may both
/// read it, and then share one.
///
/// [`drop_unused`]: FileAssets::drop_unused
#[derive(Debug, Default)]
pub struct FileAssets {
    images: FileCache<ColorSpace, ImageData>,
    grids: FileCache<(String, Option<usize>), FieldGrid>,
}

impl FileAssets {
    /// An empty cache.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets everything that was read; content still in use stays alive with its users.
    pub fn clear(&self) {
        self.images.clear();
        self.grids.clear();
    }

    /// Forgets what nobody asked for since the last call: the files of frames that are over.
    pub fn drop_unused(&self) {
        self.images.drop_unused();
        self.grids.drop_unused();
    }

    /// The grid called `name` of the OpenVDB file at `path`; `index` chooses among grids of the same name.
    /// Doubles, halves and integers, single or in vectors, are converted to floats.
    ///
    /// # Errors
    /// The file is missing or damaged, has no such grid (the message lists those it has), or the grid holds no numbers.
    pub fn vdb_grid(
        &self,
        path: &Path,
        name: &str,
        index: Option<usize>,
    ) -> Result<Arc<FieldGrid>, AssetError> {
        self.grids.get(path, (name.to_owned(), index), || {
            read_grid(path, name, index).map_err(|e| grid_error(path, &e))
        })
    }
}

impl AssetLoader for FileAssets {
    fn grid(&self, source: &FieldSource) -> Result<Arc<FieldGrid>, AssetError> {
        match source {
            FieldSource::File { path, name, index } => self.vdb_grid(path, name, *index),
            FieldSource::Dense { .. } => {
                Err(AssetError { message: "a field in memory has no file to load".to_owned() })
            }
        }
    }

    fn image(&self, path: &Path, color_space: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
        self.images.get(path, color_space, || Ok(load_image(path, color_space)?))
    }
}

fn read_grid(path: &Path, name: &str, index: Option<usize>) -> Result<FieldGrid, VdbError> {
    let file = VdbFile::open(path)?;
    if file.value_type(name, index)?.is_vector() {
        return Ok(FieldGrid::Vector(file.read_vector_grid(name, index)?));
    }
    Ok(FieldGrid::Scalar(file.read_grid(name, index)?))
}

fn grid_error(path: &Path, error: &VdbError) -> AssetError {
    let message = match error {
        VdbError::Io { .. } => format!("{error}; check the path and its permissions"),
        other => format!("cannot read {path:?}: {other}"),
    };
    AssetError { message }
}

/// What tells one state of a file from the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    modified: Option<SystemTime>,
    len: u64,
}

impl Stamp {
    /// `None` if the file cannot be examined; loading it then gives the reason.
    fn of(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok()?;
        Some(Self { modified: metadata.modified().ok(), len: metadata.len() })
    }
}

type Entries<Variant, T> = FxHashMap<(PathBuf, Variant), Entry<T>>;

#[derive(Debug)]
struct Entry<T> {
    stamp: Stamp,
    content: Arc<T>,
    /// Since the last [`FileAssets::drop_unused`].
    is_used: bool,
}

impl<T> Entry<T> {
    fn give(&mut self) -> Arc<T> {
        self.is_used = true;
        Arc::clone(&self.content)
    }
}

/// Decoded content by path and the `Variant` it was decoded as (colour space, grid name, …).
#[derive(Debug)]
struct FileCache<Variant, T> {
    entries: Mutex<Entries<Variant, T>>,
}

impl<Variant, T> Default for FileCache<Variant, T> {
    fn default() -> Self {
        Self { entries: Mutex::default() }
    }
}

impl<Variant: Eq + Hash, T> FileCache<Variant, T> {
    /// The cached content, or what `load` gives. Errors are not kept: the next call tries again.
    ///
    /// The lock is not held while loading, since loaders use rayon: a waiting worker may be handed a job that asks for
    /// the same file.
    fn get(
        &self,
        path: &Path,
        variant: Variant,
        load: impl FnOnce() -> Result<T, AssetError>,
    ) -> Result<Arc<T>, AssetError> {
        let key = (path.to_path_buf(), variant);
        let stamp = Stamp::of(path);
        if let Some(entry) = self.lock().get_mut(&key)
            && Some(entry.stamp) == stamp
        {
            return Ok(entry.give());
        }
        let loaded = Arc::new(load()?);
        // The stamp from before loading: if the file changed meanwhile, the next call reads it again.
        let Some(stamp) = stamp else { return Ok(loaded) };
        let mut entries = self.lock();
        match entries.get_mut(&key) {
            Some(other) if other.stamp == stamp => Ok(other.give()),
            _ => {
                entries.insert(key, Entry { stamp, content: Arc::clone(&loaded), is_used: true });
                Ok(loaded)
            }
        }
    }

    fn clear(&self) {
        self.lock().clear();
    }

    fn drop_unused(&self) {
        self.lock().retain(|_, entry| std::mem::take(&mut entry.is_used));
    }

    fn lock(&self) -> MutexGuard<'_, Entries<Variant, T>> {
        // The map is consistent even after a panic elsewhere: entries are inserted whole.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[path = "assets_tests.rs"]
mod tests;

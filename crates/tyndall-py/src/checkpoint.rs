//! Renders saved on their way.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tyndall_render::Snapshot;

/// Where, how often and with which text a render is saved.
pub(crate) struct Checkpoint {
    path: PathBuf,
    every: Duration,
    description: String,
    last: Instant,
    /// Why the last attempt failed.
    pub(crate) failure: Option<String>,
}

impl Checkpoint {
    pub(crate) fn new(path: PathBuf, every: Duration, description: String) -> Self {
        Self { path, every, description, last: Instant::now(), failure: None }
    }

    /// Saves the render if it is time to; a failure is kept, and tried again next time.
    pub(crate) fn save_when_due(&mut self, snapshot: &Snapshot<'_>) {
        if self.last.elapsed() >= self.every {
            let write = |file: &mut dyn Write| snapshot.write_state(&self.description, file);
            self.failure = replace(&self.path, write).err();
            self.last = Instant::now();
        }
    }
}

/// Writes a file atomically.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), String> {
    tyndall_io::write_atomically(path, |file| write(file).map_err(|e| tyndall_io::IoError::write(path, e)))
        .map_err(|e| e.to_string())
}

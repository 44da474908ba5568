//! Films saved while they are rendered.

use crate::film::write_state;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tyndall_render::Film;

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

    /// Saves the film if it is time to; a failure is kept, and tried again next time.
    pub(crate) fn save_when_due(&mut self, film: &Film) {
        if self.last.elapsed() >= self.every {
            self.failure = write_state(film, &self.description, &self.path).err();
            self.last = Instant::now();
        }
    }
}

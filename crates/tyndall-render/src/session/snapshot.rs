//! A render between two passes.

use super::Session;
use crate::film::Film;
use crate::guide::RenderGuide;
use std::io::{self, Write};
use std::sync::PoisonError;

/// What there is after a pass. A session that [resumes](Session::resume) from it makes the image that an uninterrupted
/// one makes, bit for bit.
#[derive(Clone, Copy)]
pub struct Snapshot<'a> {
    film: &'a Film,
    guide: &'a RenderGuide,
}

impl<'a> Snapshot<'a> {
    pub(super) fn new(film: &'a Film, guide: &'a RenderGuide) -> Self {
        Self { film, guide }
    }

    /// The image.
    pub fn film(&self) -> &'a Film {
        self.film
    }

    /// Writes the film, what guides know, and a text of the caller's, for [`Film::read_state`].
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_state(&self, description: &str, out: &mut dyn Write) -> io::Result<()> {
        let guide = self.guide.to_bytes();
        self.film.write_with_guide(description, Some(&guide), out)
    }
}

impl Session {
    /// Writes what there is after a render, as [`Snapshot::write_state`] does.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_state(&self, description: &str, out: &mut dyn Write) -> io::Result<()> {
        let film = self.film.lock().unwrap_or_else(PoisonError::into_inner);
        let guide = self.guide.lock().unwrap_or_else(PoisonError::into_inner);
        match guide.as_ref() {
            Some(guide) => Snapshot::new(&film, guide).write_state(description, out),
            None => film.write_state(description, out),
        }
    }
}

//! What a render learned, as a file for the next frame, the next machine, the next day.
//!
//! ```text
//! Cache ─► sections (summary, field, image guide) ─► blocks, sorted by significance, LZ4 ─► checksums, table, header
//! ```
//!
//! | module | what |
//! |---|---|
//! | `container` | the file: header, table, checksums |
//! | `blocks` | compression |
//! | `fingerprint` | what the learned depends on, and what is left of it after a change |
//! | `merge` | caches of several machines |
//! | `prune` | smaller caches |
//! | `words` | numbers as bytes |
//!
//! Bytes in, bytes out: files are opened, locked and replaced by the caller. `benches/cache.rs` times both ways.
//!
//! Invariants
//! - What is written is read back bit for bit.
//! - Bytes of strangers make a [`CacheError`], never a panic, and never more memory than a multiple of their number.
//! - A cache that does not fit costs noise, never bias: all of it only steers probabilities. But it was learned from
//!   random numbers that a render with the same seed draws again: those that are compared with guided probabilities must
//!   be shifted by [`Cache::lessons`] from the first sample on.

mod blocks;
mod container;
mod error;
mod fingerprint;
mod merge;
mod prune;
mod words;

pub(crate) use blocks::Unpacking;
pub use container::{FORMAT, MAGIC};
pub use error::CacheError;
pub use fingerprint::{Fingerprint, Present, Reuse, Section};
pub use merge::{MergeError, Merged};
pub(crate) use words::{Reader, Writer, f32s_of};

use crate::field::Field;
use crate::image_space::{ImageGuide, View};
use container::{Container, Kind, Opened};
use error::Result;

/// Counts above this are not believed: sums of them must not overflow.
const MOST: u64 = 1 << 48;
/// Frames that are remembered; of longer shots the latest.
const MOST_FRAMES: usize = 10_000;

/// What a render learned, and of what.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cache {
    /// Of the renderer that wrote it, at most 32 bytes.
    pub renderer: String,
    /// What it was learned of.
    pub fingerprint: Fingerprint,
    /// The frames it was learned from, in the order of learning.
    pub frames: Vec<FrameRecord>,
    /// How often the guides have learned, over all frames and machines.
    pub lessons: u32,
    /// Samples per pixel that taught, all of a scene with this very fingerprint.
    pub samples: u32,
    /// The stage's point that is the origin of the field's space.
    pub origin: [f64; 3],
    /// The camera of the image guide.
    pub view: View,
    /// Light and odds by place and direction.
    pub field: Option<Field>,
    /// Odds of camera rays. Its sums hold the mean depths of media and surfaces.
    pub image: Option<ImageGuide>,
}

/// A frame that was learned from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRecord {
    /// Its number.
    pub frame: f64,
    /// Samples per pixel.
    pub samples: u32,
}

impl Cache {
    /// As the content of a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let section = |kind: Kind, write: &dyn Fn(&mut Writer)| {
            let mut out = Writer::default();
            write(&mut out);
            (kind, out.finish())
        };
        let mut sections = vec![section(Kind::Summary, &|out| self.write_summary(out))];
        sections.extend(self.field.iter().map(|field| section(Kind::Field, &|out| field.write(out))));
        sections.extend(self.image.iter().map(|image| section(Kind::Image, &|out| image.write(out))));
        Container { renderer: self.renderer.clone(), sections }.to_bytes()
    }

    /// From the content of a file.
    ///
    /// # Errors
    /// The file is something else, of another version, incomplete or damaged.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, CacheError> {
        let file = Opened::from_bytes(bytes)?;
        let summary = file.section(Kind::Summary)?.ok_or(CacheError::Malformed("it has no summary"))?;
        let mut cache = read_at_once(summary, Self::read_summary)?;
        let (field, image) = (file.section(Kind::Field)?, file.section(Kind::Image)?);
        let (field, image) = rayon::join(
            || field.map(Field::read).transpose(),
            || image.map(|section| read_at_once(section, ImageGuide::read)).transpose(),
        );
        (cache.field, cache.image) = (field?, image?);
        cache.renderer = file.renderer;
        Ok(cache)
    }

    fn write_summary(&self, out: &mut Writer) {
        self.fingerprint.write(out);
        out.u32(self.lessons);
        out.u32(self.samples);
        self.origin.into_iter().for_each(|v| out.f64(v));
        self.view.write(out);
        let frames = &self.frames[self.frames.len().saturating_sub(MOST_FRAMES)..];
        out.u32(frames.len() as u32);
        for frame in frames {
            out.f64(frame.frame);
            out.u32(frame.samples);
        }
    }

    fn read_summary(input: &mut Reader<'_>) -> Result<Self> {
        let mut cache = Self { fingerprint: Fingerprint::read(input)?, ..Self::default() };
        cache.lessons = input.u32()?.min(1 << 31);
        cache.samples = input.u32()?;
        for v in &mut cache.origin {
            *v = finite(input.f64()?)?;
        }
        cache.view = View::read(input)?;
        let n_frames = input.u32()? as usize;
        if n_frames > MOST_FRAMES {
            return Err(CacheError::Malformed("it lists too many frames"));
        }
        for _ in 0..n_frames {
            cache.frames.push(FrameRecord { frame: finite(input.f64()?)?, samples: input.u32()? });
        }
        Ok(cache)
    }
}

fn read_at_once<T>(mut section: Unpacking<'_>, read: impl FnOnce(&mut Reader<'_>) -> Result<T>) -> Result<T> {
    let mut numbers = section.take(section.left())?;
    let content = read(&mut numbers)?;
    numbers.finish()?;
    Ok(content)
}

/// A count that sums may be made with.
pub(crate) fn checked_count(count: u64) -> Result<u64> {
    if count <= MOST { Ok(count) } else { Err(CacheError::Malformed("it counts more than can be")) }
}

fn finite(v: f64) -> Result<f64> {
    if v.is_finite() { Ok(v) } else { Err(CacheError::Malformed("a position or frame is not finite")) }
}

#[cfg(test)]
#[path = "cache/tests.rs"]
mod tests;

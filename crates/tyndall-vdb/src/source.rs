//! Where a file's bytes come from: memory, or positioned reads of just the range that is asked for.
//!
//! Files are read at positions, not mapped into memory. A map needs `unsafe`, and a file that another process
//! shortens while it is mapped kills the renderer with SIGBUS; a positioned read returns an error. It is lazy all
//! the same: opening a file touches its header and its list of grids, decoding a grid touches that grid's bytes and
//! no others, and leaf buffers pass through a window of [`WINDOW_BYTES`], so a large file is never held as a whole.
//! The price is one copy of the packed bytes, into a window that stays in the processor's cache: between 1 % and 7 %
//! of the CPU time of decoding a grid of 1 GiB (`benches/decode.rs`), less than the difference between two runs.
//!
//! What is read twice: a list entry that is longer than a first guess. What is read as a whole: stream files, which
//! have no table of offsets, and NanoVDB grids, which are packed as a whole.

use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::VdbError;
use crate::cursor::Cursor;

/// Bytes of a file held at a time while leaves are decoded: hundreds of leaves for the threads to share, few enough
/// bytes to stay in the second-level cache between being read and being unpacked.
const WINDOW_BYTES: usize = 512 << 10;
/// First guess at how many bytes a header or a list entry with its metadata takes.
const PARSE_BYTES: usize = 16 << 10;

/// A file's bytes.
#[derive(Debug)]
pub(crate) enum Source {
    Memory(Vec<u8>),
    File { file: File, path: PathBuf, len: usize, window_bytes: usize },
}

impl Source {
    /// Opens a file; nothing is read yet.
    pub(crate) fn open(path: &Path) -> Result<Self, VdbError> {
        let opened = File::open(path).and_then(|file| Ok((file.metadata()?.len(), file)));
        let (len, file) = opened.map_err(|source| read_error(path, source))?;
        // On machines with 32-bit sizes the end of a larger file is out of reach.
        let len = usize::try_from(len).unwrap_or(usize::MAX);
        Ok(Self::File { file, path: path.to_owned(), len, window_bytes: WINDOW_BYTES })
    }

    /// The same bytes, all in memory.
    pub(crate) fn into_memory(self) -> Result<Self, VdbError> {
        let bytes = self.bytes(0..self.len())?.into_owned();
        Ok(Self::Memory(bytes))
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Memory(bytes) => bytes.len(),
            Self::File { len, .. } => *len,
        }
    }

    /// The bytes of a range, clipped to the file: no more is allocated than the file has.
    pub(crate) fn bytes(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, VdbError> {
        let range = self.clipped(range);
        match self {
            Self::Memory(bytes) => Ok(Cow::Borrowed(&bytes[range])),
            Self::File { file, path, .. } => {
                let mut buffer = vec![0; range.len()];
                read_exact_at(file, &mut buffer, range.start).map_err(|source| read_error(path, source))?;
                Ok(Cow::Owned(buffer))
            }
        }
    }

    /// What `parse` makes of the first bytes of a range, and where it stopped. It sees a small part of the range at
    /// first and is called again with more for as long as it asks for bytes that the range has.
    pub(crate) fn parse<T>(
        &self,
        range: Range<usize>,
        parse: impl Fn(&mut Cursor<'_>) -> Result<T, VdbError>,
    ) -> Result<(T, usize), VdbError> {
        let range = self.clipped(range);
        let mut size = PARSE_BYTES;
        loop {
            let bytes = match self {
                Self::Memory(bytes) => Cow::Borrowed(&bytes[range.clone()]),
                Self::File { .. } => {
                    self.bytes(range.start..range.end.min(range.start.saturating_add(size)))?
                }
            };
            let mut cursor = Cursor::new(&bytes, range.start);
            match parse(&mut cursor) {
                Err(VdbError::Truncated { what, offset, needed, .. }) => {
                    let available = range.end.saturating_sub(offset);
                    let Some(needed_end) = end_within(offset, needed, range.end) else {
                        return Err(VdbError::Truncated { what, offset, needed, available });
                    };
                    size = size.saturating_mul(4).max(needed_end - range.start);
                }
                result => return result.map(|value| (value, cursor.offset())),
            }
        }
    }

    /// A view of a range that moves forward.
    pub(crate) fn window(&self, range: Range<usize>) -> Window<'_> {
        let size = match self {
            Self::Memory(bytes) => bytes.len(),
            Self::File { window_bytes, .. } => *window_bytes,
        };
        Window { source: self, range: self.clipped(range), size, buffer: Vec::new() }
    }

    fn clipped(&self, range: Range<usize>) -> Range<usize> {
        let end = range.end.min(self.len());
        range.start.min(end)..end
    }
}

/// Part of a range. Of a file in memory it is all that is left, of other files a buffer that is reused.
#[derive(Debug)]
pub(crate) struct Window<'a> {
    source: &'a Source,
    /// From the window's first byte on.
    range: Range<usize>,
    size: usize,
    buffer: Vec<u8>,
}

impl Window<'_> {
    /// Bytes between the window's start and the end of its range.
    pub(crate) fn remaining(&self) -> usize {
        self.range.len()
    }

    /// The file's position of the window's first byte.
    pub(crate) fn offset(&self) -> usize {
        self.range.start
    }

    /// The window's bytes: at least one, unless the range is at its end.
    pub(crate) fn load(&mut self) -> Result<&[u8], VdbError> {
        match self.source {
            Source::Memory(bytes) => Ok(&bytes[self.range.clone()]),
            Source::File { file, path, .. } => {
                self.buffer.resize(self.range.len().min(self.size), 0);
                read_exact_at(file, &mut self.buffer, self.range.start)
                    .map_err(|source| read_error(path, source))?;
                Ok(&self.buffer)
            }
        }
    }

    /// Moves the start to a later position of the file.
    pub(crate) fn advance_to(&mut self, offset: usize) {
        self.range.start = offset.clamp(self.range.start, self.range.end);
    }

    /// Doubles the window, for one item that does not fit.
    pub(crate) fn grow(&mut self) {
        self.size = self.size.saturating_mul(2);
    }
}

/// Where `needed` bytes from `offset` end, `None` if that is beyond `end`.
fn end_within(offset: usize, needed: u64, end: usize) -> Option<usize> {
    let needed_end = usize::try_from(needed).ok().and_then(|needed| offset.checked_add(needed))?;
    (needed_end <= end).then_some(needed_end)
}

fn read_error(path: &Path, source: io::Error) -> VdbError {
    VdbError::Io { action: "read", path: path.to_owned(), source }
}

#[cfg(unix)]
fn read_exact_at(file: &File, buffer: &mut [u8], offset: usize) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset as u64)
}

#[cfg(windows)]
fn read_exact_at(file: &File, buffer: &mut [u8], offset: usize) -> io::Result<()> {
    let mut done = 0;
    while done < buffer.len() {
        let at = (offset + done) as u64;
        match std::os::windows::fs::FileExt::seek_read(file, &mut buffer[done..], at)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => done += count,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers 0, 1, 2... as 32-bit words, in memory and on disk.
    fn sources(n_words: u32) -> (Vec<u8>, [Source; 2], tempfile::TempDir) {
        let bytes: Vec<u8> = (0..n_words).flat_map(u32::to_le_bytes).collect();
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("words");
        std::fs::write(&path, &bytes).expect("writes");
        (bytes.clone(), [Source::Memory(bytes), Source::open(&path).expect("opens")], folder)
    }

    #[test]
    fn ranges_are_clipped_to_the_file() {
        let (bytes, sources, _folder) = sources(100);
        for source in &sources {
            assert_eq!(source.bytes(8..20).expect("reads"), &bytes[8..20]);
            assert_eq!(source.bytes(390..usize::MAX).expect("reads"), &bytes[390..]);
            assert_eq!(source.bytes(500..600).expect("reads").len(), 0);
        }
    }

    #[test]
    fn parsing_gets_more_bytes_when_it_needs_them() {
        let (_, sources, _folder) = sources(100_000);
        for source in &sources {
            let last = |count: usize| {
                source.parse(4..source.len(), |cursor| {
                    cursor.take(4 * count, "words")?;
                    cursor.u32("last")
                })
            };
            assert_eq!(last(0).ok(), Some((1, 8)));
            assert_eq!(last(90_000).ok(), Some((90_001, 8 + 4 * 90_000)));
            assert!(matches!(last(99_999), Err(VdbError::Truncated { offset: 400_000, .. })));
        }
    }

    #[test]
    fn windows_move_and_grow() {
        let (bytes, sources, _folder) = sources(100);
        for source in &sources {
            let mut window = Window { size: 16, ..source.window(40..380) };
            window.advance_to(60);
            assert_eq!((window.offset(), window.remaining()), (60, 320));
            let seen = window.load().expect("reads");
            assert!(seen.len() >= 16 && bytes[60..380].starts_with(seen));
            window.grow();
            assert!(window.load().expect("reads").len() >= 32);
            window.advance_to(1000);
            assert_eq!((window.offset(), window.load().expect("reads").len()), (380, 0));
        }
    }

    /// Where a mapped file would end the process.
    #[test]
    fn a_file_that_shrinks_is_an_error() {
        let (_, [_, on_disk], folder) = sources(100);
        std::fs::write(folder.path().join("words"), [1, 2, 3]).expect("writes");
        assert!(matches!(on_disk.bytes(0..400), Err(VdbError::Io { .. })));
        assert!(matches!(on_disk.window(0..400).load(), Err(VdbError::Io { .. })));
    }
}

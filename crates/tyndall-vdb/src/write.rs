//! Float grids into VDB files that OpenVDB and everything built on it reads.
//!
//! File version 224, full floats, active-mask compression, optionally zipped. (OpenVDB itself never zips fog
//! volumes but reads them.) The same grids give the same bytes: no clock, no random numbers, no thread count.

mod bytes;
mod dense;
mod tree;

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

pub use dense::GridBuilder;

use crate::VdbError;
use crate::grid::Grid;

/// How node values are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WriteCompression {
    /// As they are: largest, fastest.
    #[default]
    None,
    /// zlib per leaf.
    Zip,
}

/// Writes grids as fog volumes, replacing `path` only when all bytes are on disk.
///
/// Leaves and tiles are written as they are; [`GridBuilder`] makes grids from dense arrays. Metadata entries are
/// kept except those this function states itself (name, class, bounds, voxel count, storage). Grids of the same
/// name are told apart by their order, as OpenVDB does it.
///
/// # Errors
/// [`VdbError::InvalidGrid`] for overlapping or misplaced leaves and tiles and for transforms that are not finite
/// or not invertible; [`VdbError::Io`] naming the file.
pub fn write_fog(path: &Path, grids: &[Grid], compression: WriteCompression) -> Result<(), VdbError> {
    let file_bytes = bytes::file(grids, compression)?;
    let temporary = temporary_beside(path);
    let written = write_new(&temporary, &file_bytes).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|source| {
        // Best effort: the first error is the one to report.
        let _ = fs::remove_file(&temporary);
        VdbError::Io { action: "write", path: path.to_owned(), source }
    })
}

/// In the same folder, because renaming replaces a file in one step only within one file system.
fn temporary_beside(path: &Path) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create(true).truncate(true).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

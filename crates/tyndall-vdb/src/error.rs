//! What can go wrong, in words a user can act on.

use std::io;
use std::path::PathBuf;

/// Why a file or grid could not be read or written. Byte offsets count from the start of the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VdbError {
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// "read", "write", ...
        action: &'static str,
        /// The file concerned.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The first bytes are neither OpenVDB's nor NanoVDB's.
    #[error("neither an OpenVDB nor a NanoVDB file: the magic number is missing")]
    NotVdb,
    /// A file version outside 218 to 225.
    #[error(
        "VDB file version {version} is not supported (218 to 225 are); load and save the file with a current OpenVDB"
    )]
    UnsupportedVersion {
        /// As stored in the file.
        version: u32,
    },
    /// A NanoVDB file that cannot be read as a whole.
    #[error("this NanoVDB file is not supported: {what}")]
    UnsupportedNanoVdb {
        /// The obstacle.
        what: String,
    },
    /// The file, or the part of it that belongs to one grid, ends too early.
    #[error(
        "the VDB file ends early: {what} at byte {offset} needs {needed} bytes but {available} are left; \
         it was cut off or is still being written"
    )]
    Truncated {
        /// What was being read.
        what: &'static str,
        /// Where.
        offset: usize,
        /// Bytes asked for.
        needed: u64,
        /// Bytes left.
        available: usize,
    },
    /// The bytes contradict each other.
    #[error("damaged VDB file: {what} (at byte {offset}); write it again or restore it from a copy")]
    Corrupt {
        /// The contradiction.
        what: String,
        /// Where.
        offset: usize,
    },
    /// No grid of that name, or not that many of it.
    #[error(
        "no grid named \"{name}\"{}; the file has {}",
        index.map(|i| format!(" with index {i}")).unwrap_or_default(),
        if available.is_empty() { "no grids".to_owned() } else { available.join(", ") }
    )]
    NoSuchGrid {
        /// As asked for.
        name: String,
        /// As asked for.
        index: Option<usize>,
        /// Names in the file, duplicates as `name[1]`.
        available: Vec<String>,
    },
    /// A sound grid that is too large for this machine.
    #[error("not enough memory: the grid's voxels take {} MiB", bytes >> 20)]
    OutOfMemory {
        /// Size of the decoded voxels.
        bytes: u64,
    },
    /// A sound grid of a kind this crate does not decode.
    #[error("grid \"{name}\" cannot be used: {what}")]
    UnsupportedGrid {
        /// The grid.
        name: String,
        /// The obstacle, e.g. "frustum transform".
        what: String,
    },
    /// A grid handed to the writer that no VDB file can represent.
    #[error("grid \"{name}\" cannot be written: {what}")]
    InvalidGrid {
        /// The grid.
        name: String,
        /// The obstacle.
        what: String,
    },
}

impl VdbError {
    pub(crate) fn corrupt(offset: usize, what: impl Into<String>) -> Self {
        Self::Corrupt { what: what.into(), offset }
    }

    pub(crate) fn unsupported(name: &str, what: impl Into<String>) -> Self {
        Self::UnsupportedGrid { name: name.to_owned(), what: what.into() }
    }
}

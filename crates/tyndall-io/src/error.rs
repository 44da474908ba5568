//! What can go wrong with a file; every message names the file and what to do.

use std::io;
use std::path::{Path, PathBuf};
use tyndall_scene::AssetError;

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The output folder does not exist.
    #[error(
        "cannot write {path:?}: the folder {folder:?} does not exist; create it or choose another output path"
    )]
    FolderMissing {
        /// The file to be written.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The output path names something that is not a file.
    #[error("cannot write {path:?}: it exists and is not a regular file; choose another output path")]
    NotAFile {
        /// The path to be written.
        path: PathBuf,
    },
    /// The operating system refused to write.
    #[error("cannot write {path:?}: {source}; check free space and permissions of its folder")]
    Write {
        /// The file to be written.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The caller's image does not fit its own description.
    #[error("cannot write {path:?}: {reason}")]
    InvalidImage {
        /// The file to be written.
        path: PathBuf,
        /// What does not fit, and what would.
        reason: String,
    },
    /// The operating system refused to read.
    #[error("cannot read {path:?}: {source}; check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No reader knows this kind of file.
    #[error("cannot read {path:?}: {reason}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it is, and what to convert it to.
        reason: String,
    },
    /// The content contradicts itself or ends early.
    #[error("cannot read {path:?}: the file is damaged ({reason}); write or copy it again")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What the decoder found.
        reason: String,
    },
    /// The header announces more pixels than the bytes that follow can hold.
    #[error(
        "cannot read {path:?}: its header announces {bytes} bytes of pixels, more than a file of this size can hold \
         ({limit} at most); the file is damaged, write or copy it again"
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Bytes the decoded image would take.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
}

impl IoError {
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.into(), source }
    }

    /// The system's refusal while writing `path`.
    pub fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.into(), source }
    }

    pub(crate) fn damaged(path: &Path, reason: impl ToString) -> Self {
        Self::Damaged { path: path.into(), reason: reason.to_string() }
    }

    pub(crate) fn unsupported(path: &Path, reason: impl ToString) -> Self {
        Self::Unsupported { path: path.into(), reason: reason.to_string() }
    }

    pub(crate) fn invalid_image(path: &Path, reason: impl ToString) -> Self {
        Self::InvalidImage { path: path.into(), reason: reason.to_string() }
    }
}

impl From<IoError> for AssetError {
    fn from(error: IoError) -> Self {
        Self { message: error.to_string() }
    }
}

//! Whole files whose content this crate does not know.

use crate::IoError;
use std::fs;
use std::path::Path;

/// All bytes of the file at `path`.
///
/// # Errors
/// The system refused.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, IoError> {
    fs::read(path).map_err(|e| IoError::read(path, e))
}

//! Grids of floats and vectors into VDB files that OpenVDB and everything built on it reads.
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

/// A grid to write, of one of the types that can be written.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum FogGrid<'a> {
    /// Density, temperature and the like.
    Float(&'a Grid),
    /// Velocity, colour and the like.
    Vec3s(&'a Grid<[f32; 3]>),
}

impl FogGrid<'_> {
    fn name(&self) -> &str {
        match self {
            Self::Float(grid) => &grid.name,
            Self::Vec3s(grid) => &grid.name,
        }
    }

    fn tree_type(&self) -> &'static str {
        match self {
            Self::Float(_) => "Tree_float_5_4_3",
            Self::Vec3s(_) => "Tree_vec3s_5_4_3",
        }
    }
}

impl<'a> From<&'a Grid> for FogGrid<'a> {
    fn from(grid: &'a Grid) -> Self {
        Self::Float(grid)
    }
}

impl<'a> From<&'a Grid<[f32; 3]>> for FogGrid<'a> {
    fn from(grid: &'a Grid<[f32; 3]>) -> Self {
        Self::Vec3s(grid)
    }
}

/// Writes float grids as fog volumes: [`write_grids`] for the common case.
///
/// # Errors
/// As [`write_grids`].
pub fn write_fog(path: &Path, grids: &[Grid], compression: WriteCompression) -> Result<(), VdbError> {
    write_grids(path, &grids.iter().map(FogGrid::from).collect::<Vec<_>>(), compression)
}

/// Writes grids of several types as fog volumes (staggered grids and level sets stay what they are), replacing `path` only when all bytes are
/// on disk.
///
/// Leaves and tiles are written as they are; [`GridBuilder`] makes grids from dense arrays. Metadata entries are
/// kept except those this function states itself (name, class, bounds, voxel count, storage). Grids of the same
/// name are told apart by their order, as OpenVDB does it.
///
/// # Errors
/// [`VdbError::InvalidGrid`] for overlapping or misplaced leaves and tiles and for transforms that are not finite
/// or not invertible; [`VdbError::Io`] naming the file.
pub fn write_grids(
    path: &Path,
    grids: &[FogGrid<'_>],
    compression: WriteCompression,
) -> Result<(), VdbError> {
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

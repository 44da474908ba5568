//! How a committed scene gets at the content of files without opening any itself.

use crate::prim::FieldSource;
use glam::DAffine3;
use std::path::Path;
use std::sync::Arc;
use tyndall_vdb::Grid;

/// How the numbers of an image file are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ColorSpace {
    /// sRGB for 8-bit files with three or more channels, linear otherwise (UsdUVTexture's `auto`).
    #[default]
    Auto,
    /// Display-encoded; converted to linear on load.
    Srgb,
    /// Data or linear colour; taken as it is.
    Raw,
}

/// A decoded image, linear, four f32 channels a pixel, row 0 at the top.
#[derive(Debug, Clone)]
pub struct ImageData {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row-major RGBA, `width * height` entries; alpha is 1 where the file has none.
    pub pixels: Vec<[f32; 4]>,
}

/// A grid of a file.
#[derive(Debug)]
pub enum FieldGrid {
    /// Of numbers: densities, temperatures, distances.
    Scalar(Grid),
    /// Of vectors: colours.
    Vector(Grid<[f32; 3]>),
}

impl FieldGrid {
    /// Index space (voxel centres at integers) to the file's world space.
    pub fn file_from_index(&self) -> DAffine3 {
        match self {
            Self::Scalar(grid) => grid.file_from_index,
            Self::Vector(grid) => grid.file_from_index,
        }
    }
}

/// Why a file could not be used; the text names the file and what to do.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{message}")]
pub struct AssetError {
    /// What went wrong, naming the file.
    pub message: String,
}

/// Gives the content of files named by prims. Implementations cache, so asking twice is cheap, and are thread-safe.
pub trait AssetLoader: Send + Sync {
    /// The grid that a field names; asking again for an unchanged file gives the same allocation.
    ///
    /// # Errors
    /// The file is missing, damaged, or has no such grid.
    fn grid(&self, source: &FieldSource) -> Result<Arc<FieldGrid>, AssetError> {
        // A loader of images only.
        let message = format!("{source:?} cannot be loaded here: this loader knows no grids");
        Err(AssetError { message })
    }

    /// The image at `path`, linear.
    ///
    /// # Errors
    /// The file is missing, damaged, or of an unknown format.
    fn image(&self, path: &Path, color_space: ColorSpace) -> Result<Arc<ImageData>, AssetError>;
}

//! NanoVDB files (`.nvdb`) of format 32, read into the same grids as OpenVDB's.
//!
//! A NanoVDB grid is an image of memory: fixed structures with byte offsets to each other, padded to 32 bytes. It is
//! stored raw, as one zlib stream, or as Blosc chunks. Files are lists of segments (header, one entry per grid, then
//! the grids), or, since 32.6, bare grids without any list.
//!
//! Source: the layout described in `NanoVDB.h` and `io/IO.h` of OpenVDB 12, whose major version, 32, stands for the
//! layout; minor versions change the programming interface only.
//!
//! Unlike OpenVDB's, a grid's bytes are unpacked as a whole before leaves are decoded, so at its peak reading takes the
//! grid twice.

mod image;
mod layout;
mod list;
mod packing;
mod quantized;
mod tree;

use std::ops::Range;

use rustc_hash::FxHashMap;

use crate::VdbError;
use crate::descriptor::GridInfo;
use crate::grid::Grid;
use crate::source::Source;
use crate::value::Value;
use image::{GridHead, Image};
use packing::Codec;

/// Number of bytes that tell a NanoVDB file from others.
pub(crate) const MAGIC_BYTES: usize = 8;
/// Of the format.
pub(crate) const MAJOR_VERSION: u32 = 32;

/// Whether a file starts like a NanoVDB file of any kind.
pub(crate) fn is_nano(first_bytes: &[u8]) -> bool {
    first_bytes.len() == MAGIC_BYTES
        && (first_bytes.starts_with(b"NanoVDB") || first_bytes.ends_with(b"BDVonaN"))
}

/// Where the grids of a file are.
#[derive(Debug)]
pub(crate) struct NanoFile {
    grids: Vec<StoredGrid>,
}

/// One grid as stored.
#[derive(Debug)]
struct StoredGrid {
    bytes: Range<usize>,
    codec: Codec,
    /// Claimed size of the unpacked grid.
    unpacked: u64,
    name: String,
}

impl NanoFile {
    /// Finds all grids; only their first bytes are unpacked.
    pub(crate) fn read(source: &Source) -> Result<(Self, Vec<GridInfo>), VdbError> {
        let grids = list::read(source)?;
        let mut counts: FxHashMap<&str, usize> = FxHashMap::default();
        let mut infos = Vec::new();
        for grid in &grids {
            let count = counts.entry(&grid.name).or_default();
            infos.push(grid.head(source)?.info(&grid.name, *count));
            *count += 1;
        }
        Ok((Self { grids }, infos))
    }

    /// Decodes the grid at `position` of the list, whose voxels are of type `T`, converting each value.
    pub(crate) fn decode<T: Value, U: Value>(
        &self,
        source: &Source,
        position: usize,
        info: &GridInfo,
        convert: impl Fn(T) -> U + Sync,
    ) -> Result<Grid<U>, VdbError> {
        let stored = &self.grids[position];
        let unpacked = packing::unpack(source.bytes(stored.bytes.clone())?, stored)?;
        let image = Image::new(&unpacked, stored.bytes.start);
        let head = GridHead::read(&image)?;
        let Some(file_from_index) = head.file_from_index else {
            return Err(VdbError::corrupt(stored.bytes.start, "the grid's transform is not finite"));
        };
        let tree = tree::read(&image, &head, &stored.name, convert)?;
        let mut grid = Grid::new(stored.name.as_str(), tree.background, file_from_index);
        grid.class = info.class;
        grid.tiles = tree.tiles;
        grid.leaves = tree.leaves;
        Ok(grid)
    }
}

impl StoredGrid {
    fn head(&self, source: &Source) -> Result<GridHead, VdbError> {
        let (bytes, _) =
            source.parse(self.bytes.clone(), |cursor| packing::unpack_head(cursor, self.codec))?;
        GridHead::read(&Image::new(&bytes, self.bytes.start))
    }
}

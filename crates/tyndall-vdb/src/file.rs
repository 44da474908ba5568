//! A whole file: the list of grids, and one grid at a time on request.

use std::path::Path;

use crate::VdbError;
use crate::archive::Archive;
use crate::descriptor::GridInfo;
use crate::grid::Grid;
use crate::metadata::MetaValue;
use crate::nvdb::{self, NanoFile};
use crate::source::Source;
use crate::value::{Scalar, Value, ValueType};

/// An opened OpenVDB or NanoVDB file. Only headers, metadata and transforms are parsed; voxels are decoded by
/// [`Self::read_grid`], which reads the bytes of that grid and no others.
#[derive(Debug)]
pub struct VdbFile {
    source: Source,
    format: Format,
    grids: Vec<GridInfo>,
}

#[derive(Debug)]
enum Format {
    Open(Archive),
    Nano(NanoFile),
}

impl VdbFile {
    /// Opens a file and parses everything but voxels. The first bytes tell OpenVDB from NanoVDB, not the name.
    ///
    /// # Errors
    /// [`VdbError::Io`], [`VdbError::NotVdb`], [`VdbError::UnsupportedVersion`], [`VdbError::UnsupportedNanoVdb`],
    /// or a header or list of grids that is cut off or contradicts itself.
    pub fn open(path: &Path) -> Result<Self, VdbError> {
        Self::from_source(Source::open(path)?)
    }

    /// As [`Self::open`], from bytes in memory.
    ///
    /// # Errors
    /// As [`Self::open`], except `Io`.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, VdbError> {
        Self::from_source(Source::Memory(bytes))
    }

    fn from_source(source: Source) -> Result<Self, VdbError> {
        if nvdb::is_nano(&source.bytes(0..nvdb::MAGIC_BYTES)?) {
            let (file, grids) = NanoFile::read(&source)?;
            return Ok(Self { source, format: Format::Nano(file), grids });
        }
        let (archive, source) = Archive::read(source)?;
        let grids = archive.list(&source);
        Ok(Self { source, format: Format::Open(archive), grids })
    }

    /// The grids in file order.
    pub fn grids(&self) -> &[GridInfo] {
        &self.grids
    }

    /// Metadata of the file, not of a grid. NanoVDB files have none.
    pub fn metadata(&self) -> &[(String, MetaValue)] {
        match &self.format {
            Format::Open(archive) => archive.metadata(),
            Format::Nano(_) => &[],
        }
    }

    /// The file format version: 218 to 225 for OpenVDB, 32 (the major version) for NanoVDB.
    pub fn version(&self) -> u32 {
        match &self.format {
            Format::Open(archive) => archive.version(),
            Format::Nano(_) => nvdb::MAJOR_VERSION,
        }
    }

    /// Number of grids missing from [`Self::grids`]: in a stream file, what follows a grid of unknown layout cannot
    /// be found. Zero for all other files.
    pub fn n_unlisted_grids(&self) -> usize {
        match &self.format {
            Format::Open(archive) => archive.n_unlisted(),
            Format::Nano(_) => 0,
        }
    }

    /// Decodes a grid of numbers into 32-bit floats: doubles and integers are rounded, true is one.
    ///
    /// `index` chooses among grids of the same name in file order, the first if `None`. `name` may also have
    /// OpenVDB's form `density[1]`.
    ///
    /// # Errors
    /// [`VdbError::NoSuchGrid`]; [`VdbError::UnsupportedGrid`] for vector, points, index and frustum grids;
    /// [`VdbError::Truncated`] and [`VdbError::Corrupt`] for damaged ones; [`VdbError::OutOfMemory`].
    pub fn read_grid(&self, name: &str, index: Option<usize>) -> Result<Grid, VdbError> {
        let position = self.find(name, index)?;
        match self.grids[position].value_type {
            ValueType::Float => self.decode::<f32, _>(position, |value| value),
            ValueType::Double => self.decode(position, f64::to_f32),
            ValueType::Half => self.decode(position, <half::f16 as Scalar>::to_f32),
            ValueType::Int32 => self.decode(position, i32::to_f32),
            ValueType::Int64 => self.decode(position, i64::to_f32),
            ValueType::Bool | ValueType::Mask => self.decode(position, bool::to_f32),
            ref other => {
                Err(VdbError::unsupported(name, format!("it is a {other} grid, a float grid is needed")))
            }
        }
    }

    /// Decodes a grid of vectors into 32-bit floats: colours, velocities.
    ///
    /// # Errors
    /// As [`Self::read_grid`], for grids of anything but vectors.
    pub fn read_vector_grid(&self, name: &str, index: Option<usize>) -> Result<Grid<[f32; 3]>, VdbError> {
        let position = self.find(name, index)?;
        match self.grids[position].value_type {
            ValueType::Vec3s => self.decode::<[f32; 3], _>(position, |value| value),
            ValueType::Vec3d => self.decode(position, |value: [f64; 3]| value.map(|x| x as f32)),
            ValueType::Vec3i => self.decode(position, |value: [i32; 3]| value.map(|x| x as f32)),
            ref other => {
                Err(VdbError::unsupported(name, format!("it is a {other} grid, a vector grid is needed")))
            }
        }
    }

    /// The type of a grid's values.
    ///
    /// # Errors
    /// [`VdbError::NoSuchGrid`].
    pub fn value_type(&self, name: &str, index: Option<usize>) -> Result<&ValueType, VdbError> {
        Ok(&self.grids[self.find(name, index)?].value_type)
    }

    /// Decodes a grid in its own type, e.g. `[f32; 3]` for `vec3s`. Mask grids are grids of `bool` in which a voxel is
    /// true if it is active.
    ///
    /// # Errors
    /// As [`Self::read_grid`], and [`VdbError::UnsupportedGrid`] if the grid's type is not `T`.
    pub fn read_grid_as<T: Value>(&self, name: &str, index: Option<usize>) -> Result<Grid<T>, VdbError> {
        let position = self.find(name, index)?;
        let found = &self.grids[position].value_type;
        let is_mask_as_bool = *found == ValueType::Mask && T::TYPE == ValueType::Bool;
        if *found != T::TYPE && !is_mask_as_bool {
            let what = format!("it is a {found} grid, a {} grid is needed", T::TYPE);
            return Err(VdbError::unsupported(name, what));
        }
        self.decode(position, |value: T| value)
    }

    fn decode<T: Value, U: Value>(
        &self,
        position: usize,
        convert: impl Fn(T) -> U + Sync,
    ) -> Result<Grid<U>, VdbError> {
        match &self.format {
            Format::Open(archive) => archive.decode(&self.source, position, convert),
            Format::Nano(file) => file.decode(&self.source, position, &self.grids[position], convert),
        }
    }

    fn find(&self, name: &str, index: Option<usize>) -> Result<usize, VdbError> {
        let position = |name: &str, index: usize| {
            self.grids.iter().position(|grid| grid.name == name && grid.index == index)
        };
        let bracketed = || {
            let (name, number) = name.strip_suffix(']')?.rsplit_once('[')?;
            number.parse().ok().and_then(|number| position(name, number))
        };
        let found = position(name, index.unwrap_or(0)).or_else(|| bracketed().filter(|_| index.is_none()));
        found.ok_or_else(|| VdbError::NoSuchGrid { name: name.to_owned(), index, available: self.names() })
    }

    /// Names for messages, `density[1]` for duplicates.
    fn names(&self) -> Vec<String> {
        let has_index = |grid: &GridInfo| grid.index > 0;
        let name = |grid: &GridInfo| {
            if has_index(grid) { format!("{}[{}]", grid.name, grid.index) } else { grid.name.clone() }
        };
        let n_unlisted = self.n_unlisted_grids();
        let unlisted = (n_unlisted > 0).then(|| format!("{n_unlisted} that cannot be reached"));
        self.grids.iter().map(name).chain(unlisted).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows much smaller than a leaf, and of a few leaves, against the whole file in memory.
    #[test]
    fn any_window_gives_the_same_leaves() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
        for name in ["form_none_masks.vdb", "form_blosc.vdb", "version_221_half.vdb", "native_fog.vdb"] {
            let path = folder.join(name);
            let read = |file: VdbFile| file.read_grid("density", None).expect(name);
            let whole = read(VdbFile::from_bytes(std::fs::read(&path).expect(name)).expect(name));
            for bytes in [1, 700, 5000] {
                let mut source = Source::open(&path).expect(name);
                if let Source::File { window_bytes, .. } = &mut source {
                    *window_bytes = bytes;
                }
                let grid = read(VdbFile::from_source(source).expect(name));
                assert_eq!((grid.leaves, grid.tiles), (whole.leaves.clone(), whole.tiles.clone()), "{name}");
            }
        }
    }
}

//! A grid's bytes as they were in memory, and what its first structure says.

use glam::{DAffine3, DMat3, DVec3};

use super::layout::Layout;
use super::list::check_version;
use crate::VdbError;
use crate::descriptor::{GridInfo, TREE_SHAPE};
use crate::grid::GridClass;
use crate::value::ValueType;

/// The structure that every grid begins with; the tree's follows.
pub(super) const HEAD_BYTES: usize = 672;
const MATRIX_AT: usize = 384;
const TRANSLATION_AT: usize = 528;
const CLASS_AT: usize = 632;
const TYPE_AT: usize = 636;

/// An unpacked grid: bytes addressed by their offset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Image<'a> {
    bytes: &'a [u8],
    /// The stored grid's position in the file, for messages.
    file_offset: usize,
}

impl<'a> Image<'a> {
    pub(super) fn new(bytes: &'a [u8], file_offset: usize) -> Self {
        Self { bytes, file_offset }
    }

    pub(super) fn corrupt(&self, what: impl Into<String>) -> VdbError {
        VdbError::corrupt(self.file_offset, what)
    }

    pub(super) fn bytes(&self, offset: usize, count: usize) -> Result<&'a [u8], VdbError> {
        let tail = self.bytes.get(offset..).and_then(|tail| tail.get(..count));
        tail.ok_or_else(|| self.corrupt("an offset in a NanoVDB grid points outside of it"))
    }

    pub(super) fn array<const N: usize>(&self, offset: usize) -> Result<[u8; N], VdbError> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(offset, N)?);
        Ok(array)
    }

    pub(super) fn u32(&self, offset: usize) -> Result<u32, VdbError> {
        self.array(offset).map(u32::from_le_bytes)
    }

    pub(super) fn u64(&self, offset: usize) -> Result<u64, VdbError> {
        self.array(offset).map(u64::from_le_bytes)
    }

    pub(super) fn i64(&self, offset: usize) -> Result<i64, VdbError> {
        self.array(offset).map(i64::from_le_bytes)
    }

    pub(super) fn vector(&self, offset: usize) -> Result<DVec3, VdbError> {
        let component = |axis: usize| self.array(offset + 8 * axis).map(f64::from_le_bytes);
        Ok(DVec3::new(component(0)?, component(1)?, component(2)?))
    }

    /// The offset `relative` bytes from `base`. It is inside the image, so that adding a structure's size to it does
    /// not overflow.
    pub(super) fn follow(&self, base: usize, relative: i64) -> Result<usize, VdbError> {
        let target = isize::try_from(relative).ok().and_then(|relative| base.checked_add_signed(relative));
        let target = target.filter(|&target| target <= self.bytes.len());
        target.ok_or_else(|| self.corrupt("an offset in a NanoVDB grid points outside of it"))
    }
}

/// What the first structure says.
#[derive(Debug)]
pub(super) struct GridHead {
    class: GridClass,
    pub(super) value_type: ValueType,
    /// How values are stored; `None` for types that are not read.
    pub(super) layout: Option<Layout>,
    /// `None` if not finite.
    pub(super) file_from_index: Option<DAffine3>,
}

impl GridHead {
    pub(super) fn read(image: &Image<'_>) -> Result<Self, VdbError> {
        if !image.bytes(0, HEAD_BYTES)?.starts_with(b"NanoVDB") {
            return Err(image.corrupt("a NanoVDB grid without its magic number"));
        }
        check_version(image.u32(16)?)?;
        // Row by row, while glam wants columns.
        let rows = DMat3::from_cols(
            image.vector(MATRIX_AT)?,
            image.vector(MATRIX_AT + 24)?,
            image.vector(MATRIX_AT + 48)?,
        );
        let map = DAffine3::from_mat3_translation(rows.transpose(), image.vector(TRANSLATION_AT)?);
        let (value_type, layout) = Layout::of(image.u32(TYPE_AT)?);
        let class = match image.u32(CLASS_AT)? {
            1 => GridClass::LevelSet,
            2 => GridClass::FogVolume,
            3 => GridClass::Staggered,
            _ => GridClass::Unknown,
        };
        Ok(Self { class, value_type, layout, file_from_index: Some(map).filter(|map| map.is_finite()) })
    }

    pub(super) fn info(self, name: &str, index: usize) -> GridInfo {
        GridInfo {
            name: name.to_owned(),
            index,
            value_type: self.value_type,
            tree_shape: TREE_SHAPE.to_owned(),
            class: self.class,
            saved_as_half: false,
            is_instance: false,
            metadata: Vec::new(),
            file_from_index: self.file_from_index,
        }
    }
}

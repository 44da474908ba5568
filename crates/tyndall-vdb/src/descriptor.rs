//! The list of grids: names, types, and where each grid's bytes are.

use std::ops::Range;

use glam::DAffine3;

use crate::VdbError;
use crate::cursor::Cursor;
use crate::grid::GridClass;
use crate::metadata::{MetaValue, find};
use crate::value::ValueType;

/// Separates a name from its number where several grids have the same name.
pub(crate) const NAME_SEPARATOR: char = '\x1e';
/// Ends the type of a grid whose floats are stored as half floats.
const HALF_SUFFIX: &str = "_HalfFloat";
/// The only tree shape read: 32³ and 16³ nodes over 8³ leaves.
pub(crate) const TREE_SHAPE: &str = "5_4_3";

/// What a file says about a grid before its voxels are decoded.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct GridInfo {
    /// The name without the suffix that tells grids of the same name apart.
    pub name: String,
    /// 0, 1, 2... among the grids of this name, in file order.
    pub index: usize,
    /// Type of the voxels.
    pub value_type: ValueType,
    /// The shape of the tree, `5_4_3` for all common grids.
    pub tree_shape: String,
    /// What the values mean.
    pub class: GridClass,
    /// Floats are stored as 16-bit half floats.
    pub saved_as_half: bool,
    /// The grid shares the tree of another one, differing in name, metadata and transform.
    pub is_instance: bool,
    /// In file order; empty if it cannot be read (reading the grid then says why).
    pub metadata: Vec<(String, MetaValue)>,
    /// As [`crate::Grid::file_from_index`]; `None` for frustum and unknown transforms.
    pub file_from_index: Option<DAffine3>,
}

impl GridInfo {
    /// The first metadata entry called `key`.
    pub fn meta(&self, key: &str) -> Option<&MetaValue> {
        find(&self.metadata, key)
    }
}

/// One entry of the list.
#[derive(Debug, Clone)]
pub(crate) struct Descriptor {
    /// With suffix: what instances refer to.
    pub(crate) unique_name: String,
    /// Empty unless this grid is an instance.
    pub(crate) parent: String,
    pub(crate) value_type: ValueType,
    pub(crate) tree_shape: String,
    pub(crate) saved_as_half: bool,
    /// Bytes of compression word, metadata, transform and tree.
    pub(crate) body: Range<usize>,
}

impl Descriptor {
    /// Least number of bytes an entry takes: three empty strings and three offsets.
    pub(crate) const SMALLEST: u64 = 3 * 4 + 3 * 8;

    /// Reads an entry; in a stream file the offsets mean nothing and the body is left open at the file's end.
    pub(crate) fn read(cursor: &mut Cursor<'_>, has_offsets: bool) -> Result<Self, VdbError> {
        let unique_name = cursor.string("grid name")?;
        let tree_type = cursor.string("grid type")?;
        let parent = cursor.string("instance parent")?;
        let at = cursor.offset();
        let body = Offsets::read(cursor)?.body(at, cursor, has_offsets)?;
        let saved_as_half = tree_type.ends_with(HALF_SUFFIX);
        let (value_type, tree_shape) = split_type(tree_type.strip_suffix(HALF_SUFFIX).unwrap_or(&tree_type));
        Ok(Self { unique_name, parent, value_type, tree_shape, saved_as_half, body })
    }

    pub(crate) fn is_instance(&self) -> bool {
        !self.parent.is_empty()
    }

    /// The name up to the separator.
    pub(crate) fn name(&self) -> &str {
        self.unique_name.split(NAME_SEPARATOR).next().unwrap_or_default()
    }
}

/// `Tree_float_5_4_3` into `float` and `5_4_3`.
fn split_type(tree_type: &str) -> (ValueType, String) {
    let inner = tree_type.strip_prefix("Tree_").unwrap_or(tree_type);
    let (value, shape) = inner.split_once('_').unwrap_or((inner, ""));
    (ValueType::from_name(value), shape.to_owned())
}

struct Offsets {
    grid: i64,
    end: i64,
}

impl Offsets {
    fn read(cursor: &mut Cursor<'_>) -> Result<Self, VdbError> {
        let grid = cursor.i64("grid offset")?;
        cursor.i64("block offset")?;
        Ok(Self { grid, end: cursor.i64("end offset")? })
    }

    /// The grid's bytes. They must lie behind the descriptor, so that grids cannot share bytes: otherwise a small
    /// file could list the same large metadata a million times.
    fn body(&self, at: usize, cursor: &Cursor<'_>, has_offsets: bool) -> Result<Range<usize>, VdbError> {
        let here = cursor.offset();
        let file_end = here + cursor.remaining();
        if !has_offsets {
            return Ok(here..file_end);
        }
        let (Ok(start), Ok(end)) = (usize::try_from(self.grid), usize::try_from(self.end)) else {
            return Err(VdbError::corrupt(at, "a grid's offsets are negative"));
        };
        if start < here || end < start {
            return Err(VdbError::corrupt(at, "a grid's offsets point backwards"));
        }
        if end > file_end {
            let needed = (end - here) as u64;
            return Err(VdbError::Truncated {
                what: "grid",
                offset: here,
                needed,
                available: cursor.remaining(),
            });
        }
        Ok(start..end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_split_into_value_and_shape() {
        assert_eq!(split_type("Tree_float_5_4_3"), (ValueType::Float, "5_4_3".to_owned()));
        assert_eq!(split_type("Tree_vec3s_4_3"), (ValueType::Vec3s, "4_3".to_owned()));
        assert_eq!(split_type("odd"), (ValueType::Other("odd".to_owned()), String::new()));
    }

    #[test]
    fn offsets_must_point_forward_and_inside() {
        let bytes = [0; 100];
        let cursor = Cursor::new(&bytes, 40);
        let body = |grid, end| Offsets { grid, end }.body(16, &cursor, true);
        assert_eq!(body(40, 100).ok(), Some(40..100));
        assert!(matches!(body(39, 100), Err(VdbError::Corrupt { .. })));
        assert!(matches!(body(50, 45), Err(VdbError::Corrupt { .. })));
        assert!(matches!(body(-1, 45), Err(VdbError::Corrupt { .. })));
        assert!(matches!(body(40, i64::MAX), Err(VdbError::Truncated { .. })));
    }
}

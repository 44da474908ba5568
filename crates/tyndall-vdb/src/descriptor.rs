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
    /// Where the leaf buffers are said to begin, inside the body. A hint: OpenVDB itself doesn't go by it.
    pub(crate) buffers_at: usize,
}

impl Descriptor {
    /// Least number of bytes an entry takes: three empty strings and three offsets.
    pub(crate) const SMALLEST: u64 = 3 * 4 + 3 * 8;

    /// Reads an entry of a file of `file_len` bytes; in a stream file the offsets mean nothing and the body is left
    /// open at the file's end.
    pub(crate) fn read(
        cursor: &mut Cursor<'_>,
        has_offsets: bool,
        file_len: usize,
    ) -> Result<Self, VdbError> {
        let unique_name = cursor.string("grid name")?;
        let tree_type = cursor.string("grid type")?;
        let parent = cursor.string("instance parent")?;
        let at = cursor.offset();
        let offsets = Offsets::read(cursor)?;
        let here = cursor.offset();
        let body = if has_offsets { offsets.body(at, here, file_len)? } else { here..file_len };
        let buffers_at = usize::try_from(offsets.buffers).unwrap_or(body.end).clamp(body.start, body.end);
        let saved_as_half = tree_type.ends_with(HALF_SUFFIX);
        let (value_type, tree_shape) = split_type(tree_type.strip_suffix(HALF_SUFFIX).unwrap_or(&tree_type));
        Ok(Self { unique_name, parent, value_type, tree_shape, saved_as_half, body, buffers_at })
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
    buffers: i64,
    end: i64,
}

impl Offsets {
    fn read(cursor: &mut Cursor<'_>) -> Result<Self, VdbError> {
        let mut next = || cursor.i64("grid offsets");
        Ok(Self { grid: next()?, buffers: next()?, end: next()? })
    }

    /// The grid's bytes. They must lie behind the descriptor, which ends at `here`, so that grids cannot share bytes:
    /// otherwise a small file could list the same large metadata a million times.
    fn body(&self, at: usize, here: usize, file_len: usize) -> Result<Range<usize>, VdbError> {
        let (Ok(start), Ok(end)) = (usize::try_from(self.grid), usize::try_from(self.end)) else {
            return Err(VdbError::corrupt(at, "a grid's offsets are negative"));
        };
        if start < here || end < start {
            return Err(VdbError::corrupt(at, "a grid's offsets point backwards"));
        }
        if end > file_len {
            let needed = (end - here) as u64;
            let available = file_len.saturating_sub(here);
            return Err(VdbError::Truncated { what: "grid", offset: here, needed, available });
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
        let body = |grid, end| Offsets { grid, buffers: 0, end }.body(16, 40, 100);
        assert_eq!(body(40, 100).ok(), Some(40..100));
        assert!(matches!(body(39, 100), Err(VdbError::Corrupt { .. })));
        assert!(matches!(body(50, 45), Err(VdbError::Corrupt { .. })));
        assert!(matches!(body(-1, 45), Err(VdbError::Corrupt { .. })));
        assert!(matches!(body(40, i64::MAX), Err(VdbError::Truncated { .. })));
    }

    /// An entry whose buffers begin at `buffers`, read.
    fn buffers_at(buffers: i64) -> usize {
        let mut bytes = vec![0; 12];
        [40, buffers, 90].iter().for_each(|offset: &i64| bytes.extend(offset.to_le_bytes()));
        Descriptor::read(&mut Cursor::new(&bytes, 0), true, 100).expect("an entry").buffers_at
    }

    #[test]
    fn the_hint_stays_inside_the_grid() {
        assert_eq!(
            [i64::MIN, -1, 0, 40, 60, 90, 91, i64::MAX].map(buffers_at),
            [90, 90, 40, 40, 60, 90, 90, 90]
        );
    }
}

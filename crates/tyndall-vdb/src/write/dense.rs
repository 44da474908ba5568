//! Sparse grids out of dense arrays.

use glam::DAffine3;

use crate::VdbError;
use crate::grid::{Grid, GridClass, LEAF_VOXELS, Leaf};
use crate::metadata::MetaValue;
use crate::value::Value;

/// Makes a fog volume from a dense array, keeping only leaves with a voxel that differs from the background.
#[derive(Debug, Clone)]
pub struct GridBuilder<'a, T = f32> {
    name: String,
    dims: [usize; 3],
    origin: [i32; 3],
    values: &'a [T],
    background: T,
    file_from_index: DAffine3,
    metadata: Vec<(String, MetaValue)>,
}

impl<'a, T: Value> GridBuilder<'a, T> {
    /// `values` has `dims[0] * dims[1] * dims[2]` entries; voxel `origin + (x, y, z)` is entry
    /// `(x * dims[1] + y) * dims[2] + z`. `file_from_index` maps voxel centres to the file's world space. The
    /// background is zero.
    pub fn from_dense(
        name: impl Into<String>,
        dims: [usize; 3],
        origin: [i32; 3],
        values: &'a [T],
        file_from_index: DAffine3,
    ) -> Self {
        let name = name.into();
        Self { name, dims, origin, values, background: T::default(), file_from_index, metadata: Vec::new() }
    }

    /// Value of all voxels outside the array; voxels inside that have it are inactive.
    pub fn background(mut self, background: T) -> Self {
        self.background = background;
        self
    }

    /// Adds a metadata entry.
    pub fn metadata(mut self, key: impl Into<String>, value: MetaValue) -> Self {
        self.metadata.push((key.into(), value));
        self
    }

    /// The grid, leaves in ascending order. Active are the voxels that differ from the background (NaN does).
    ///
    /// # Errors
    /// [`VdbError::InvalidGrid`] if `values` has another length or a voxel lies beyond the 32-bit range.
    pub fn build(self) -> Result<Grid<T>, VdbError> {
        let invalid = |what: String| VdbError::InvalidGrid { name: self.name.clone(), what };
        let [nx, ny, nz] = self.dims;
        let expected = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz));
        if expected != Some(self.values.len()) {
            return Err(invalid(format!("{} values for dimensions {nx} x {ny} x {nz}", self.values.len())));
        }
        let mut grid = Grid::new(self.name.clone(), self.background, self.file_from_index);
        grid.class = GridClass::FogVolume;
        grid.metadata = self.metadata.clone();
        if self.values.is_empty() {
            return Ok(grid);
        }
        let last = self.last_voxel().ok_or_else(|| invalid("voxels beyond the 32-bit range".to_owned()))?;
        grid.leaves = leaf_origins(self.origin, last).filter_map(|origin| self.leaf(origin)).collect();
        Ok(grid)
    }

    fn last_voxel(&self) -> Option<[i32; 3]> {
        let mut last = self.origin;
        for (coordinate, &count) in last.iter_mut().zip(&self.dims) {
            *coordinate =
                i32::try_from(i64::from(*coordinate).checked_add(i64::try_from(count).ok()? - 1)?).ok()?;
        }
        Some(last)
    }

    /// The leaf at `origin`, `None` if all its voxels have the background value.
    fn leaf(&self, origin: [i32; 3]) -> Option<Leaf<T>> {
        let mut leaf = Leaf::uniform(origin, self.background);
        for offset in 0..LEAF_VOXELS {
            let Some(value) = self.value(leaf.voxel(offset)) else { continue };
            if value != self.background {
                leaf.values[offset] = value;
                leaf.active[offset >> 6] |= 1 << (offset & 63);
            }
        }
        (leaf.active != [0; 8]).then_some(leaf)
    }

    fn value(&self, voxel: [i32; 3]) -> Option<T> {
        let mut index = 0;
        for ((coordinate, origin), &count) in voxel.into_iter().zip(self.origin).zip(&self.dims) {
            let local = usize::try_from(i64::from(coordinate) - i64::from(origin)).ok()?;
            index = (local < count).then_some(index * count + local)?;
        }
        self.values.get(index).copied()
    }
}

/// Origins of the leaves over a box.
fn leaf_origins(first: [i32; 3], last: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    // The first leaf's origin is at or below the box's, so stepping by eight meets every leaf once.
    let [xs, ys, zs] = std::array::from_fn(|axis| (first[axis] & !7..=last[axis]).step_by(8));
    xs.flat_map(move |x| {
        let zs = zs.clone();
        ys.clone().flat_map(move |y| zs.clone().map(move |z| [x, y, z]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_without_values_are_dropped() {
        let mut values = vec![0.0; 20 * 3 * 2];
        values[(17 * 3 + 1) * 2 + 1] = 4.0;
        let builder = GridBuilder::from_dense("d", [20, 3, 2], [-1, -2, 7], &values, DAffine3::IDENTITY);
        let grid = builder.build().expect("valid");
        assert_eq!(grid.leaves.len(), 1);
        assert_eq!((grid.active_voxel_count(), grid.value([16, -1, 8])), (1, 4.0));
    }

    #[test]
    fn background_voxels_are_inactive_and_nan_is_not_background() {
        let values = [2.0, f32::NAN, 0.0];
        let builder =
            GridBuilder::from_dense("d", [1, 1, 3], [0; 3], &values, DAffine3::IDENTITY).background(2.0);
        let grid = builder.build().expect("valid");
        assert!(!grid.is_active([0; 3]) && grid.is_active([0, 0, 1]) && grid.is_active([0, 0, 2]));
        assert_eq!(grid.value([5, 5, 5]), 2.0);
    }

    #[test]
    fn sizes_and_the_coordinate_range_are_checked() {
        let build = |dims, origin, n| {
            GridBuilder::from_dense("d", dims, origin, &vec![1.0; n], DAffine3::IDENTITY).build()
        };
        assert!(build([2, 2, 2], [0; 3], 7).is_err());
        assert!(build([usize::MAX, 2, 2], [0; 3], 4).is_err());
        assert!(build([1, 1, 2], [0, 0, i32::MAX], 2).is_err());
        assert_eq!(
            build([1, 1, 1], [i32::MAX; 3], 1).expect("valid").active_bounds(),
            Some(([i32::MAX; 3], [i32::MAX; 3]))
        );
        assert_eq!(build([0, 5, 5], [0; 3], 0).expect("valid").leaves.len(), 0);
    }
}

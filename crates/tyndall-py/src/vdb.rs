//! OpenVDB files from and for Python: what a file holds, and grids out.

use crate::error::{FileError, guarded};
use glam::{DAffine3, DVec3};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use tyndall_vdb::{FogGrid, GridBuilder, GridClass, VdbFile, WriteCompression, write_grids};

/// Writes one grid: `values` of shape (nx, ny, nz), float32, or (nx, ny, nz, 3) for colours; voxel (i, j, k) has its
/// centre at `origin + voxel_size * (i, j, k)`. Values equal to `background` (0 for colours) are inactive.
/// `level_set` says that they are signed distances.
#[pyfunction]
#[pyo3(signature = (path, name, values, voxel_size = 1.0, origin = (0.0, 0.0, 0.0), *, level_set = false, background = 0.0))]
#[allow(clippy::too_many_arguments, reason = "arguments by name in Python")]
pub(crate) fn write_vdb(
    py: Python<'_>,
    path: PathBuf,
    name: &str,
    values: PyReadonlyArrayDyn<'_, f32>,
    voxel_size: f64,
    origin: (f64, f64, f64),
    level_set: bool,
    background: f32,
) -> PyResult<()> {
    let shape = values.shape();
    let (&[nx, ny, nz] | &[nx, ny, nz, 3]) = shape else {
        return Err(FileError::new_err(format!(
            "values of shape {shape:?}; needed is (nx, ny, nz) or (nx, ny, nz, 3)"
        )));
    };
    let (dims, are_colors) = ([nx, ny, nz], shape.len() == 4);
    let numbers = values.as_slice().map_err(|_| FileError::new_err("values must be C-contiguous"))?;
    let translation = DAffine3::from_translation(DVec3::new(origin.0, origin.1, origin.2));
    let file_from_index = translation * DAffine3::from_scale(DVec3::splat(voxel_size));
    guarded(py, || {
        if are_colors {
            let colors = numbers.as_chunks::<3>().0;
            let grid = GridBuilder::from_dense(name, dims, [0; 3], colors, file_from_index).build()?;
            return write_grids(&path, &[FogGrid::from(&grid)], WriteCompression::Zip);
        }
        let builder = GridBuilder::from_dense(name, dims, [0; 3], numbers, file_from_index);
        let mut grid = builder.background(background).build()?;
        if level_set {
            grid.class = GridClass::LevelSet;
        }
        write_grids(&path, &[FogGrid::from(&grid)], WriteCompression::Zip)
    })?
    .map_err(|e| FileError::new_err(format!("{}: {e}", path.display())))
}

/// The grids of a file: name, index, type, class, and whether its transform is linear. No voxel is decoded.
#[pyfunction]
pub(crate) fn read_vdb_info(py: Python<'_>, path: PathBuf) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let file = guarded(py, || VdbFile::open(&path))?.map_err(|e| FileError::new_err(e.to_string()))?;
    file.grids()
        .iter()
        .map(|info| {
            let dict = PyDict::new(py);
            dict.set_item("name", &info.name)?;
            dict.set_item("index", info.index)?;
            dict.set_item("type", info.value_type.to_string())?;
            dict.set_item("class", format!("{:?}", info.class))?;
            dict.set_item("half", info.saved_as_half)?;
            dict.set_item("linear", info.file_from_index.is_some())?;
            Ok(dict)
        })
        .collect()
}

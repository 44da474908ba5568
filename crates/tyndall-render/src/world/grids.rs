//! Fields into brick grids.

use super::cache::GridSource;
use super::context::BuildContext;
use glam::{DAffine3, DVec3};
use std::sync::Arc;
use tyndall_scene::prim::{FieldSource, Prim};
use tyndall_scene::{Diagnostics, PrimPath};
use tyndall_vdb::Grid;
use tyndall_volume::{BrickGrid, GridReport, SparseVoxels};

/// A field ready for a medium.
pub(super) struct LoadedField {
    pub(super) grid: Arc<BrickGrid>,
    /// Index coordinates (voxel centres at integers) to the stage.
    pub(super) world_from_index: DAffine3,
}

/// Loads the field prim at `path` for the volume `user`. `None`, with a message, if that is not possible.
pub(super) fn load(user: &PrimPath, path: &PrimPath, context: &mut BuildContext) -> Option<LoadedField> {
    let Some(Prim::Field(field)) = context.scene.get(path) else {
        let what = format!("its field <{path}> does not exist");
        context.diagnostics.error(user, what, "the volume is not drawn; check the field relationship");
        return None;
    };
    let (built, file_from_index) = match &field.source {
        FieldSource::File { .. } => {
            let file = match context.assets.grid(&field.source) {
                Ok(file) => file,
                Err(error) => {
                    context.diagnostics.error(
                        path,
                        error.to_string(),
                        "the volume is drawn without this field",
                    );
                    return None;
                }
            };
            let file_from_index = file.file_from_index;
            let source = GridSource::File(file);
            (context.cache.grids.get_or_build(path.clone(), source, build), file_from_index)
        }
        FieldSource::Dense { dims, values, origin, voxel_size } => {
            if dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d)) != Some(values.len()) {
                let what = format!("{} values do not fill a grid of {dims:?}", values.len());
                context.diagnostics.error(path, what, "give one value a sample");
                return None;
            }
            let scale = DAffine3::from_scale(DVec3::splat(f64::from(*voxel_size)));
            let file_from_index = DAffine3::from_translation(origin.as_dvec3()) * scale;
            let source = GridSource::Dense(field.source.clone());
            (context.cache.grids.get_or_build(path.clone(), source, build), file_from_index)
        }
    };
    let (grid, found) = built.as_ref();
    report(path, found, &mut context.diagnostics);
    Some(LoadedField { grid: Arc::clone(grid), world_from_index: field.world_from_field * file_from_index })
}

fn build(source: &GridSource) -> (Arc<BrickGrid>, GridReport) {
    let (grid, found) = match source {
        GridSource::File(grid) => build_sparse(grid),
        GridSource::Dense(FieldSource::Dense { dims, values, .. }) => build_dense(*dims, values),
        GridSource::Dense(FieldSource::File { .. }) => BrickGrid::build(&SparseVoxels::default()),
    };
    (Arc::new(grid), found)
}

fn build_sparse(grid: &Grid) -> (BrickGrid, GridReport) {
    BrickGrid::build(&SparseVoxels {
        leaves: grid.leaves.iter().map(|leaf| (leaf.origin, leaf.values.as_slice())).collect(),
        tiles: grid.tiles.iter().map(|tile| (tile.origin, 1u32 << tile.size_log2, tile.value)).collect(),
        background: grid.background,
    })
}

/// Cuts a dense array (index `(i * ny + j) * nz + k`) into leaves.
fn build_dense(dims: [usize; 3], values: &[f32]) -> (BrickGrid, GridReport) {
    let n_leaves = dims.map(|d| d.div_ceil(8));
    let mut leaves = Vec::new();
    for lx in 0..n_leaves[0] {
        for ly in 0..n_leaves[1] {
            for lz in 0..n_leaves[2] {
                let origin = [lx * 8, ly * 8, lz * 8];
                leaves.push((origin.map(|o| o as i32), dense_leaf(dims, values, origin)));
            }
        }
    }
    BrickGrid::build(&SparseVoxels {
        leaves: leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect(),
        tiles: Vec::new(),
        background: 0.0,
    })
}

fn dense_leaf(dims: [usize; 3], values: &[f32], [x0, y0, z0]: [usize; 3]) -> Vec<f32> {
    let mut leaf = vec![0.0; 512];
    for x in x0..dims[0].min(x0 + 8) {
        for y in y0..dims[1].min(y0 + 8) {
            for z in z0..dims[2].min(z0 + 8) {
                leaf[(x - x0) << 6 | (y - y0) << 3 | (z - z0)] = values[(x * dims[1] + y) * dims[2] + z];
            }
        }
    }
    leaf
}

fn report(path: &PrimPath, found: &GridReport, diagnostics: &mut Diagnostics) {
    let not_finite = found.nan_count + found.inf_count;
    if not_finite > 0 {
        diagnostics.warn(path, format!("{not_finite} voxels are NaN or infinite"), "they are read as 0");
    }
    if found.negative_count > 0 {
        diagnostics.warn(path, format!("{} voxels are negative", found.negative_count), "they are read as 0");
    }
    if found.huge_count > 0 {
        let what = format!("{} voxels are too dense for f32 arithmetic", found.huge_count);
        diagnostics.warn(path, what, "they are cut to the largest usable density");
    }
    if found.dropped_count > 0 {
        let what =
            format!("{} leaves or tiles lie outside the index range or are damaged", found.dropped_count);
        diagnostics.warn(path, what, "they are left out");
    }
    if found.nonzero_background {
        diagnostics.warn(path, "the grid's background is not 0", "outside its active voxels it is read as 0");
    }
}

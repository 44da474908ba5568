//! Fields into brick grids.
//!
//! A level set (OpenVDB's class) stands for what is inside: density 1 there, 0 outside, over one voxel across the
//! surface. Whoever binds one as a density wants to fill the shape. Read as densities, its distances would be a thin
//! shell around it; OpenVDB's own conversion (`sdfToFogVolume`) also fills the inside, but thins it out over the whole
//! narrow band, three voxels as a rule, so that the width of the band would be seen.

use super::cache::{BuiltGrid, GridSource};
use super::context::BuildContext;
use glam::{DAffine3, DVec3};
use std::sync::Arc;
use tyndall_scene::prim::{Field, FieldSource, Prim};
use tyndall_scene::{Diagnostics, FieldGrid, PrimPath};
use tyndall_vdb::{Grid, GridClass};
use tyndall_volume::{BrickGrid, ColorGrid, GridReport, SparseVoxels};

/// A field ready for a medium, as a [`BrickGrid`] or a [`ColorGrid`].
pub(super) struct LoadedField<G> {
    pub(super) grid: Arc<G>,
    /// Index coordinates (voxel centres at integers) to the stage.
    pub(super) world_from_index: DAffine3,
}

/// Whether the field prim at `path` holds vectors. If it cannot be read, loading it says so.
pub(super) fn holds_colors(path: &PrimPath, context: &BuildContext) -> bool {
    let Some(Prim::Field(field)) = context.scene.get(path) else { return false };
    let is_file = matches!(field.source, FieldSource::File { .. });
    is_file && context.assets.grid(&field.source).is_ok_and(|grid| matches!(*grid, FieldGrid::Vector(_)))
}

/// Loads the field prim at `path` for the volume `user` as a density; that of colours is their largest component.
/// `None`, with a message, if that is not possible.
pub(super) fn load_density(
    user: &PrimPath,
    path: &PrimPath,
    context: &mut BuildContext,
) -> Option<LoadedField<BrickGrid>> {
    let (field, source, file_from_index) = open(user, path, context)?;
    let built = context.cache.grids.get_or_build(path.clone(), source, build_density);
    report(path, &built.report, &mut context.diagnostics);
    if built.is_guess {
        let what = "its values look like signed distances, but the file does not call it a level set";
        let action = "its inside is drawn; set the grid's class to \"level set\" or \"fog volume\"";
        context.diagnostics.warn(path, what, action);
    }
    Some(LoadedField {
        grid: Arc::clone(&built.grid),
        world_from_index: field.world_from_field * file_from_index,
    })
}

/// The same as colours; numbers are grey.
pub(super) fn load_colors(
    user: &PrimPath,
    path: &PrimPath,
    context: &mut BuildContext,
) -> Option<LoadedField<ColorGrid>> {
    let (field, source, file_from_index) = open(user, path, context)?;
    let built = context.cache.colors.get_or_build(path.clone(), source, build_colors);
    let (grid, found) = built.as_ref();
    report(path, found, &mut context.diagnostics);
    Some(LoadedField { grid: Arc::clone(grid), world_from_index: field.world_from_field * file_from_index })
}

/// The field prim at `path`, its numbers, and where the file places them.
fn open(
    user: &PrimPath,
    path: &PrimPath,
    context: &mut BuildContext,
) -> Option<(Arc<Field>, GridSource, DAffine3)> {
    let Some(Prim::Field(field)) = context.scene.get(path) else {
        let what = format!("its field <{path}> does not exist");
        context.diagnostics.error(user, what, "the volume is not drawn; check the field relationship");
        return None;
    };
    let field = Arc::clone(field);
    match &field.source {
        FieldSource::File { .. } => match context.assets.grid(&field.source) {
            Ok(file) => {
                let file_from_index = file.file_from_index();
                Some((field, GridSource::File(file), file_from_index))
            }
            Err(error) => {
                let action = "the volume is drawn without this field";
                context.diagnostics.error(path, error.to_string(), action);
                None
            }
        },
        FieldSource::Dense { dims, values, origin, voxel_size } => {
            if dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d)) != Some(values.len()) {
                let what = format!("{} values do not fill a grid of {dims:?}", values.len());
                context.diagnostics.error(path, what, "give one value a sample");
                return None;
            }
            let scale = DAffine3::from_scale(DVec3::splat(f64::from(*voxel_size)));
            let file_from_index = DAffine3::from_translation(origin.as_dvec3()) * scale;
            let source = GridSource::Dense(field.source.clone());
            Some((field, source, file_from_index))
        }
    }
}

fn build_density(source: &GridSource) -> BuiltGrid {
    let mut is_guess = false;
    let (grid, report) = match source {
        GridSource::File(file) => match &**file {
            FieldGrid::Scalar(grid) => {
                is_guess = looks_like_distances(grid);
                match is_guess || grid.class == GridClass::LevelSet {
                    true => BrickGrid::build_interior(&sparse(grid), voxel_size(grid)),
                    false => BrickGrid::build(&sparse(grid)),
                }
            }
            FieldGrid::Vector(grid) => BrickGrid::build(&sparse(&grid.clone().map(largest))),
        },
        GridSource::Dense(FieldSource::Dense { dims, values, .. }) => build_dense(*dims, values),
        GridSource::Dense(FieldSource::File { .. }) => BrickGrid::build(&SparseVoxels::default()),
    };
    BuiltGrid { grid: Arc::new(grid), report, is_guess }
}

fn build_colors(source: &GridSource) -> (Arc<ColorGrid>, GridReport) {
    let (grid, found) = match source {
        GridSource::File(file) => match &**file {
            FieldGrid::Scalar(grid) => ColorGrid::build(&sparse(&grey(grid))),
            FieldGrid::Vector(grid) => ColorGrid::build(&sparse(grid)),
        },
        GridSource::Dense(FieldSource::Dense { dims, values, .. }) => {
            let leaves: Vec<_> = dense_leaves(*dims, values)
                .into_iter()
                .map(|(origin, values)| (origin, values.into_iter().map(|x| [x; 3]).collect::<Vec<_>>()))
                .collect();
            let leaves = leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
            ColorGrid::build(&SparseVoxels { leaves, tiles: Vec::new(), background: [0.0; 3] })
        }
        GridSource::Dense(FieldSource::File { .. }) => ColorGrid::build(&SparseVoxels::default()),
    };
    (Arc::new(grid), found)
}

fn sparse<T: tyndall_vdb::Value>(grid: &Grid<T>) -> SparseVoxels<'_, T> {
    SparseVoxels {
        leaves: grid.leaves.iter().map(|leaf| (leaf.origin, leaf.values.as_slice())).collect(),
        tiles: grid.tiles.iter().map(|tile| (tile.origin, 1u32 << tile.size_log2, tile.value)).collect(),
        background: grid.background,
    }
}

fn largest([r, g, b]: [f32; 3]) -> f32 {
    r.max(g).max(b)
}

/// Numbers as colours; a level set is 1 inside.
fn grey(grid: &Grid) -> Grid<[f32; 3]> {
    if grid.class == GridClass::LevelSet || looks_like_distances(grid) {
        let per_voxel = voxel_size(grid).recip();
        return grid.clone().map(|distance| [(0.5 - distance * per_voxel).clamp(0.0, 1.0); 3]);
    }
    grid.clone().map(|value| [value; 3])
}

/// Edge of a cube as large as a voxel, in the unit of a level set's distances.
fn voxel_size(grid: &Grid) -> f32 {
    grid.file_from_index.matrix3.determinant().abs().cbrt() as f32
}

/// Whether a grid of unknown class has the marks of a narrow-band level set: a positive background, which is the
/// greatest distance on both sides, and both signs.
fn looks_like_distances(grid: &Grid) -> bool {
    let most = grid.background;
    if grid.class != GridClass::Unknown || most <= 0.0 || !most.is_finite() {
        return false;
    }
    let values = || {
        let of_leaves = grid.leaves.iter().flat_map(|leaf| leaf.values.iter().copied());
        of_leaves.chain(grid.tiles.iter().map(|tile| tile.value))
    };
    values().all(|value| value.abs() <= most) && values().any(|value| value < 0.0)
}

fn build_dense(dims: [usize; 3], values: &[f32]) -> (BrickGrid, GridReport) {
    let leaves = dense_leaves(dims, values);
    let leaves = leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
    BrickGrid::build(&SparseVoxels { leaves, tiles: Vec::new(), background: 0.0 })
}

/// Cuts a dense array (index `(i * ny + j) * nz + k`) into leaves.
fn dense_leaves(dims: [usize; 3], values: &[f32]) -> Vec<([i32; 3], Vec<f32>)> {
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
    leaves
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

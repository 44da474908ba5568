//! Media: volumes and their fields.

use crate::PrimPath;
use glam::{DAffine3, Vec3};
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

/// A medium that is filled from fields, or that fills all space if it has none.
///
/// Homogeneous media inside closed shapes are not volumes: they are meshes or shapes whose material has a volume
/// terminal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Volume {
    /// The relationship's name (what shaders ask for) and the field prim.
    pub fields: Vec<(String, PrimPath)>,
    /// Bound material; without one, extinction = the field `density` (or the first) with a grey albedo.
    pub material: Option<PrimPath>,
    /// Places the volume for its own primvars; the fields carry their own transform.
    pub world_from_object: DAffine3,
    /// Set if this prim is a prototype; the fields then are placed relative to the instance.
    pub instancer: Option<PrimPath>,
    /// Shown or hidden.
    pub visible: bool,
}

/// A grid of a volume.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Field {
    /// Applied after the file's own transform: `world_from_index = world_from_field * file_from_index`.
    pub world_from_field: DAffine3,
    /// Where the numbers are.
    pub source: FieldSource,
}

/// Where the numbers of a field are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum FieldSource {
    /// A grid in an OpenVDB file.
    File {
        /// The file.
        path: PathBuf,
        /// Grid name.
        name: String,
        /// Which of several grids of that name.
        index: Option<usize>,
    },
    /// Numbers in memory.
    Dense {
        /// Samples along x, y, z.
        dims: [usize; 3],
        /// Sample (i, j, k) at `(i * dims[1] + j) * dims[2] + k`; zero outside.
        values: Arc<Vec<f32>>,
        /// Position of sample (0, 0, 0).
        origin: Vec3,
        /// Distance between samples.
        voxel_size: f32,
    },
}

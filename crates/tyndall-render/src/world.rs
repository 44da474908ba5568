//! The committed world: a scene made ready for rays.
//!
//! Everything is in *camera-relative* space: the camera's position is subtracted in f64 before anything becomes f32, so
//! a shot a million units from the stage's origin is as precise as one at it.
//! A world is immutable. What is expensive to build (triangles and their trees, brick grids) is kept in a
//! [`WorldCache`] and reused by the next commit when its content is the same, so an edit rebuilds only what it touches
//! and the picture always equals that of a world built from nothing.

mod bake;
mod bodies;
mod build;
mod cache;
mod clipping;
mod context;
mod grids;
mod materials;
mod media;
mod merged;
mod place;
mod placements;
mod query;
mod shade;
mod surface_mesh;
mod surfaces;

pub use build::WorldError;
pub use cache::WorldCache;
pub(crate) use query::{SegmentEnd, SurfaceHit, WorldScratch};
pub(crate) use shade::{ShadingBuffer, Surface};

use crate::aov::cryptomatte::{self, Matte};
use crate::camera::CameraModel;
use bodies::LightBodies;
pub(crate) use bodies::Unseen;
use glam::DVec3;
use media::Media;
use surfaces::Surfaces;
use tyndall_scene::{Diagnostics, PrimPath};
use tyndall_shading::{CompiledMaterial, LightSet};

/// A scene made ready for rays.
pub struct World {
    /// The camera's position on the stage.
    origin: DVec3,
    camera: CameraModel,
    surfaces: Surfaces,
    materials: Vec<CompiledMaterial>,
    material_names: Vec<MatteName>,
    media: Media,
    lights: LightSet,
    /// Indices of lights at infinity.
    infinite_lights: Vec<usize>,
    bodies: LightBodies,
    diagnostics: Diagnostics,
}

/// A name in a cryptomatte.
struct MatteName {
    id: u32,
    path: Option<PrimPath>,
}

impl MatteName {
    fn new(path: Option<PrimPath>) -> Self {
        Self { id: cryptomatte::id(matte_name(path.as_ref())), path }
    }
}

/// The path without its first slash; `default` stands for prims without a material.
fn matte_name(path: Option<&PrimPath>) -> &str {
    path.map_or("default", |path| path.as_str().trim_start_matches('/'))
}

impl World {
    /// Names of all that a cryptomatte may show.
    pub(crate) fn matte_names(&self, matte: Matte) -> Vec<String> {
        let of = |path: Option<&PrimPath>| matte_name(path).to_owned();
        match matte {
            Matte::Object => self.surfaces.paths().map(|path| of(Some(path))).collect(),
            Matte::Material => self.material_names.iter().map(|name| of(name.path.as_ref())).collect(),
        }
    }

    /// The stage's point that is the origin of camera-relative space.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The camera.
    pub(crate) fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// Whether anything moves while the shutter is open, the camera included.
    pub(crate) fn moves(&self) -> bool {
        self.camera.moves() || self.surfaces.accel().moves()
    }

    /// The lights.
    pub(crate) fn lights(&self) -> &LightSet {
        &self.lights
    }

    /// Lights that a ray meets where nothing else is.
    pub(crate) fn infinite_lights(&self) -> &[usize] {
        &self.infinite_lights
    }

    /// Whether any medium exists; scenes without compile the media out of their paths.
    pub(crate) fn has_media(&self) -> bool {
        !cfg!(feature = "without-media") && !self.media.is_empty()
    }

    /// Whether some medium is so dense that vertices in it are needed finer than f32.
    pub(crate) fn has_dense_media(&self) -> bool {
        self.media.is_dense()
    }

    /// The media, in the order of their boundaries.
    pub(crate) fn media(&self) -> &[tyndall_volume::Medium] {
        self.media.list()
    }

    /// Messages of the front end and of building.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }

    /// Sizes for statistics: counts and bytes.
    pub fn summary(&self) -> WorldSummary {
        WorldSummary {
            surface_instances: self.surfaces.instance_count(),
            triangles: self.surfaces.triangle_count(),
            media: self.media.list().len(),
            lights: self.lights.lights.len(),
            materials: self.materials.len(),
            geometry_bytes: self.surfaces.memory_bytes(),
            grid_bytes: self.media.memory_bytes(),
        }
    }
}

/// Sizes of a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "camelCase")]
pub struct WorldSummary {
    /// Placed surfaces.
    pub surface_instances: usize,
    /// Triangles, each mesh counted once however often it is placed.
    pub triangles: usize,
    /// Media.
    pub media: usize,
    /// Lights.
    pub lights: usize,
    /// Materials.
    pub materials: usize,
    /// Bytes of meshes and their trees.
    pub geometry_bytes: usize,
    /// Bytes of brick grids.
    pub grid_bytes: usize,
}

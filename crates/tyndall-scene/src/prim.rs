//! The kinds of prim a delegate receives.

mod camera;
mod geometry;
mod instancer;
mod light;
mod material;
mod motion;
mod volume;

pub use camera::{Camera, Projection};
pub use geometry::{Interpolation, Mesh, Primvar, Shape, ShapeKind, Subdivision, SubdivisionScheme, Subset};
pub use instancer::Instancer;
pub use light::{ConeProfile, DomeTexture, Light, LightKind, Shaping};
pub use material::{Material, NodeInput, ShadingNode};
pub use motion::{InstancerKey, TransformKey};
pub use volume::{Field, FieldSource, Volume};

use crate::RenderSettings;
use serde::Serialize;
use std::sync::Arc;

/// A prim of any kind. Cheap to clone: the content is shared.
#[derive(Debug, Clone, Serialize)]
pub enum Prim {
    /// A polygon mesh.
    Mesh(Arc<Mesh>),
    /// An implicit shape.
    Shape(Arc<Shape>),
    /// Many placements of the prims that name it.
    Instancer(Arc<Instancer>),
    /// A medium filled from fields, or filling all space.
    Volume(Arc<Volume>),
    /// A grid of a volume.
    Field(Arc<Field>),
    /// A light.
    Light(Arc<Light>),
    /// A material: a shading graph.
    Material(Arc<Material>),
    /// A camera.
    Camera(Arc<Camera>),
    /// Render settings.
    RenderSettings(Arc<RenderSettings>),
}

impl Prim {
    /// The kind's name.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Mesh(_) => "mesh",
            Self::Shape(_) => "shape",
            Self::Instancer(_) => "instancer",
            Self::Volume(_) => "volume",
            Self::Field(_) => "field",
            Self::Light(_) => "light",
            Self::Material(_) => "material",
            Self::Camera(_) => "camera",
            Self::RenderSettings(_) => "render_settings",
        }
    }
}

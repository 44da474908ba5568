//! Materials, textures, the shading graph, and lights.
//!
//! - [`Light`] and [`LightSet`]: what shines, in UsdLux units, and which light to ask next.
//! - [`Bsdf`]: how a surface scatters at one hit; a value without heap memory.
//! - [`CompiledMaterial`]: a shading graph turned into a short program that gives the [`Bsdf`] of a hit, or the
//!   coefficients of a medium.
//!
//! Directions `wo` (towards the viewer) and `wi` (towards the light) are unit vectors in world space that point away
//! from the surface. Colours are linear Rec.709. Nothing here traces a ray or opens a file.

pub mod graph;
mod kind;
pub mod light;
pub mod material;
mod procedural;
pub mod texture;

#[cfg(test)]
mod testing;

pub use graph::{
    CompiledMaterial, EmissionSource, EmissionTerm, NODE_KINDS, PhaseModel, PointCoefficients,
    ShadingContext, Space, SurfaceShading, VolumeMaterial, VolumeProgram, VolumeTint,
};
pub use kind::{KindSpec, ParamDefault, ParamSpec};
pub use light::{Light, LightSample, LightSet, Receiver};
pub use material::{Bsdf, BsdfSample, BsdfValue, Lobe, ShadingFrame, Spread};

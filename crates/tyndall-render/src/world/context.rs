//! What the steps of a build share.

use super::cache::WorldCache;
use super::placements::Placements;
use glam::DVec3;
use tyndall_scene::{AssetLoader, Diagnostics, Scene};

/// What every part of the build needs.
pub(super) struct BuildContext<'a> {
    pub(super) scene: &'a Scene,
    pub(super) assets: &'a dyn AssetLoader,
    pub(super) cache: &'a mut WorldCache,
    pub(super) placements: Placements<'a>,
    /// The camera's position on the stage: the origin of the world.
    pub(super) origin: DVec3,
    /// Most voxels along an axis of a procedural medium.
    pub(super) procedural_resolution: u32,
    pub(super) diagnostics: Diagnostics,
}

//! Implicit shapes as triangles.

use super::TriangleMesh;
use tyndall_scene::prim::ShapeKind;

impl TriangleMesh {
    /// placeholder
    pub fn from_shape(_kind: &ShapeKind) -> Self {
        Self::default()
    }
}

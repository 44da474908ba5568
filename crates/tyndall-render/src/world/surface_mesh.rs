//! A surface in object space: a mesh or a shape, and the structure that rays search.

use glam::{DAffine3, DVec3};
use std::sync::Arc;
use tyndall_geometry::{Blas, TriangleMesh};
use tyndall_scene::prim::{Mesh, Shape, ShapeKind};
use tyndall_scene::{Diagnostics, PrimPath};

/// What a surface is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShapeOfSurface {
    Triangles,
    Cube,
    Sphere,
}

/// A surface in object space, shared by all its placements.
pub(super) struct SurfaceMesh {
    blas: Arc<Blas>,
    /// `None` for the analytic sphere.
    triangles: Option<TriangleMesh>,
    shape: ShapeOfSurface,
    object_from_unit: DAffine3,
    /// Messages of its making, repeated at every build that uses it.
    pub(super) diagnostics: Diagnostics,
}

impl SurfaceMesh {
    pub(super) fn of_mesh(path: &PrimPath, mesh: &Mesh) -> Self {
        let mut diagnostics = Diagnostics::default();
        let triangles = TriangleMesh::from_prim(path, mesh, &mut diagnostics);
        Self::of_triangles(triangles, ShapeOfSurface::Triangles, DAffine3::IDENTITY, diagnostics)
    }

    pub(super) fn of_shape(shape: &Shape) -> Self {
        match shape.kind {
            ShapeKind::Sphere { radius } => Self {
                blas: Arc::new(Blas::unit_sphere()),
                triangles: None,
                shape: ShapeOfSurface::Sphere,
                object_from_unit: DAffine3::from_scale(DVec3::splat(radius)),
                diagnostics: Diagnostics::default(),
            },
            kind => {
                let (shape, unit) = match kind {
                    ShapeKind::Cube { size } => {
                        (ShapeOfSurface::Cube, DAffine3::from_scale(DVec3::splat(0.5 * size)))
                    }
                    _ => (ShapeOfSurface::Triangles, DAffine3::IDENTITY),
                };
                Self::of_triangles(TriangleMesh::from_shape(&kind), shape, unit, Diagnostics::default())
            }
        }
    }

    fn of_triangles(
        triangles: TriangleMesh,
        shape: ShapeOfSurface,
        object_from_unit: DAffine3,
        diagnostics: Diagnostics,
    ) -> Self {
        let blas = Arc::new(Blas::from_triangles(&triangles.positions, &triangles.indices));
        Self { blas, triangles: Some(triangles), shape, object_from_unit, diagnostics }
    }

    pub(super) fn blas(&self) -> &Arc<Blas> {
        &self.blas
    }

    pub(super) fn shape(&self) -> ShapeOfSurface {
        self.shape
    }

    /// `None` for the analytic sphere.
    pub(super) fn triangles(&self) -> Option<&TriangleMesh> {
        self.triangles.as_ref()
    }

    /// Object-space point that the stored positions are relative to.
    pub(super) fn center(&self) -> DVec3 {
        self.triangles.as_ref().map_or(DVec3::ZERO, |t| t.center)
    }

    /// Places the cube [-1, 1]^3 or the unit sphere; identity for triangles.
    pub(super) fn object_from_unit(&self) -> DAffine3 {
        self.object_from_unit
    }

    /// Places the stored positions (before [`Self::center`] is added).
    pub(super) fn object_from_blas(&self) -> DAffine3 {
        if self.shape == ShapeOfSurface::Sphere { self.object_from_unit } else { DAffine3::IDENTITY }
    }

    /// Its box in object space.
    pub(super) fn object_bounds(&self) -> [DVec3; 2] {
        let (min, max) = self.blas.bounds();
        let object = self.object_from_blas();
        [min, max].map(|p| object.transform_point3(p.as_dvec3()) + self.center())
    }

    /// Whether it has an inside.
    pub(super) fn is_closed(&self) -> bool {
        self.triangles.as_ref().is_none_or(TriangleMesh::is_closed)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.triangles.as_ref().is_some_and(|t| t.indices.is_empty())
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.blas.memory_bytes() + self.triangles.as_ref().map_or(0, bytes_of)
    }
}

fn bytes_of(triangles: &TriangleMesh) -> usize {
    size_of_val(triangles.positions.as_slice())
        + size_of_val(triangles.indices.as_slice())
        + size_of_val(triangles.face.as_slice())
        + size_of_val(triangles.corner.as_slice())
        + size_of_val(triangles.subset.as_slice())
        + triangles.normals.as_ref().map_or(0, |n| size_of_val(n.as_slice()))
}

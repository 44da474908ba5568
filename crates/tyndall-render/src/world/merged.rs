//! Small surfaces merged into one list of triangles in camera-relative space.
//!
//! A ray pays for every instance whose box it enters: a transform and a tree of its own. Shots are full of small prims
//! (walls, planks, a few hundred leaves), so those are flattened, in f64, into one object without a transform; large
//! meshes and large sets of instances stay instanced and keep their memory shared.

use glam::{Affine3A, DAffine3, Vec3};
use std::sync::Arc;
use tyndall_geometry::{Blas, Instance, TriangleMesh};

/// Triangles that one prim may add, all its placements counted.
const MAX_OF_PRIM: usize = 1 << 16;
/// Triangles in all. At some 130 bytes each this bounds the memory, and the rebuild when the camera moves.
const MAX_IN_ALL: usize = 1 << 17;

/// The merged triangles.
#[derive(Default)]
pub(super) struct Merged {
    positions: Vec<Vec3>,
    indices: Vec<[u32; 3]>,
    /// First triangle of each merged placement; ascending.
    first_triangle: Vec<u32>,
    /// The placement of each triangle.
    placement: Vec<u32>,
}

impl Merged {
    pub(super) fn has_room_for(&self, triangles: usize) -> bool {
        triangles <= MAX_OF_PRIM && self.indices.len() + triangles <= MAX_IN_ALL
    }

    pub(super) fn is_empty(&self) -> bool {
        self.placement.is_empty()
    }

    /// Adds one placement of a mesh; they are numbered in the order they come. It must not mirror: that would turn the
    /// triangles' outer sides in.
    pub(super) fn add(&mut self, mesh: &TriangleMesh, world_from_stored: DAffine3) {
        let placement = self.first_triangle.len() as u32;
        let first_position = self.positions.len() as u32;
        self.first_triangle.push(self.indices.len() as u32);
        self.positions.extend(
            mesh.positions.iter().map(|p| world_from_stored.transform_point3(p.as_dvec3()).as_vec3()),
        );
        self.indices.extend(mesh.indices.iter().map(|corners| corners.map(|i| i + first_position)));
        self.placement.resize(self.indices.len(), placement);
    }

    /// Placement and triangle of its mesh of merged triangle `primitive`.
    #[inline]
    pub(super) fn resolve(&self, primitive: u32) -> (usize, u32) {
        let placement = self.placement[primitive as usize] as usize;
        (placement, primitive - self.first_triangle[placement])
    }

    /// The instance that holds them, unless there are none. Positions and indices are given up: the tree has its own.
    pub(super) fn build(&mut self) -> Option<Instance> {
        let (positions, indices) = (std::mem::take(&mut self.positions), std::mem::take(&mut self.indices));
        (!indices.is_empty()).then(|| Instance {
            blas: Arc::new(Blas::from_triangles(&positions, &indices)),
            world_from_object: Affine3A::IDENTITY,
            motion: Vec::new(),
        })
    }
}

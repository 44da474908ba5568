//! Meshes, instances and their watertight intersection.
//!
//! Two halves. [`TriangleMesh`] turns prim data (n-gons, holes, subsets, subdivision, implicit shapes) into clean
//! triangles. [`Accel`] finds what a ray meets among [`Instance`]s of [`Blas`]es, and [`Boundaries`] finds the parts
//! of a ray inside closed boundaries, which is how the renderer knows the media at any point without carrying state.
//!
//! Invariants:
//! - closed meshes don't leak (Woop, Benthin, Wald 2013), at any scale and distance from the origin;
//! - there is no near distance: every hit with `0 <= t <= t_max` counts;
//! - hits don't depend on the tree, the traversal order or the CPU: equal distances go to the lower
//!   (instance, primitive), and the wide kernel repeats the portable one bit for bit;
//! - nothing allocates per ray.
//!
//! "World" here is the camera-relative world: the camera's position is subtracted in f64 before anything is f32.

mod accel;
mod blas;
mod boundary;
mod boxes;
mod bvh;
mod mesh;
mod subdivision;
mod surface;

pub use accel::{Accel, Crossing, Hit, Instance, InstanceKey};
pub use blas::Blas;
pub use boundary::{Boundaries, BoundaryShape, SpanScratch, inside_intervals};
pub use boxes::BoxTree;
pub use bvh::SimdLevel;
pub use mesh::TriangleMesh;
pub use surface::SurfacePoint;

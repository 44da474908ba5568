//! Bounding volume hierarchies: built by `obvhs` (PLOC with reinsertion), stored eight children wide, walked here.
//!
//! The same tree serves triangles, instances and boundaries; [`walk`] hands its leaves to a [`Visit`]or.

mod build;
mod groups;
mod kernel;
mod kernel_avx2;
mod kernel_portable;
mod node;
mod triangle;
mod walk;

pub use kernel::SimdLevel;

pub(crate) use build::{Leaves, WideBvh, build};
pub(crate) use kernel::{BoxRay, Kernel, KernelTask, is_traceable, run};
pub(crate) use node::Bounds;
pub(crate) use triangle::{Block, LANES, Shear, crossing_sides};
pub(crate) use walk::{Visit, walk};

//! OpenVDB bytes into typed sparse grids and back; never panics on any input.
//!
//! A VDB file holds named grids; a grid is a shallow tree (root, 32³ nodes, 16³ nodes, 8³ leaves) plus an affine
//! map from voxel indices to the file's world space. This crate flattens the tree into [`Grid::leaves`] and
//! [`Grid::tiles`]; the renderer builds its own acceleration structure from them.
//!
//! Source: Museth 2013, "VDB: High-Resolution Sparse Volumes with Dynamic Topology", doi:10.1145/2487228.2487235,
//! and the file format as OpenVDB 1.1 to 12 reads and writes it (file versions 218 to 225).
//!
//! | module | what |
//! |---|---|
//! | [`file`](VdbFile) | header, list of grids, lazy decoding of one grid |
//! | `tree` | the two passes over a tree: topology, then leaf buffers |
//! | `codec` | node blocks: mask compression, half floats, zip, Blosc |
//! | `write` | fog volumes out |
//!
//! Invariants
//! - Every length in a file is checked against the bytes that are left before anything is allocated; memory stays
//!   below a constant times the file size. No recursion, no `unsafe`, no panic.
//! - Grids are decoded one at a time: a grid of an unsupported kind doesn't hide the others.
//! - Results don't depend on the number of threads (which of several errors is reported may).
//!
//! ```no_run
//! let file = tyndall_vdb::VdbFile::open("smoke.vdb".as_ref())?;
//! let density = file.read_grid("density", None)?;
//! println!("{} active voxels", density.active_voxel_count());
//! # Ok::<(), tyndall_vdb::VdbError>(())
//! ```

mod codec;
mod cursor;
mod descriptor;
mod error;
mod file;
mod grid;
mod header;
mod mask;
mod metadata;
mod transform;
mod tree;
mod value;
mod write;

pub use descriptor::GridInfo;
pub use error::VdbError;
pub use file::VdbFile;
pub use grid::{Grid, GridClass, LEAF_VOXELS, Leaf, Tile};
pub use metadata::MetaValue;
pub use value::{Scalar, Value, ValueType};
pub use write::{GridBuilder, WriteCompression, write_fog};

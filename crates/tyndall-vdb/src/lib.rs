//! OpenVDB and NanoVDB bytes into typed sparse grids, and OpenVDB bytes back; never panics on any input.
//!
//! A VDB file holds named grids; a grid is a shallow tree (root, 32³ nodes, 16³ nodes, 8³ leaves) plus an affine
//! map from voxel indices to the file's world space. This crate flattens the tree into [`Grid::leaves`] and
//! [`Grid::tiles`]; the renderer builds its own acceleration structure from them.
//!
//! Source: Museth 2013, "VDB: High-Resolution Sparse Volumes with Dynamic Topology", doi:10.1145/2487228.2487235,
//! and the file formats as OpenVDB 1.1 to 13 reads and writes them (file versions 218 to 225, NanoVDB 32).
//!
//! | module | what |
//! |---|---|
//! | [`file`](VdbFile) | what is in a file; lazy decoding of one grid |
//! | `source` | positioned reads: a grid that nobody asks for is never read |
//! | `archive` | OpenVDB files: header, list of grids, one grid |
//! | `tree` | the two passes over a tree: topology, then leaf buffers |
//! | `codec` | node blocks: mask compression, half floats, zip, Blosc |
//! | `nvdb` | NanoVDB files |
//! | `write` | fog volumes out |
//!
//! | read | not read, and said so by name |
//! |---|---|
//! | `float`, `double`, `half`, `int32`, `int64`, `bool`, `mask`, `vec3s`, `vec3d`, `vec3i`; NanoVDB's `Fp4`, `Fp8`, `Fp16`, `FpN` as floats | points, index grids, other types |
//! | trees of shape 5-4-3; grids that share a tree; grids of the same name | other shapes |
//! | every linear map | frustums |
//! | files with a table of offsets, and stream files | big-endian files |
//! | values as they are, zipped, or packed by Blosc with LZ4; with and without active masks; saved as half | other Blosc codecs |
//!
//! Invariants
//! - Every length in a file is checked against the bytes that are left before anything is allocated; memory stays
//!   below a constant times the file size. No unbounded recursion, no `unsafe`, no panic: `fuzz/` looks for them.
//! - Grids are decoded one at a time: a grid of an unsupported kind doesn't hide the others.
//! - Results don't depend on the number of threads (which of several errors is reported may).
//!
//! ```no_run
//! let file = tyndall_vdb::VdbFile::open("smoke.vdb".as_ref())?;
//! let density = file.read_grid("density", None)?;
//! println!("{} active voxels", density.active_voxel_count());
//! # Ok::<(), tyndall_vdb::VdbError>(())
//! ```

mod archive;
mod codec;
mod cursor;
mod descriptor;
mod error;
mod file;
mod grid;
mod header;
mod mask;
mod metadata;
mod nvdb;
mod source;
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
pub use write::{FogGrid, GridBuilder, WriteCompression, write_fog, write_grids};

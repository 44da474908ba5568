//! Image, texture and grid files in; EXR and PNG out.
//!
//! The only crate of the render core that opens files. Nothing here knows light transport; what a number in a file
//! means is decided at this boundary, so that everything above sees linear f32 numbers.
//!
//! | module | what |
//! |---|---|
//! | `exr` | multi-layer OpenEXR in and out |
//! | `png` | 8-bit previews through a [`ViewTransform`] |
//! | `image` | textures of any supported format as [`tyndall_scene::ImageData`] |
//! | `assets` | [`FileAssets`], the caching loader of a committed scene |
//! | `exclusive` | the same for files that several processes share |
//! | `atomic` | [`write_atomically`]: a complete new file or the untouched old one |
//! | `bytes` | [`read_bytes`]: files of a format that another crate knows |
//!
//! Invariants
//! - Files come from strangers: damaged, truncated or hostile input gives an [`IoError`] naming the file. Memory is
//!   bounded by a multiple of the file's size before it is allocated.
//! - An output file is either complete or not there: writing goes to a temporary file beside it, then a rename.

mod assets;
mod atomic;
mod bytes;
mod error;
mod exclusive;
mod exr;
mod image;
mod limits;
mod meta;
mod png;

pub use assets::FileAssets;
pub use atomic::write_atomically;
pub use bytes::read_bytes;
pub use error::IoError;
pub use exclusive::{read_if_present, replace_exclusively};
pub use exr::{ExrCompression, ExrImage, Layer, SampleType, read_exr, write_exr};
pub use image::{SUPPORTED_TEXTURES, load_image};
pub use meta::MetaValue;
pub use png::{ViewTransform, write_png};

//! OpenEXR in and out.
//!
//! Layers are named the way every compositor reads them: one part, channels `layer.channel`, the main layer bare
//! (OpenEXR technical introduction, "Layers"). Source: <https://openexr.com/en/latest/TechnicalIntroduction.html>.

mod read;
mod write;

pub use read::{ExrImage, read_exr};
pub use write::{ExrCompression, Layer, SampleType, write_exr};

//! Textures: any supported image file as linear RGBA.

mod load;

pub use load::{SUPPORTED_TEXTURES, load_image};

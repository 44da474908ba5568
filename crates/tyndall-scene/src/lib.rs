//! The shot as plain data: prims as a delegate receives them, dirty bits, validation, diagnostics.
//!
//! Front ends (USD, Blender, glTF) call [`RenderDelegate::sync`] for every prim and [`RenderDelegate::commit`] for an
//! immutable [`Scene`]. Nothing here knows a renderer, and nothing here opens a file: grids and images are named by
//! [`prim::FieldSource`] and paths, and loaded through an [`AssetLoader`].
//!
//! Units are the stage's and are never rescaled; transforms are f64 and named `world_from_object`.

mod asset;
mod delegate;
mod diagnostic;
mod dirty;
mod fingerprint;
mod path;
pub mod prim;
mod settings;

pub use asset::{AssetError, AssetLoader, ColorSpace, FieldGrid, ImageData};
pub use delegate::{RenderDelegate, Scene};
pub use diagnostic::{Diagnostic, Diagnostics, Severity};
pub use dirty::DirtyBits;
pub use fingerprint::SceneFingerprint;
pub use path::PrimPath;
pub use settings::{
    CacheMode, DistanceSampling, Guiding, LightSampling, PixelFilter, RenderSettings, SettingSpec,
    SettingsError,
};

//! Numbers: frames, transforms, robust offsets, warps, random streams, compensated sums; no state.
//!
//! Everything here is a pure function or a small value. Conventions used by all crates:
//! - right-handed, column vectors, transforms named `a_from_b`;
//! - colours are linear Rec.709 in [`Rgb`], one number per channel, scene-referred;
//! - hot loops use the 16-byte aligned [`glam::Vec3A`], storage uses [`glam::Vec3`].

pub mod blackbody;
mod color;
mod frame;
mod interval;
pub mod random;
mod ray;
pub mod sampling;
mod split;
mod sum;

pub use blackbody::{blackbody_color, blackbody_radiance};
pub use color::{Rgb, luminance, max_component, mean_component, rec709_from_srgb, srgb_from_rec709};
pub use frame::Frame;
pub use interval::{GAMMA_3, gamma, offset_ray_origin};
pub use ray::Ray;
pub use split::SplitPoint;
pub use sum::CompensatedSum;

/// 1 / pi.
pub const INV_PI: f32 = std::f32::consts::FRAC_1_PI;
/// 1 / (4 pi): the isotropic phase function.
pub const INV_4PI: f32 = 0.25 * std::f32::consts::FRAC_1_PI;

//! Warps from the unit square, and tabulated distributions.

mod piecewise;
mod warp;

pub use piecewise::{PiecewiseConstant1D, PiecewiseConstant2D, Sample1D, Sample2D};
pub use warp::{
    concentric_disk, cosine_hemisphere, cosine_hemisphere_pdf, uniform_cone, uniform_cone_pdf,
    uniform_sphere, uniform_triangle,
};

//! The scattering odds of camera rays, one pixel each, learned in passes and filtered between them.
//!
//! Camera rays are the only ones whose odds are known per ray; their guide needs no spatial structure and is the
//! largest part of the gain. Cost: 44 bytes of sums and 16 of look-up per pixel. What was learned from one camera is
//! seen from another by the mean depths among the sums.

mod a_trous;
mod guide;
mod persist;
mod reproject;
mod view;

pub use guide::ImageGuide;
pub use view::View;

//! What is learned: scattering odds, image-space guide, directional lobes, and the field of both over space.
//!
//! Sees no geometry, materials or scene: samples go in, probabilities come out. Everything learned only steers
//! sampling, so a wrong guide costs noise, never bias.
//!
//! | module | what |
//! |---|---|
//! | `scattering_odds` | the probability to scatter in a volume instead of reaching the surface behind it |
//! | `segment_guide` | what a segment is told: the odds to choose by |
//! | `moments` | the sums per pixel or region that those odds are learned from |
//! | [`image_space`] | the odds of camera rays, per pixel, filtered |
//! | [`directional`] | von Mises–Fisher lobes and mixtures, fitted by expectation maximisation |
//! | [`cache`] | what was learned, as bytes for the next frame or machine |
//! | [`field`] | light and odds by place and direction, for the vertices of a path after the first |
//!
//! Source: Xu et al. 2024, "Volume Scattering Probability Guiding", ACM TOG 43(6); the odds form and its estimator are
//! our own (derived in the documentation of [`ScatteringOdds`] and [`Moments`]).
//!
//! Invariants
//! - No input makes a result NaN, infinite or a probability of 0 or 1 that would lose energy.
//! - Results are pure functions of ordered inputs: no clock, no thread count, no global state.

pub mod cache;
pub mod directional;
mod error;
pub mod field;
pub mod image_space;
mod moments;
mod scattering_odds;
mod segment_guide;

pub use error::GuidingError;
pub use moments::{EventClass, Moments, SegmentSample};
pub use scattering_odds::{
    ScatteringOdds, Selection, TargetProbability, headroom_depth, optimal_probability,
};
pub use segment_guide::{ClassCosts, FurtherSegments, NormalizedFlights, SegmentGuide, Strategy};

//! Media: brick grids, majorants, phase functions, walks, transmittance.
//!
//! A *medium* absorbs, scatters and emits with coefficients per stage unit ([`Medium`]), constant or multiplied by a
//! sparse voxel grid ([`BrickGrid`]). The world cuts a ray into a *segment*: the ray up to the next surface and an
//! unordered list of [`Span`]s, the intervals inside each medium. Spans may overlap; coefficients add. A path asks
//! two questions about a segment:
//! - [`sample_collision`]: where does light scatter next, or does it reach the end, and with which weight?
//! - [`transmittance`]: which part of the light passes unscattered?
//!
//! Guiding lives elsewhere: [`resample_collision`] is the first question for callers who choose the probability to
//! scatter themselves, having seen what the candidates of the whole segment amount to.
//!
//! Conventions: `t` counts lengths of the ray's direction, which the coefficients assume to be a unit vector in
//! stage units. Every estimator is unbiased; a majorant that fails to bound is counted, never clamped away.
//! Nothing here divides by sigma_t: coefficients that are zero, denormal or not a number mean "no medium".

pub mod grid;
pub mod majorant;
mod medium;
pub mod oracle;
pub mod phase;
mod point;
#[cfg(test)]
mod testing;
mod tint;
mod transmittance;
mod walk;

pub use grid::{BrickGrid, ColorGrid, GridReport, SparseVoxels};
pub use medium::{Coefficients, Emission, GridDensity, Medium, Span};
pub use phase::{Phase, PhaseMix, PhaseSample};
pub use point::{collision_density, scattering_at};
pub use tint::Tint;
pub use transmittance::transmittance;
pub use walk::{
    Candidate, CandidateSums, CandidateVisitor, Cell, Event, Normalization, ResampleOptions, Resampled,
    Segment, Walk, WalkStats, needs_candidates, resample_collision, sample_collision,
};

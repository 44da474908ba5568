//! Distributions over directions.
//!
//! Lobes are von Mises–Fisher: closed under products, sampled in closed form, fitted by their mean direction and mean
//! cosine alone. Directions are unit vectors; densities are per steradian.

mod assign;
mod divergence;
mod fit;
mod lanes;
mod mixture;
mod product;
mod statistics;
mod sums;
#[cfg(test)]
pub(crate) mod test_support;
mod vmf;

pub(crate) use assign::{Assigner, Assignment};
pub(crate) use divergence::{merged, merging_divergence};
pub(crate) use fit::fit_incrementally;
pub use fit::{FitReport, fit};
pub use lanes::MAX_LOBES;
pub(crate) use lanes::{Lanes, PerLobe, groups_of};
pub use mixture::{DirectionAndPdf, VmfMixture};
pub(crate) use mixture::{Group, normalise};
pub use statistics::{DirectionSample, SufficientStatistics};
pub(crate) use sums::LobeSums;
pub use vmf::{MAX_CONCENTRATION, VmfLobe, concentration_from_mean_cosine, mean_cosine};

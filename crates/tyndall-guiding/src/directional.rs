//! Distributions over directions.
//!
//! Lobes are von Mises–Fisher: closed under products, sampled in closed form, fitted by their mean direction and mean
//! cosine alone. Directions are unit vectors; densities are per steradian.

mod fit;
mod mixture;
#[cfg(test)]
mod test_support;
mod vmf;

pub use fit::{DirectionSample, FitReport, SufficientStatistics, fit};
pub use mixture::{DirectionAndPdf, MAX_LOBES, VmfMixture};
pub use vmf::{MAX_CONCENTRATION, VmfLobe, concentration_from_mean_cosine, mean_cosine};

//! `vsp`.

use super::{Aov, Mean, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "vsp",
    channels: &["vsp"],
    doc: "Share of the pixel's camera rays that scattered in a medium: the volume scattering probability achieved.",
    precision: Precision::Half,
    source: Source::Sample(|s| [s.scatters, 0.0, 0.0, 0.0], Mean::All),
};

//! `vsp_target`.

use super::{Aov, Mean, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "vsp_target",
    channels: &["vsp"],
    doc: "Mean probability with which the pixel's camera rays were to scatter in a medium.",
    precision: Precision::Half,
    source: Source::Sample(|s| [s.scatter_probability, 0.0, 0.0, 0.0], Mean::All),
};

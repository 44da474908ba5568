//! `albedo`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "albedo",
    channels: &["R", "G", "B"],
    doc: "Reflectance of the first surface, or single-scattering albedo of the first volume event.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.albedo), Mean::All),
};

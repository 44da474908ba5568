//! `normal`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "normal",
    channels: &["X", "Y", "Z"],
    doc: "Shading normal of the first surface in world space, averaged, zero where there is none.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.normal), Mean::All),
};

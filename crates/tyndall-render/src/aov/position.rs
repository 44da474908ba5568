//! `position`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "position",
    channels: &["X", "Y", "Z"],
    doc: "Mean position on the stage of the first scattering at a surface or in a medium; zero where there is none.",
    precision: Precision::Float,
    source: Source::Sample(|s| rgb(s.position), Mean::FiniteOrZero),
};

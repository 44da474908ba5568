//! `guide`.

use super::{Aov, Mean, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "guide",
    channels: &["share", "samples", "lobes"],
    doc: "Guiding of directions: share of the pixel's paths that were guided; mean number of training samples behind the \
          first guided vertex, and of lobes there.",
    precision: Precision::Float,
    source: Source::Sample(|s| [s.guide[0], s.guide[1], s.guide[2], 0.0], Mean::All),
};

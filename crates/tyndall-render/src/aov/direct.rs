//! `direct`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "direct",
    channels: &["R", "G", "B"],
    doc: "Radiance that scattered once, at a surface or in a medium.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.direct), Mean::All),
};

//! `indirect`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "indirect",
    channels: &["R", "G", "B"],
    doc: "Radiance that scattered more than once.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.radiance - s.unscattered - s.direct), Mean::All),
};

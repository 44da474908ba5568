//! `surface`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "surface",
    channels: &["R", "G", "B"],
    doc: "Radiance whose first event is at a surface, a light or the background; volume + surface = rgba.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.radiance - s.volume_radiance), Mean::All),
};

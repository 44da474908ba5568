//! `emission`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "emission",
    channels: &["R", "G", "B"],
    doc: "Radiance of lights, glowing surfaces and media, and the background as they are seen directly; emission + direct + indirect = rgba.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.unscattered), Mean::All),
};

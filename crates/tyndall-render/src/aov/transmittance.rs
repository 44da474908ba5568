//! `transmittance`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "transmittance",
    channels: &["R", "G", "B"],
    doc: "Transmittance of the media between the camera and the first surface.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.transmittance), Mean::All),
};

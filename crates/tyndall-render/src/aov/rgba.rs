//! `rgba`.

use super::{Aov, Mean, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "rgba",
    channels: &["R", "G", "B", "A"],
    doc: "Radiance, premultiplied by alpha, with alpha the part that does not see the background.",
    precision: Precision::Float,
    source: Source::Sample(|s| [s.radiance.x, s.radiance.y, s.radiance.z, s.alpha], Mean::All),
};

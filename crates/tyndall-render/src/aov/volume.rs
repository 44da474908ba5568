//! `volume`.

use super::{Aov, Mean, Precision, Source, rgb};

pub(super) const AOV: Aov = Aov {
    name: "volume",
    channels: &["R", "G", "B"],
    doc: "Radiance whose first event is scattering or emission in a medium.",
    precision: Precision::Half,
    source: Source::Sample(|s| rgb(s.volume_radiance), Mean::All),
};

//! `volume_depth`.

use super::{Aov, Mean, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "volume_depth",
    channels: &["Z"],
    doc: "Mean depth of the first scattering in a medium along the viewing axis, stage units; 1e10 where there is none.",
    precision: Precision::Float,
    source: Source::Sample(|s| [s.volume_depth, 0.0, 0.0, 0.0], Mean::Finite),
};

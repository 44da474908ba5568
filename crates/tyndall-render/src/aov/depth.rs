//! `depth`.

use super::{Aov, Mean, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "depth",
    channels: &["Z"],
    doc: "Depth of the first surface along the viewing axis in stage units; 1e10 where there is none.",
    precision: Precision::Float,
    source: Source::Sample(|s| [s.depth, 0.0, 0.0, 0.0], Mean::Finite),
};

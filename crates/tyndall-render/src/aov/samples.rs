//! `samples`.

use super::{Aov, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "samples",
    channels: &["samples"],
    doc: "Samples taken in the pixel.",
    precision: Precision::Uint,
    source: Source::Pixel(|p| [p.count as f32, 0.0, 0.0, 0.0]),
};

//! Where a film keeps the sums of each AOV.

use crate::aov::cryptomatte::Matte;
use crate::aov::{Aov, Source};

/// Where each sample AOV keeps its sums.
#[derive(Clone, Default)]
pub(super) struct SumLayout {
    /// Numbers a pixel.
    pub(super) stride: usize,
    pub(super) slots: Vec<Slot>,
    /// Whose coverage is kept.
    pub(super) mattes: Vec<Matte>,
}

/// The place of one AOV: its channels, then the count of samples if only finite ones do.
#[derive(Clone, Copy)]
pub(super) struct Slot {
    pub(super) aov: &'static Aov,
    pub(super) offset: usize,
}

impl SumLayout {
    pub(super) fn new(aovs: &[&'static Aov]) -> Self {
        let mut layout = Self::default();
        for aov in aovs {
            match aov.source {
                Source::Sample(_, mean) => {
                    layout.slots.push(Slot { aov, offset: layout.stride });
                    layout.stride += aov.channels.len() + usize::from(mean.is_of_finite());
                }
                Source::Coverage(matte) => layout.mattes.push(matte),
                Source::Pixel(_) => {}
            }
        }
        layout
    }
}

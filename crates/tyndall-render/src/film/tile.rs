//! A rectangle of pixels that one worker owns at a time.

use super::SumLayout;
use super::block::Block;
use crate::aov::cryptomatte::{Coverage, Matte, RANKS};
use crate::aov::{Aov, Mean, NO_HIT_DEPTH, PixelStatistics, SampleRecord, Source};

/// A rectangle of pixels with the sums of their samples.
#[derive(Clone)]
pub(crate) struct Tile {
    pub(crate) x0: u32,
    pub(crate) y0: u32,
    width: u32,
    height: u32,
    first_sample: u32,
    pub(super) layout: SumLayout,
    /// Consecutive; all pixels have all of their samples, unless they are clean.
    pub(super) blocks: Vec<Block>,
    /// The block being rendered: pixels have some of its samples.
    open: Option<Block>,
}

impl Tile {
    /// A tile without samples, whose first one will be `first_sample`.
    pub(super) fn new(
        [x0, y0]: [u32; 2],
        [width, height]: [u32; 2],
        first_sample: u32,
        layout: &SumLayout,
    ) -> Self {
        let layout = layout.clone();
        Self { x0, y0, width, height, first_sample, layout, blocks: Vec::new(), open: None }
    }

    /// Number of pixels.
    pub(crate) fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Image position of a pixel.
    pub(crate) fn pixel(&self, index: usize) -> (u32, u32) {
        debug_assert!(index < self.len());
        (self.x0 + index as u32 % self.width, self.y0 + index as u32 / self.width)
    }

    /// The first sample that not all pixels have.
    pub(crate) fn next_sample(&self) -> u32 {
        self.blocks.last().map_or(self.first_sample, |block| block.end)
    }

    /// Opens a block of all samples before `end` that are missing, and returns the first of them. What a pass that was
    /// cancelled has left is rendered again.
    pub(crate) fn begin(&mut self, end: u32) -> u32 {
        let first = self.next_sample();
        self.open = Some(Block::new(first, end.max(first), self.len(), &self.layout));
        first
    }

    /// Adds a sample to the open block. Radiance that is not finite counts as black, and is counted.
    pub(crate) fn add(&mut self, index: usize, record: SampleRecord) {
        if let Some(block) = &mut self.open {
            block.add(index, record, &self.layout);
        }
    }

    /// Closes the open block: all pixels have all of its samples.
    pub(crate) fn finish(&mut self) {
        if let Some(block) = self.open.take().filter(|block| block.end > block.first) {
            Block::push(&mut self.blocks, block);
        }
    }

    /// Appends the closed blocks of a tile of the same pixels, layout and next sample.
    pub(super) fn append(&mut self, next: &Self) {
        self.open = None;
        for block in &next.blocks {
            Block::push(&mut self.blocks, block.clone());
        }
    }

    /// The closed blocks, and the one that a cancelled pass left.
    fn all_blocks(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().chain(&self.open)
    }

    /// Samples that were not finite and count as zero.
    pub(super) fn non_finite(&self) -> u64 {
        self.all_blocks().map(|block| block.non_finite).sum()
    }

    /// What the pixel's samples say about its radiance.
    pub(super) fn statistics(&self, index: usize) -> PixelStatistics {
        let mut total = PixelStatistics::default();
        self.all_blocks().for_each(|block| total.merge(&block.statistics[index]));
        total
    }

    /// Sums of the radiance of the pixel in this column and row of the image.
    pub(super) fn radiance_sums(&self, x: u32, y: u32) -> [f64; 3] {
        self.statistics(((y - self.y0) * self.width + (x - self.x0)) as usize).sum
    }

    /// Samples the pixel has.
    pub(super) fn sample_count(&self, index: usize) -> u32 {
        self.all_blocks().map(|block| block.statistics[index].count).sum()
    }

    /// The pixel's channels of a cryptomatte.
    pub(super) fn ranked(&self, matte: Matte, index: usize) -> [f32; 2 * RANKS] {
        let mut total = Coverage::default();
        if let Some(slot) = self.layout.mattes.iter().position(|known| *known == matte) {
            let at = index * self.layout.mattes.len() + slot;
            self.all_blocks().for_each(|block| total.merge(&block.coverage[at]));
        }
        total.ranked(self.sample_count(index))
    }

    /// The pixel's value of an AOV, unless it is a cryptomatte.
    pub(super) fn value(&self, aov: &Aov, index: usize) -> [f32; 4] {
        let mean = match aov.source {
            Source::Pixel(value_of) => return value_of(&self.statistics(index)),
            Source::Sample(_, mean) => mean,
            Source::Coverage(_) => return [0.0; 4],
        };
        let Some(slot) = self.layout.slots.iter().find(|s| s.aov.name == aov.name) else { return [0.0; 4] };
        let channels = aov.channels.len();
        let at = index * self.layout.stride + slot.offset;
        let sum = |c: usize| self.all_blocks().map(|block| block.sums[at + c]).sum::<f64>();
        let count = match mean {
            Mean::All => f64::from(self.sample_count(index)),
            Mean::Finite | Mean::FiniteOrZero => sum(channels),
        };
        let empty = if mean == Mean::Finite { NO_HIT_DEPTH } else { 0.0 };
        std::array::from_fn(|c| if c < channels && count > 0.0 { (sum(c) / count) as f32 } else { empty })
    }
}

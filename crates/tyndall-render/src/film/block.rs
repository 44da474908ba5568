//! Sums over consecutive samples, and the order in which such sums are added up.
//!
//! f64 addition is not associative, so an image that is made in parts has the same bits as one made at once only if
//! both add in the same order. The order is therefore part of the film: samples are summed one by one within a *leaf*
//! (a pass: 1, 1, 2, 4, ... and then 32 samples, [`leaf_end`]), leaves in pairs up to [`GROUP`] samples, and groups one
//! by one from the first. A range of samples that begins and ends on the borders of leaves holds whole terms of that
//! sum, and whoever has all ranges can finish it. A film that begins with sample 0 holds three blocks at the most.

use super::SumLayout;
use crate::aov::cryptomatte::Coverage;
use crate::aov::{PixelStatistics, SampleRecord, Source};
use tyndall_math::Rgb;

/// Samples of a full leaf: where ranges of samples may begin and end.
pub const SAMPLE_GRID: u32 = 32;

/// Samples of a group: what a film that does not begin with sample 0 keeps apart. Larger groups would make such films
/// smaller and all others larger.
const GROUP: u32 = 2 * SAMPLE_GRID;

/// Sums over the samples `first..end` of all pixels of a tile.
#[derive(Clone)]
pub(super) struct Block {
    pub(super) first: u32,
    pub(super) end: u32,
    /// Samples that were not finite and count as zero.
    pub(super) non_finite: u64,
    pub(super) statistics: Vec<PixelStatistics>,
    /// `SumLayout::stride` numbers a pixel: the sums of all sample AOVs, then the counts of those with [`Mean::is_of_finite`].
    pub(super) sums: Vec<f64>,
    /// `SumLayout::mattes` a pixel.
    pub(super) coverage: Vec<Coverage>,
}

/// The end of the leaf that begins with sample `first`, or that sample `first` is in.
pub(crate) fn leaf_end(first: u32) -> u32 {
    if first < SAMPLE_GRID {
        (first + 1).next_power_of_two()
    } else {
        (first / SAMPLE_GRID + 1).saturating_mul(SAMPLE_GRID)
    }
}

impl Block {
    pub(super) fn new(first: u32, end: u32, pixels: usize, layout: &SumLayout) -> Self {
        let statistics = vec![PixelStatistics::default(); pixels];
        let sums = vec![0.0; pixels * layout.stride];
        let coverage = vec![Coverage::default(); pixels * layout.mattes.len()];
        Self { first, end, non_finite: 0, statistics, sums, coverage }
    }

    /// Adds a sample of a pixel. Radiance that is not finite counts as black, and is counted.
    pub(super) fn add(&mut self, index: usize, mut record: SampleRecord, layout: &SumLayout) {
        let parts = [record.radiance, record.volume_radiance, record.unscattered, record.direct];
        if !parts.iter().all(|part| part.is_finite()) {
            self.non_finite += 1;
            record.radiance = Rgb::ZERO;
            record.volume_radiance = Rgb::ZERO;
            record.unscattered = Rgb::ZERO;
            record.direct = Rgb::ZERO;
        }
        let pixel = &mut self.statistics[index];
        pixel.count += 1;
        for (c, value) in record.radiance.to_array().into_iter().enumerate() {
            pixel.sum[c] += f64::from(value);
            pixel.sum_of_squares[c] += f64::from(value) * f64::from(value);
        }
        if record.coverage > 0.0 {
            let of_pixel = &mut self.coverage[index * layout.mattes.len()..];
            for (matte, coverage) in layout.mattes.iter().zip(of_pixel) {
                coverage.add(record.mattes[*matte as usize], f64::from(record.coverage));
            }
        }
        let sums = &mut self.sums[index * layout.stride..(index + 1) * layout.stride];
        for slot in &layout.slots {
            let Source::Sample(value_of, mean) = slot.aov.source else { continue };
            let value = value_of(&record);
            if mean.is_of_finite() {
                if !value[0].is_finite() {
                    continue;
                }
                sums[slot.offset + slot.aov.channels.len()] += 1.0;
            }
            for (sum, v) in sums[slot.offset..].iter_mut().zip(&value[..slot.aov.channels.len()]) {
                *sum += f64::from(*v);
            }
        }
    }

    /// Appends a block to those of one film, adding up what the order of the sum allows.
    pub(super) fn push(blocks: &mut Vec<Self>, block: Self) {
        blocks.push(block);
        while let [.., left, right] = &blocks[..]
            && left.is_added_to(right)
        {
            let (Some(right), Some(left)) = (blocks.pop(), blocks.last_mut()) else { return };
            left.absorb(&right);
        }
    }

    /// Whether this block and the `next` one are two terms of the same sum.
    fn is_added_to(&self, next: &Self) -> bool {
        let (len, next_len) = (self.end - self.first, next.end - next.first);
        let are_a_pair = len == next_len && 2 * len <= GROUP && self.first.is_multiple_of(2 * len);
        let are_all_groups = self.first == 0 && self.end.is_multiple_of(GROUP) && next_len == GROUP;
        are_a_pair || are_all_groups
    }

    fn absorb(&mut self, next: &Self) {
        self.end = next.end;
        self.non_finite += next.non_finite;
        self.statistics.iter_mut().zip(&next.statistics).for_each(|(pixel, other)| pixel.merge(other));
        self.sums.iter_mut().zip(&next.sums).for_each(|(sum, other)| *sum += other);
        self.coverage.iter_mut().zip(&next.coverage).for_each(|(sum, other)| sum.merge(other));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_double_up_to_the_grid() {
        let mut ends = vec![0];
        while ends.len() < 10 {
            ends.push(leaf_end(ends[ends.len() - 1]));
        }
        assert_eq!(ends, [0, 1, 2, 4, 8, 16, 32, 64, 96, 128]);
        assert_eq!([leaf_end(3), leaf_end(31), leaf_end(33)], [4, 32, 64]);
    }

    #[test]
    fn films_from_the_start_hold_few_blocks() {
        let mut blocks = Vec::new();
        let mut end = 0;
        while end < 100 * SAMPLE_GRID {
            Block::push(&mut blocks, Block::new(end, leaf_end(end), 1, &SumLayout::default()));
            end = leaf_end(end);
            assert!(blocks.len() <= 2, "{} blocks at {end}", blocks.len());
        }
    }
}

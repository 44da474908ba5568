//! The image-space guide: per-pixel sums, and the filtered odds made of them between passes.
//!
//! A pass looks up odds that are frozen, and collects [`Moments`] of its own; after the pass they are merged and the
//! odds made anew. No sample is therefore guided by its own random numbers, which would bias the image.

use super::a_trous;
use crate::{ClassCosts, FurtherSegments, GuidingError, Moments, SegmentGuide, Strategy};
use rayon::prelude::*;

/// The guide of an image or of a crop of it.
#[derive(Debug, Clone)]
pub struct ImageGuide {
    pub(super) origin: [i32; 2],
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) strategy: Strategy,
    pub(super) moments: Vec<Moments>,
    pub(super) costs: ClassCosts,
    /// Empty until odds are made of sums that were read.
    lookup: Vec<SegmentGuide>,
}

/// Equal sums make equal odds.
impl PartialEq for ImageGuide {
    fn eq(&self, other: &Self) -> bool {
        self.is_like(other) && self.costs == other.costs && self.moments == other.moments
    }
}

impl ImageGuide {
    /// A guide that knows nothing, for the pixels `origin` to `origin + (width, height)`, right and bottom excluded.
    pub fn new(origin: [i32; 2], width: usize, height: usize, strategy: Strategy) -> Self {
        let n = width * height;
        Self {
            origin,
            width,
            height,
            strategy,
            moments: vec![Moments::default(); n],
            costs: ClassCosts::default(),
            lookup: vec![SegmentGuide::default(); n],
        }
    }

    /// The guide of these sums, without odds until [`Self::make_odds`]; `moments` has one entry a pixel.
    pub(super) fn from_sums(
        origin: [i32; 2],
        [width, height]: [usize; 2],
        strategy: Strategy,
        moments: Vec<Moments>,
        costs: ClassCosts,
    ) -> Self {
        Self { origin, width, height, strategy, moments, costs, lookup: Vec::new() }
    }

    /// Whether `other` guides the same pixels in the same way.
    pub fn is_like(&self, other: &Self) -> bool {
        let shape = |g: &Self| (g.origin, g.width, g.height, g.strategy);
        shape(self) == shape(other)
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Size in memory.
    pub fn n_bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.moments.as_slice()) + size_of_val(self.lookup.as_slice())
    }

    /// How the segments after the camera's choose, by what a field knows.
    #[inline]
    pub fn further_segments(&self) -> FurtherSegments {
        FurtherSegments::new(self.strategy, &self.costs)
    }

    /// The sums of all passes merged so far, row by row.
    pub fn moments(&self) -> &[Moments] {
        &self.moments
    }

    /// The guide of pixel (x, y) of the image; outside the crop that of an empty guide.
    #[inline]
    pub fn lookup(&self, x: i32, y: i32) -> SegmentGuide {
        let column =
            usize::try_from(i64::from(x) - i64::from(self.origin[0])).ok().filter(|&c| c < self.width);
        let row = usize::try_from(i64::from(y) - i64::from(self.origin[1])).ok().filter(|&r| r < self.height);
        match (column, row) {
            (Some(column), Some(row)) => {
                self.lookup.get(row * self.width + column).copied().unwrap_or_default()
            }
            _ => SegmentGuide::default(),
        }
    }

    /// Adds what a pass collected and makes the odds anew from the filtered sums of all passes.
    ///
    /// `pass` has one entry per pixel of the crop, row by row.
    ///
    /// # Errors
    /// It has not; nothing is changed then.
    pub fn learn(&mut self, pass: &[Moments], costs: &ClassCosts) -> Result<(), GuidingError> {
        GuidingError::check("the pass", self.moments.len(), pass.len())?;
        self.moments.iter_mut().zip(pass).for_each(|(sum, new)| sum.merge(new));
        self.costs.merge(costs);
        self.make_odds();
        Ok(())
    }

    /// Makes the odds from the filtered sums, on the threads of the current rayon pool.
    pub fn make_odds(&mut self) {
        let filtered = a_trous::filter(&self.moments, self.width);
        let guide_of = |m: &Moments| SegmentGuide::of_pixel(m, self.strategy, &self.costs);
        self.lookup = filtered.par_iter().map(guide_of).collect();
    }

    /// Weakens the sums to `factor` of their samples, for a scene that changed a little (an edit, the next frame). Odds
    /// must be made anew: they are doubted more.
    pub fn decay(&mut self, factor: f32) {
        self.moments.iter_mut().for_each(|m| m.decay(factor));
    }

    /// Adds the sums of a guide that [is like](Self::is_like) this one. Odds must be made anew.
    pub fn merge(&mut self, other: &Self) {
        self.moments.iter_mut().zip(&other.moments).for_each(|(sum, new)| sum.merge(new));
        self.costs.merge(&other.costs);
    }
}

#[cfg(test)]
#[path = "guide_tests.rs"]
mod tests;

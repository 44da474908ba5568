//! The image-space guide: per-pixel sums, and the filtered odds made of them between passes.
//!
//! A pass looks up odds that are frozen, and collects [`Moments`] of its own; after the pass they are merged and the
//! odds made anew. No sample is therefore guided by its own random numbers, which would bias the image.

use super::{ATrous, PixelFeatures};
use crate::{GuidingError, Moments, ScatteringOdds};

/// What a camera ray is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelGuide {
    /// κ.
    pub odds: ScatteringOdds,
    /// P̂: the scattering probability to expect, for the majorant's headroom.
    pub predicted: f32,
    /// The limit for [`Moments::add`] of this pass; infinite as long as too little is known.
    pub outlier_limit: f32,
}

impl Default for PixelGuide {
    /// Delta tracking's choice, one half expected, nothing cut.
    fn default() -> Self {
        Self { odds: ScatteringOdds::default(), predicted: 0.5, outlier_limit: f32::INFINITY }
    }
}

impl PixelGuide {
    /// What filtered sums say.
    pub fn from_moments(moments: &Moments) -> Self {
        Self {
            odds: moments.odds(),
            predicted: moments.predicted_probability(),
            outlier_limit: moments.outlier_limit(),
        }
    }
}

/// The guide of an image or of a crop of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageGuide {
    origin: [i32; 2],
    width: usize,
    height: usize,
    moments: Vec<Moments>,
    lookup: Vec<PixelGuide>,
}

impl ImageGuide {
    /// A guide that knows nothing, for the pixels `origin` to `origin + (width, height)`, right and bottom excluded.
    pub fn new(origin: [i32; 2], width: usize, height: usize) -> Self {
        let n = width * height;
        Self {
            origin,
            width,
            height,
            moments: vec![Moments::default(); n],
            lookup: vec![PixelGuide::default(); n],
        }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The sums of all passes merged so far, row by row.
    pub fn moments(&self) -> &[Moments] {
        &self.moments
    }

    /// The guide of pixel (x, y) of the image; outside the crop that of an empty guide.
    #[inline]
    pub fn lookup(&self, x: i32, y: i32) -> PixelGuide {
        let column =
            usize::try_from(i64::from(x) - i64::from(self.origin[0])).ok().filter(|&c| c < self.width);
        let row = usize::try_from(i64::from(y) - i64::from(self.origin[1])).ok().filter(|&r| r < self.height);
        match (column, row) {
            (Some(column), Some(row)) => self.lookup[row * self.width + column],
            _ => PixelGuide::default(),
        }
    }

    /// Adds what a pass collected and makes the odds anew from the filtered sums of all passes.
    ///
    /// `pass` and `features` (see [`ATrous::filter`]) have one entry per pixel of the crop, row by row.
    ///
    /// # Errors
    /// A buffer does not have one entry per pixel; nothing is changed then.
    pub fn learn(
        &mut self,
        pass: &[Moments],
        features: Option<&[PixelFeatures]>,
    ) -> Result<(), GuidingError> {
        GuidingError::check("the pass", self.moments.len(), pass.len())?;
        GuidingError::check("the features buffer", pass.len(), features.map_or(pass.len(), <[_]>::len))?;
        self.moments.iter_mut().zip(pass).for_each(|(sum, new)| sum.merge(new));
        let filtered = ATrous::new(self.width, self.height).filter(&self.moments, features)?;
        self.lookup = filtered.iter().map(PixelGuide::from_moments).collect();
        Ok(())
    }

    /// Weakens the sums to `factor` of their samples, for a scene that changed a little (an edit, the next frame).
    pub fn decay(&mut self, factor: f32) {
        self.moments.iter_mut().for_each(|m| m.decay(factor));
    }
}

#[cfg(test)]
#[path = "guide_tests.rs"]
mod tests;

//! Edge-avoiding à-trous filter over per-pixel sums.
//!
//! Source: Dammertz et al. 2010, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering", HPG.
//! Each level spreads a 5x5 B3 spline with twice the previous step, so that three levels reach 14 pixels far.
//!
//! *Sums* are filtered, not the ratios made of them: a pixel with one sample then weighs as one sample. The kernel is
//! scaled to 1 at its centre and not normalised, so sample counts grow with what was gathered (up to 360 times inside
//! a smooth area, about the kernel's effective number of pixels), and priors weaken accordingly.

use crate::{GuidingError, Moments};
use glam::Vec3;
use std::ops::Range;

/// The B3 spline's taps at distance 0, 1, 2, relative to the centre.
const TAPS: [f32; 3] = [1.0, 4.0 / 6.0, 1.0 / 6.0];
/// Relative difference of depth per pixel step that lowers a weight to 1/e.
const DEPTH_TOLERANCE: f32 = 0.01;
/// Sharpness of the normal weight: normals 20 degrees apart count for a seventh.
const NORMAL_EXPONENT: i32 = 32;

/// What the first surface hit of a pixel looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelFeatures {
    /// Mean distance to the first surface; infinite for background.
    pub depth: f32,
    /// Mean normal, not necessarily of unit length; zero for background.
    pub normal: Vec3,
}

/// The filter of an image of a given size. Pixels outside the image take no part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ATrous {
    width: usize,
    height: usize,
}

impl ATrous {
    /// Levels of [`Self::filter`].
    pub const N_LEVELS: usize = 3;

    /// A filter of images of `width` by `height` pixels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// All levels, one after the other. `features` has one entry per pixel; without it nothing stops the filter at edges.
    ///
    /// # Errors
    /// A buffer does not have one entry per pixel.
    pub fn filter(
        &self,
        moments: &[Moments],
        features: Option<&[PixelFeatures]>,
    ) -> Result<Vec<Moments>, GuidingError> {
        let n = self.width * self.height;
        GuidingError::check("the moments buffer", n, moments.len())?;
        GuidingError::check("the features buffer", n, features.map_or(n, <[_]>::len))?;
        let mut source = moments.to_vec();
        let mut target = vec![Moments::default(); n];
        for level in 0..Self::N_LEVELS {
            self.filter_rows(&source, features, level, 0..self.height, &mut target);
            std::mem::swap(&mut source, &mut target);
        }
        Ok(source)
    }

    /// The rows `rows` of one level, into `target` (which holds just these rows). A pure function of the buffers, so
    /// rows may be computed in any order and on any thread.
    ///
    /// # Panics
    /// If `source` or `features` are smaller than the image, or `target` than the rows.
    pub fn filter_rows(
        &self,
        source: &[Moments],
        features: Option<&[PixelFeatures]>,
        level: usize,
        rows: Range<usize>,
        target: &mut [Moments],
    ) {
        let first = rows.start;
        for y in rows {
            for x in 0..self.width {
                target[(y - first) * self.width + x] = self.gather(source, features, level, x, y);
            }
        }
    }

    fn gather(
        &self,
        source: &[Moments],
        features: Option<&[PixelFeatures]>,
        level: usize,
        x: usize,
        y: usize,
    ) -> Moments {
        let step = 1isize << level;
        let center = y * self.width + x;
        let mut sum = Moments::default();
        for dy in -2isize..=2 {
            let Some(yy) = y.checked_add_signed(dy * step).filter(|&yy| yy < self.height) else { continue };
            for dx in -2isize..=2 {
                let Some(xx) = x.checked_add_signed(dx * step).filter(|&xx| xx < self.width) else {
                    continue;
                };
                let tap = yy * self.width + xx;
                let kernel = TAPS[dx.unsigned_abs()] * TAPS[dy.unsigned_abs()];
                // A pixel always belongs to itself, even if its features are NaN.
                let others = features.filter(|_| tap != center);
                let edge = others.map_or(1.0, |f| edge_weight(&f[center], &f[tap], step as f32));
                sum.add_scaled(&source[tap], kernel * edge);
            }
        }
        sum
    }
}

/// How much two pixels see the same surface, in [0, 1]; 1 for a pixel and itself.
fn edge_weight(a: &PixelFeatures, b: &PixelFeatures, step: f32) -> f32 {
    if a == b {
        return 1.0;
    }
    let depth = if a.depth == b.depth {
        1.0
    } else {
        let relative = (a.depth - b.depth).abs() / a.depth.abs().max(b.depth.abs());
        // Infinity against a number is NaN here: a silhouette against the background.
        if relative.is_nan() { 0.0 } else { (-relative / (DEPTH_TOLERANCE * step)).exp() }
    };
    let (na, nb) = (a.normal.normalize_or_zero(), b.normal.normalize_or_zero());
    let normal = if na == nb { 1.0 } else { na.dot(nb).clamp(0.0, 1.0).powi(NORMAL_EXPONENT) };
    if (depth * normal).is_nan() { 0.0 } else { depth * normal }
}

#[cfg(test)]
#[path = "a_trous_tests.rs"]
mod tests;

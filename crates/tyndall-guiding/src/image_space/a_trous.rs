//! Edge-avoiding à-trous filter over per-pixel sums.
//!
//! Source: Dammertz et al. 2010, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering", HPG.
//! Each level spreads a B3 spline with twice the previous step, so that three levels reach 14 pixels far. Rows and
//! columns are filtered one after the other: 30 taps a pixel instead of 75, and the same kernel away from edges.
//!
//! *Sums* are filtered, not the ratios made of them: a pixel with one sample then weighs as one sample. The kernel is
//! scaled to 1 at its centre and not normalised, so sample counts grow with what was gathered (up to 360 times inside
//! a smooth area, about the kernel's effective number of pixels), and priors weaken accordingly.
//!
//! Edges are those of the mean surface depth, which the sums hold themselves. What a pixel sees through its medium
//! changes there; the light scattered in front of it does not, and is the better for every neighbour.

use crate::Moments;
use rayon::prelude::*;

/// The B3 spline's taps at distance 0, 1, 2, relative to the centre.
const TAPS: [f32; 3] = [1.0, 4.0 / 6.0, 1.0 / 6.0];
/// Relative difference of depth per pixel step at which a neighbour no longer counts.
const DEPTH_TOLERANCE: f32 = 0.03;
const N_LEVELS: usize = 3;

/// Filters the sums of an image of `width` pixels a row. Pixels outside the image take no part.
pub(super) fn filter(moments: &[Moments], width: usize) -> Vec<Moments> {
    let height = moments.len().checked_div(width).unwrap_or(0);
    let depth: Vec<f32> = moments.iter().map(depth_of).collect();
    let mut source = moments.to_vec();
    let mut target = source.clone();
    for level in 0..N_LEVELS {
        let step = 1usize << level;
        spread(&source, &depth, width, Line { n: width, stride: 1, is_row: true }, step, &mut target);
        spread(&target, &depth, width, Line { n: height, stride: width, is_row: false }, step, &mut source);
    }
    source
}

/// A row or a column: how many pixels, how far apart.
#[derive(Clone, Copy)]
struct Line {
    n: usize,
    stride: usize,
    is_row: bool,
}

/// One level along all lines like `line`, row by row of the image.
fn spread(source: &[Moments], depth: &[f32], width: usize, line: Line, step: usize, target: &mut [Moments]) {
    target.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, target)| {
        for (column, target) in target.iter_mut().enumerate() {
            let center = row * width + column;
            let i = if line.is_row { column } else { row };
            let mut sum = source[center];
            for d in [1, 2] {
                let reach = d * step;
                let back = (i >= reach).then(|| center - reach * line.stride);
                let forth = (i + reach < line.n).then(|| center + reach * line.stride);
                for tap in [back, forth].into_iter().flatten() {
                    let weight = TAPS[d] * likeness(depth[center], depth[tap], reach as f32);
                    if weight > 0.0 {
                        sum.add_scaled(&source[tap], weight);
                    }
                }
            }
            *target = sum;
        }
    });
}

/// Relative difference of depth is what counts: the scale of a scene does not matter. Negative where no surface is
/// seen through the medium: then nothing keeps neighbours apart.
fn depth_of(moments: &Moments) -> f32 {
    moments.mean_surface_depth().unwrap_or(-1.0)
}

/// How much two pixels see the same surface, in [0, 1]: Tukey's biweight, 0 beyond the tolerance.
fn likeness(a: f32, b: f32, distance: f32) -> f32 {
    if a == b || a < 0.0 || b < 0.0 {
        return 1.0;
    }
    let relative = (a - b).abs() / (a.max(b) * DEPTH_TOLERANCE * distance);
    let rest = (1.0 - relative * relative).max(0.0);
    rest * rest
}

#[cfg(test)]
#[path = "a_trous_tests.rs"]
mod tests;

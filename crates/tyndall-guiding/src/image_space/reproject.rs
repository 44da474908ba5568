//! An image guide seen from elsewhere.
//!
//! Every pixel's sums go to where their light is seen from the new camera: those of the medium at its mean depth, those of
//! the surface at that of the surface, each shared by the four nearest pixels. The nearest surface hides what is behind
//! it. In which pixels both arrive, they make sums as if of equally many samples; the others stay empty, and learn from
//! their neighbours by the filter that odds are made with (`a_trous`), as pixels that were out of sight do.
//!
//! That mean depths are no more than that makes odds worse, never an image: any odds are unbiased.

use super::{ImageGuide, View};
use crate::Moments;
use glam::{DVec2, Vec2};
use rayon::prelude::*;

/// Distance, relative to the nearest, within which surfaces count as the same one.
const SAME_SURFACE: f32 = 0.05;
/// Samples of a class below which a pixel knows too little of it: rounding at the border of what was reprojected.
const FEWEST_SAMPLES: f32 = 1e-3;

impl ImageGuide {
    /// What this guide, of an image seen as `from`, knows of one of `size` pixels seen as `to`. Odds must be made.
    pub fn reprojected(&self, from: &View, to: &View, [width, height]: [usize; 2]) -> Self {
        let target = Target { view: to, width, height };
        let in_medium = self.splats(from, &target, Moments::mean_volume_depth);
        let volume = target.gather(&in_medium, |i| volume_part(&self.moments[i]), |_, _| true);
        let on_surface = self.splats(from, &target, Moments::mean_surface_depth);
        let nearest = target.nearest(&on_surface);
        let is_seen = |pixel: usize, distance| distance <= nearest[pixel] * (1.0 + SAME_SURFACE);
        let surface = target.gather(&on_surface, |i| surface_part(&self.moments[i]), is_seen);
        let moments = volume.iter().zip(&surface).map(|(v, s)| joined(v, s)).collect();
        Self::from_sums([0, 0], [width, height], self.strategy, moments, self.costs)
    }

    /// Where one class of each pixel is seen in `target`, in the order of pixels.
    fn splats(&self, from: &View, target: &Target<'_>, depth: fn(&Moments) -> Option<f32>) -> Vec<Splat> {
        let size = DVec2::new(self.width.max(1) as f64, self.height.max(1) as f64);
        let target_size = DVec2::new(target.width as f64, target.height as f64);
        let splat = |(source, moments): (usize, &Moments)| {
            // What scatters nowhere or shows no surface is as far away as the other class.
            let other = || moments.mean_surface_depth().or(moments.mean_volume_depth());
            let distance = depth(moments).or_else(other).filter(|_| moments.n > 0.0)?;
            let pixel = DVec2::new((source % self.width) as f64 + 0.5, (source / self.width) as f64 + 0.5);
            let (place, distance) = target.view.project(from.point(pixel / size, distance.into()))?;
            let place = (place * target_size - 0.5).as_vec2();
            Some(Splat { place, distance: distance as f32, source })
        };
        self.moments.par_iter().enumerate().filter_map(splat).collect()
    }
}

/// Where a pixel's sums are seen: `place` in pixels, whole numbers at their centres.
struct Splat {
    place: Vec2,
    distance: f32,
    /// The pixel.
    source: usize,
}

/// The image that is made.
struct Target<'a> {
    view: &'a View,
    width: usize,
    height: usize,
}

impl Target<'_> {
    /// The pixels around a place, and their weights.
    fn around(&self, place: Vec2) -> impl Iterator<Item = (usize, f32)> {
        let (corner, share) = (place.floor(), place - place.floor());
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].into_iter().filter_map(move |(dx, dy)| {
            let (x, y) = (corner.x + dx, corner.y + dy);
            let is_inside = x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32;
            let weight = (1.0 - (dx - share.x).abs()) * (1.0 - (dy - share.y).abs());
            is_inside.then(|| (y as usize * self.width + x as usize, weight))
        })
    }

    /// The sums that arrive in each pixel, with the depths they have from here, of the splats that `counts` lets pass by
    /// pixel and distance.
    fn gather(
        &self,
        splats: &[Splat],
        part: impl Fn(usize) -> Moments,
        counts: impl Fn(usize, f32) -> bool,
    ) -> Vec<Moments> {
        let mut sums = vec![Moments::default(); self.width * self.height];
        for splat in splats {
            let mut seen = part(splat.source);
            (seen.w_depth, seen.t_depth) = (seen.w * splat.distance, seen.t * splat.distance);
            for (pixel, weight) in self.around(splat.place) {
                if counts(pixel, splat.distance) {
                    sums[pixel].add_scaled(&seen, weight);
                }
            }
        }
        sums
    }

    /// How far away the nearest splat of each pixel is.
    fn nearest(&self, splats: &[Splat]) -> Vec<f32> {
        let mut nearest = vec![f32::INFINITY; self.width * self.height];
        for splat in splats {
            for (pixel, _) in self.around(splat.place) {
                nearest[pixel] = nearest[pixel].min(splat.distance);
            }
        }
        nearest
    }
}

fn volume_part(m: &Moments) -> Moments {
    Moments { surface_x2: 0.0, surface_x: 0.0, t2: 0.0, t: 0.0, t_depth: 0.0, ..*m }
}

fn surface_part(m: &Moments) -> Moments {
    Moments { volume_x2: 0.0, volume_x: 0.0, w2: 0.0, w: 0.0, w_depth: 0.0, ..*m }
}

/// Both classes as if of the samples of the one that has fewer; nothing if one is missing, or too large for f32.
fn joined(volume: &Moments, surface: &Moments) -> Moments {
    let n = volume.n.min(surface.n);
    let mut both = Moments::default();
    if n > FEWEST_SAMPLES {
        both.add_scaled(volume, n / volume.n);
        both.add_scaled(surface, n / surface.n);
        both.n = n;
    }
    if both.to_array().iter().all(|v| v.is_finite()) { both } else { Moments::default() }
}

#[cfg(test)]
#[path = "reproject_tests.rs"]
mod tests;

//! Which pixels are clean: adaptive sampling by the difference of two halves.
//!
//! After 16, 32, 64, ... samples the halves A and B of all samples so far are compared, each as stratified as a pass is:
//! (A - B)² / n estimates the variance of one sample, of an image's noise and not of its values (samples that repeat
//! each other in different places of a pixel differ more than their means do). From the mean of the pixels around a
//! pixel follows how many samples it needs, which it then gets, in whole passes.
//!
//! **Bias.** The mean of samples that decided how many there are is biased: a pixel that looks clean has not met what is
//! rare and bright. Here a pixel's own samples never decide about it, only those of its neighbours; the pixel filter makes
//! these see all it sees. What remains is of second order: a pixel that stops is no longer measured for its neighbours,
//! and guides that learn carry what one pixel met to others. `tests/oracles/test_noise_threshold.py` measures it.

use super::block::SAMPLE_GRID;
use rayon::prelude::*;

/// Samples after which clean pixels end for the first time.
const FIRST_DECISION: u32 = SAMPLE_GRID;
/// Pixels to each side that decide about one, with weights that fall linearly: 34 degrees of freedom.
const RADIUS: i64 = 3;
/// Darker than this counts as this: less than three steps of an 8-bit display with a gamma of 2.
const DARKEST: f64 = 1e-4;

/// What is known of the noise of each pixel, row by row.
#[derive(Clone)]
pub(super) struct NoiseMap {
    width: usize,
    pub(super) pixels: Vec<PixelNoise>,
}

/// The noise of a pixel.
#[derive(Clone, Copy)]
pub(super) struct PixelNoise {
    /// Samples it is to have; no limit before the first decision.
    pub(super) wanted: u32,
    /// Samples it had when it was last measured.
    pub(super) count: u32,
    /// Their sums.
    pub(super) sums: [f64; 3],
    /// Variance of one sample, mean of the channels.
    pub(super) variance: f64,
}

impl NoiseMap {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let unknown = PixelNoise { wanted: u32::MAX, count: 0, sums: [0.0; 3], variance: 0.0 };
        Self { width: width as usize, pixels: vec![unknown; width as usize * height as usize] }
    }

    /// Whether a pixel has all samples it needs once it has `count`.
    #[inline]
    pub(super) fn is_clean(&self, x: u32, y: u32, count: u32) -> bool {
        self.pixels[y as usize * self.width + x as usize].wanted <= count
    }

    /// Whether all pixels have.
    pub(super) fn are_all_clean(&self, count: u32) -> bool {
        self.pixels.iter().all(|pixel| pixel.wanted <= count)
    }

    /// Whether the map is to be updated after `count` samples.
    pub(super) fn is_time(count: u32) -> bool {
        count.is_power_of_two() && count >= FIRST_DECISION / 2
    }

    /// Measures the pixels that have `count` samples, of which `sums_of` gives the sums by column and row, and decides how
    /// many each needs for a noise of `threshold`.
    pub(super) fn update(&mut self, count: u32, threshold: f64, sums_of: impl Fn(u32, u32) -> [f64; 3]) {
        for (at, pixel) in self.pixels.iter_mut().enumerate().filter(|(_, pixel)| pixel.wanted > count) {
            pixel.measure(count, sums_of((at % self.width) as u32, (at / self.width) as u32));
        }
        if count < FIRST_DECISION {
            return;
        }
        let needed = |(at, pixel): (usize, &PixelNoise)| match pixel.wanted > count {
            true => self.needed(at, threshold).max(count),
            false => pixel.wanted,
        };
        let wanted: Vec<u32> = self.pixels.par_iter().enumerate().map(needed).collect();
        self.pixels.iter_mut().zip(wanted).for_each(|(pixel, wanted)| pixel.wanted = wanted);
    }

    /// Samples a pixel needs, by its neighbours.
    fn needed(&self, at: usize, threshold: f64) -> u32 {
        let (width, height) = (self.width as i64, (self.pixels.len() / self.width) as i64);
        let (x, y) = ((at % self.width) as i64, (at / self.width) as i64);
        let rows = (y - RADIUS).max(0)..=(y + RADIUS).min(height - 1);
        let columns = (x - RADIUS).max(0)..=(x + RADIUS).min(width - 1);
        let (mut weights, mut variance, mut brightness) = (0.0, 0.0, 0.0);
        for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
            if (row, column) == (y, x) {
                continue;
            }
            let weight = ((RADIUS + 1 - (row - y).abs()) * (RADIUS + 1 - (column - x).abs())) as f64;
            let pixel = &self.pixels[(row * width + column) as usize];
            weights += weight;
            variance += weight * pixel.variance;
            brightness += weight * pixel.brightness();
        }
        if weights == 0.0 {
            // An image of one pixel.
            return u32::MAX;
        }
        let error = threshold * visible_error(brightness / weights);
        let n = variance / weights / (error * error);
        // Saturates; what is no number gets all samples.
        if n.is_nan() {
            u32::MAX
        } else {
            (n.ceil() as u32).checked_next_multiple_of(SAMPLE_GRID).unwrap_or(u32::MAX)
        }
    }
}

/// What a threshold of 1 allows as standard error where the image has this brightness. An error of T√L is the same step,
/// T/2 of white, at any brightness of a display with a gamma of 2; above white it is relative.
fn visible_error(brightness: f64) -> f64 {
    let brightness = brightness.max(DARKEST);
    brightness.max(brightness.sqrt())
}

impl PixelNoise {
    fn brightness(&self) -> f64 {
        self.sums.iter().sum::<f64>() / (3.0 * f64::from(self.count.max(1)))
    }

    /// Takes the sums of `count` samples, the first half of which is known.
    fn measure(&mut self, count: u32, sums: [f64; 3]) {
        if count == 2 * self.count {
            let squares =
                sums.iter().zip(self.sums).map(|(all, first)| (all - 2.0 * first) * (all - 2.0 * first));
            self.variance = squares.sum::<f64>() / (3.0 * f64::from(count));
        }
        (self.count, self.sums) = (count, sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_math::random::Pcg;

    const SIZE: u32 = 24;

    /// Uniform noise around 0.5, of this standard deviation a sample in the left half and of a quarter in the right one.
    fn run(deviation: f64, threshold: f64, limit: u32) -> NoiseMap {
        let mut map = NoiseMap::new(SIZE, SIZE);
        let mut rng = Pcg::new(&[7]);
        let mut sums = vec![[0.0; 3]; (SIZE * SIZE) as usize];
        let mut count = 0;
        while count < limit && !map.are_all_clean(count) {
            for (at, sum) in sums.iter_mut().enumerate() {
                let (x, y) = (at as u32 % SIZE, at as u32 / SIZE);
                if map.is_clean(x, y, count) {
                    continue;
                }
                for _ in 0..16 {
                    let noise = (f64::from(rng.next_f32()) - 0.5) * 12f64.sqrt() * deviation;
                    let noise = if x < SIZE / 2 { noise } else { noise / 4.0 };
                    sum.iter_mut().for_each(|sum| *sum += 0.5 + noise);
                }
            }
            count += 16;
            if NoiseMap::is_time(count) {
                map.update(count, threshold, |x, y| sums[(y * SIZE + x) as usize]);
            }
        }
        map
    }

    #[test]
    fn pixels_get_what_their_neighbourhood_needs() {
        // A standard error of .02 √.5 takes 450 samples of deviation .3, and 28 of a quarter of that.
        let map = run(0.3, 0.02, 4096);
        let mean = |columns: std::ops::Range<u32>| {
            let n = columns.len() as f64 * f64::from(SIZE);
            let of_row = |y: u32| columns.clone().map(move |x| (x, y)).collect::<Vec<_>>();
            let wanted = (0..SIZE)
                .flat_map(of_row)
                .map(|(x, y)| f64::from(map.pixels[(y * SIZE + x) as usize].wanted));
            wanted.sum::<f64>() / n
        };
        let (noisy, quiet) = (mean(0..SIZE / 2 - 4), mean(SIZE / 2 + 4..SIZE));
        assert!((360.0..560.0).contains(&noisy), "{noisy}");
        assert!((32.0..64.0).contains(&quiet), "{quiet}");
    }

    #[test]
    fn a_pixel_never_decides_about_itself() {
        let sums = |x: u32, y: u32| [f64::from(x * 31 % 7), f64::from(y * 17 % 5), 1.0];
        let decided = |outlier: f64| {
            let mut map = NoiseMap::new(9, 9);
            for count in [16, 32] {
                map.update(count, 0.01, |x, y| {
                    if (x, y) == (4, 4) { [outlier * f64::from(count * count); 3] } else { sums(x, y) }
                });
            }
            map.pixels[4 * 9 + 4].wanted
        };
        assert_eq!(decided(0.0), decided(1e9));
    }

    #[test]
    fn odd_images_are_decided_too() {
        for value in [0.0, 1e-30, 1e30, f64::INFINITY] {
            for (w, h) in [(1, 1), (1, 9), (9, 1)] {
                let mut map = NoiseMap::new(w, h);
                map.update(16, 0.01, |_, _| [value; 3]);
                map.update(32, 0.01, |_, _| [2.0 * value; 3]);
                let is_constant = value.is_finite() && w * h > 1;
                assert_eq!(map.are_all_clean(32), is_constant, "{value} {w}x{h}");
            }
        }
    }
}

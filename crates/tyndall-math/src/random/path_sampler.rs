//! The random numbers of one camera path.

use super::{Pcg, hash_key, sobol};
use glam::Vec2;

/// Sets of four Sobol dimensions given out before the sampler falls back to a PCG stream. Beyond the camera, the first
/// vertex and the second light vertices stratification no longer pays for its cost.
const SOBOL_SETS: usize = 4;

/// Gives out the numbers of the path (seed, pixel, sample) in a fixed order.
#[derive(Debug, Clone)]
pub struct PathSampler {
    /// Scrambling seed of this pixel and block of 65,536 samples.
    scramble: u32,
    /// Index inside the block (`sobol_burley` is only defined below 2^16), shuffled by the seed, bits reversed.
    index: u32,
    next_set: usize,
    key: [u64; 3],
    tail: Option<Pcg>,
}

impl PathSampler {
    /// The sampler of sample number `sample` of `pixel` (any unique number of the pixel).
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let scramble = hash_key(&[seed, pixel, sample >> 16]) as u32;
        let index = sobol::shuffled_index((sample & 0xffff) as u32, scramble);
        Self { scramble, index, next_set: 0, key: [seed, pixel, sample], tail: None }
    }

    /// The next four numbers, each uniform in [0, 1).
    #[inline]
    pub fn next_4d(&mut self) -> [f32; 4] {
        let set = self.next_set;
        self.next_set += 1;
        if set < SOBOL_SETS {
            return sobol::sample_4d(self.index, set, self.scramble);
        }
        let key = self.key;
        let tail = self.tail.get_or_insert_with(|| Pcg::new(&[key[0], key[1], key[2], u64::MAX]));
        [tail.next_f32(), tail.next_f32(), tail.next_f32(), tail.next_f32()]
    }

    /// The next two numbers; the rest of their set of four is not used.
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        let [x, y, ..] = self.next_4d();
        Vec2::new(x, y)
    }

    /// A stream of unbounded length for `purpose` (any number unique within the path, such as the segment's index).
    #[inline]
    pub fn stream(&self, purpose: u64) -> Pcg {
        Pcg::new(&[self.key[0], self.key[1], self.key[2], purpose])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_a_pure_function_of_its_key() {
        let draw = |pixel, sample| {
            let mut s = PathSampler::new(5, pixel, sample);
            (0..20).map(|_| s.next_4d()).collect::<Vec<_>>()
        };
        assert_eq!(draw(3, 9), draw(3, 9));
        assert_ne!(draw(3, 9), draw(4, 9));
        assert_ne!(draw(3, 9), draw(3, 9 + 65_536));
    }

    #[test]
    fn sixteen_samples_stratify_sixteen_cells() {
        for pixel in 0..50 {
            let mut seen = [0; 16];
            for sample in 0..16 {
                let p = PathSampler::new(0, pixel, sample).next_2d();
                seen[(p.x * 4.0) as usize * 4 + (p.y * 4.0) as usize] += 1;
            }
            assert_eq!(seen, [1; 16]);
        }
    }

    #[test]
    fn the_mean_keeps_converging_past_the_sobol_block() {
        let n = 70_000u64;
        let sum: f64 = (0..n).map(|i| f64::from(PathSampler::new(1, 2, i + (1 << 33)).next_2d().x)).sum();
        assert!((sum / n as f64 - 0.5).abs() < 1e-3);
    }
}

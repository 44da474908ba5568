//! A PCG32 stream keyed by its purpose.

use super::hash_key;
use rand_core::Rng;
use rand_pcg::Pcg32;

/// A sequence of random numbers of unbounded length, determined by its key alone.
#[derive(Debug, Clone)]
pub struct Pcg {
    stream: Pcg32,
    /// Given out before the stream goes on.
    lead: Option<u32>,
}

impl Pcg {
    /// The stream of `key`; different keys give independent streams.
    #[inline]
    pub fn new(key: &[u64]) -> Self {
        let state = hash_key(key);
        Self { stream: Pcg32::new(state, state.rotate_left(32) ^ 0xda3e_39cb_94b9_5bdb), lead: None }
    }

    /// Makes the next number drawn `u` in [0, 1), one of a stratified set; its 23 bits are filled up with random ones.
    #[inline]
    pub fn lead_with(&mut self, u: f32) {
        let stratified = (u * 8_388_608.0) as u32;
        self.lead = Some(stratified << 9 | self.stream.next_u32() >> 23);
    }

    /// The next 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        match self.lead.take() {
            Some(lead) => lead,
            None => self.stream.next_u32(),
        }
    }

    /// The next number, uniform in [0, 1).
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// The next exponentially distributed number with mean 1, finite and non-negative.
    #[inline]
    pub fn next_exponential(&mut self) -> f32 {
        // 1 - u is in (0, 1]: the logarithm is finite. 32 bits rather than 24, so that long free flights exist.
        -(1.0 - self.next_u32() as f32 * (1.0 / 4_294_967_296.0)).max(1.0 / 4_294_967_296.0).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_and_exponential_have_their_moments() {
        let mut rng = Pcg::new(&[1, 2, 3]);
        let n = 400_000;
        let (mut u, mut e) = (0.0, 0.0);
        for _ in 0..n {
            let x = rng.next_f32();
            assert!((0.0..1.0).contains(&x));
            u += f64::from(x);
            e += f64::from(rng.next_exponential());
        }
        let n = f64::from(n);
        assert!((u / n - 0.5).abs() < 4.0 / (12.0 * n).sqrt());
        assert!((e / n - 1.0).abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn a_lead_comes_first_and_once() {
        let mut rng = Pcg::new(&[7]);
        for u in [0.0, 0.25, 0.5, 0.999_999] {
            rng.lead_with(u);
            let drawn = rng.next_f32();
            assert!((drawn - u).abs() < 2.4e-7, "{drawn} for {u}");
            assert_ne!(rng.next_f32(), drawn);
        }
    }

    #[test]
    fn neighbouring_keys_are_unrelated() {
        let mut equal = 0;
        for i in 0..1000u64 {
            let (a, b) = (Pcg::new(&[0, i]).next_u32(), Pcg::new(&[0, i + 1]).next_u32());
            equal += (a ^ b).count_ones();
        }
        assert!((15_000..17_000).contains(&equal), "{equal} differing bits of 32,000");
    }
}

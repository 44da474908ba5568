//! Choosing between colour channels, and random numbers of the walks.

use glam::Vec3A;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;

/// Probabilities proportional to |`throughput`|, adding up to one; `None` if no channel is alive.
#[inline]
pub(super) fn channel_weights(throughput: Rgb) -> Option<Vec3A> {
    let magnitude = throughput.abs();
    let magnitude = Rgb::select(magnitude.cmpge(Rgb::ZERO), magnitude.min(Rgb::splat(f32::MAX)), Rgb::ZERO);
    let largest = magnitude.max_element();
    if largest == 0.0 {
        return None;
    }
    let scaled = magnitude / largest;
    Some(scaled / (scaled.x + scaled.y + scaled.z))
}

/// A channel drawn with the given probabilities.
#[inline]
pub(super) fn choose_channel(channels: Vec3A, rng: &mut Pcg) -> usize {
    let u = rng.next_f32();
    if u < channels.x {
        0
    } else if u < channels.x + channels.y || channels.z == 0.0 {
        if channels.y > 0.0 { 1 } else { 0 }
    } else {
        2
    }
}

/// An exponentially distributed number with mean 1 whose small values are exact to their last digit: the optical
/// depth at which very thin media scatter.
#[inline]
pub(super) fn exponential(rng: &mut Pcg) -> f32 {
    const SCALE: f32 = 1.0 / 4_294_967_296.0;
    let bits = rng.next_u32();
    if bits >> 31 == 0 {
        let u = if bits == 0 { rng.next_u32() as f32 * SCALE * SCALE } else { bits as f32 * SCALE };
        -(-u).ln_1p()
    } else {
        -((!bits) as f32 * SCALE + 0.5 * SCALE).ln()
    }
}

/// Roulette by length: called every [`super::LONG_WALK`] candidates. The weight doubles for those who survive.
#[cold]
pub(crate) fn survives_length(rng: &mut Pcg) -> bool {
    rng.next_u32() & 1 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_depths_have_the_right_probability() {
        // P(x < 1e-6) = 1e-6 within four standard errors of 2e8 / 1e6 = 200 events would be slow; test the mean of
        // x below 2^-10 instead, where a 24-bit logarithm is off by quantisation.
        let mut rng = Pcg::new(&[3]);
        let (n, limit) = (4_000_000, 1.0 / 1024.0);
        let hits = (0..n).filter(|_| exponential(&mut rng) < limit).count() as f64;
        let expected = f64::from(n) * -(-f64::from(limit)).exp_m1();
        assert!((hits - expected).abs() < 4.0 * expected.sqrt(), "{hits} for {expected}");
    }

    #[test]
    fn dead_channels_are_never_chosen() {
        let mut rng = Pcg::new(&[4]);
        for (beta, dead) in
            [(Rgb::new(0.0, 1.0, 1.0), 0), (Rgb::new(1.0, 0.0, 2.0), 1), (Rgb::new(3.0, 1.0, 0.0), 2)]
        {
            let channels = channel_weights(beta).unwrap();
            assert!((0..10_000).all(|_| choose_channel(channels, &mut rng) != dead));
        }
        assert!(channel_weights(Rgb::new(f32::NAN, 0.0, 0.0)).is_none());
        assert!(channel_weights(Rgb::splat(f32::INFINITY)).unwrap().is_finite());
    }
}

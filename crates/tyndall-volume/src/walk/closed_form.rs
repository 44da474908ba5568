//! Integrals over a piece of constant coefficients.

use tyndall_math::Rgb;

/// ∫_0^dt exp(-σ t) dt = (1 - exp(-σ dt)) / σ, per channel, with its limits `dt` for σ → 0 and 1/σ for dt → ∞.
///
/// Both at once have no finite value; it reads 0.
#[inline]
pub(super) fn mean_free_integral(sigma: Rgb, dt: f32) -> Rgb {
    let channel = |sigma: f32| {
        let tau = sigma * dt;
        match tau {
            tau if tau < 1e-30 || tau.is_nan() => {
                if dt.is_finite() {
                    dt
                } else {
                    0.0
                }
            }
            tau if tau > 30.0 => 1.0 / sigma,
            tau => dt * (-(-tau).exp_m1() / tau),
        }
    };
    Rgb::new(channel(sigma.x), channel(sigma.y), channel(sigma.z))
}

/// exp(-σ dt) per channel; 1 where σ is 0, also for infinite `dt`.
#[inline]
pub(super) fn attenuation(sigma: Rgb, dt: f32) -> Rgb {
    (-optical_depth(sigma, dt)).exp()
}

/// σ dt per channel; 0 where σ is 0, also for infinite `dt`.
#[inline]
pub(super) fn optical_depth(sigma: Rgb, dt: f32) -> Rgb {
    Rgb::select(sigma.cmpgt(Rgb::ZERO), sigma * dt, Rgb::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_is_right_over_24_decades() {
        for sigma in [1e-12f32, 1e-6, 1e-3, 1.0, 1e3, 1e12] {
            for dt in [1e-6f32, 1.0, 1e6] {
                let (s, d) = (f64::from(sigma), f64::from(dt));
                let exact = -(-s * d).exp_m1() / s;
                let got = f64::from(mean_free_integral(Rgb::splat(sigma), dt).x);
                assert!((got / exact - 1.0).abs() < 1e-6, "{sigma} {dt}: {got} for {exact}");
            }
            assert!((mean_free_integral(Rgb::splat(sigma), f32::INFINITY).x * sigma - 1.0).abs() < 1e-6);
        }
        assert_eq!(mean_free_integral(Rgb::ZERO, 2.0), Rgb::splat(2.0));
        assert_eq!(attenuation(Rgb::ZERO, f32::INFINITY), Rgb::ONE);
    }
}

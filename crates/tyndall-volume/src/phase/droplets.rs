//! Water droplets of fog and cloud: Jendersie & d'Eon 2023, "An Approximate Mie Scattering Function for Fog and Cloud
//! Rendering", doi:10.1145/3587421.3595409.
//!
//! The Lorenz-Mie phase function of droplets of one diameter d, averaged over the visible spectrum, is fitted by
//! (1 - w) Henyey-Greenstein(g_HG) + w Draine(g_D, α). The paper fits 5 µm < d < 50 µm (equations 4 to 7); its
//! supplement goes on to smaller particles in three ranges, down to d = 0, which is Rayleigh scattering.

use super::{Draine, Phase, PhaseMix};

/// Diameters above this, in micrometres, count as this: the fit ends there, and so does what g of an f32 lobe resolves.
pub const MAX_DROPLET_DIAMETER: f32 = 50.0;

/// The parameters of the mixture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DropletFit {
    /// Of the Henyey-Greenstein lobe: the diffraction peak.
    pub g_hg: f64,
    /// Of Draine's lobe.
    pub g_draine: f64,
    /// Of Draine's lobe.
    pub alpha: f64,
    /// Part of the light in Draine's lobe.
    pub draine_weight: f64,
}

impl DropletFit {
    /// The fit for a diameter in micrometres, clamped to [0, [`MAX_DROPLET_DIAMETER`]]; NaN reads as 0.
    pub fn of_diameter(diameter: f32) -> Self {
        let d = if diameter.is_nan() { 0.0 } else { f64::from(diameter.clamp(0.0, MAX_DROPLET_DIAMETER)) };
        match d {
            d if d <= 0.1 => Self::tiny(d),
            d if d < 1.5 => Self::small(d.ln()),
            d if d < 5.0 => Self::medium(d.ln()),
            d => Self::large(d),
        }
    }

    fn tiny(d: f64) -> Self {
        Self {
            g_hg: 13.8 * d * d,
            g_draine: 1.1456 * d * (9.29044 * d).sin(),
            alpha: 250.0,
            draine_weight: 0.252_977 - 312.983 * d.powf(4.3),
        }
    }

    fn small(ln_d: f64) -> Self {
        let inner = (ln_d - 0.238_604) * (ln_d + 1.00667) / (0.507_522 - 0.15677 * ln_d);
        Self {
            g_hg: 0.862 - 0.143 * ln_d * ln_d,
            g_draine: 0.379_685 * (1.19692 * inner.cos() + 1.37932 * ln_d + 0.062_583_5).cos() + 0.344_213,
            alpha: 250.0,
            draine_weight: 0.146_209 * (3.38707 * ln_d + 2.11193).cos() + 0.316_072 + 0.077_891_7 * ln_d,
        }
    }

    fn medium(ln_d: f64) -> Self {
        Self {
            g_hg: 0.060_493_1 * ln_d.ln() + 0.940_256,
            g_draine: 0.500_411 - 0.081_287 / (-2.0 * ln_d + ln_d.tan() + 1.27551),
            alpha: 7.30354 * ln_d + 6.31675,
            draine_weight: 0.026_914 * (ln_d - (5.68947 * (ln_d.ln() - 0.029_214_9)).cos()) + 0.376_475,
        }
    }

    /// Equations 4 to 7.
    fn large(d: f64) -> Self {
        Self {
            g_hg: (-0.099_056_7 / (d - 1.67154)).exp(),
            g_draine: (-2.20679 / (d + 3.91029) - 0.428_934).exp(),
            alpha: (3.62489 - 8.29288 / (d + 5.52825)).exp(),
            draine_weight: (-0.599_085 / (d - 0.641_583) - 0.665_888).exp(),
        }
    }
}

impl PhaseMix {
    /// Water droplets of this diameter in micrometres: fog and clouds have 5 to 50. See [`DropletFit::of_diameter`].
    pub fn droplets(diameter: f32) -> Self {
        let fit = DropletFit::of_diameter(diameter);
        let weight = fit.draine_weight as f32;
        let draine = Draine { g: fit.g_draine as f32, alpha: fit.alpha as f32 };
        Self::of_two(Phase::henyey_greenstein(fit.g_hg as f32), draine.into(), weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_particles_scatter_as_rayleigh() {
        let mix = PhaseMix::droplets(0.0);
        for cos in [-1.0, -0.5, 0.0, 0.3, 1.0] {
            let rayleigh = Phase::Rayleigh(super::super::Rayleigh).eval(cos);
            assert!((mix.eval(cos) / rayleigh - 1.0).abs() < 0.01, "{cos}: {} {rayleigh}", mix.eval(cos));
        }
    }

    /// Against Lorenz-Mie series (Bohren & Huffman 1983, appendix A) for water, n = 1.334, weighted by scattering
    /// efficiency over 400 to 700 nm.
    #[test]
    fn droplets_have_the_mean_cosine_of_the_series() {
        let series = [
            (0.05, 0.0198),
            (0.5, 0.7681),
            (1.0, 0.8413),
            (3.0, 0.7986),
            (5.0, 0.8333),
            (10.0, 0.8509),
            (20.0, 0.8657),
            (50.0, 0.8754),
        ];
        for (diameter, expected) in series {
            let g = PhaseMix::droplets(diameter).mean_cosine();
            // The paper fits the shape, not the mean, and averages over more sizes: below 5 µm, where single sizes
            // resonate, that shows.
            let tolerance = if diameter < 5.0 { 0.06 } else { 0.02 };
            assert!((g - expected).abs() < tolerance, "{diameter} µm: {g} for {expected}");
        }
    }

    #[test]
    fn every_diameter_is_a_phase_function() {
        for i in 0..=600 {
            let diameter = 0.1 * i as f32;
            let fit = DropletFit::of_diameter(diameter);
            assert!(
                (0.0..1.0).contains(&fit.g_hg) && (-0.1..1.0).contains(&fit.g_draine),
                "{diameter} {fit:?}"
            );
            assert!((0.0..=1.0).contains(&fit.draine_weight) && fit.alpha >= 0.0, "{diameter} {fit:?}");
        }
        let of = DropletFit::of_diameter;
        assert_eq!(of(f32::NAN), of(0.0));
        assert_eq!(of(-3.0), of(0.0));
        assert_eq!(of(f32::INFINITY), of(50.0));
    }

    /// The ranges meet: their ends differ by what the fits are off.
    #[test]
    fn ranges_join() {
        for border in [0.1f32, 1.5, 5.0] {
            let [below, above] = [0.9999, 1.0001].map(|f| PhaseMix::droplets(border * f).mean_cosine());
            assert!((below - above).abs() < 0.03, "{border}: {below} {above}");
        }
    }
}

//! The light of hot bodies: Planck's law to linear Rec.709.
//!
//! A body of T kelvin emits `1e-6 σ T^4 / π` (Stefan-Boltzmann; in MW m^-2 sr^-1, i.e. 0.0914 at 1500 K) times its
//! colour. The colour comes from Planck's law and the CIE 1931 observer, and its luminance is 1: temperature sets the
//! hue, and the brightness grows with T^4 alone. Cycles' principled volume has the same formula; physically, the part
//! of the radiation that is visible grows faster still.

mod cie_1931;

use crate::{Rgb, luminance};
use std::sync::LazyLock;

/// Stefan-Boltzmann constant over π, in MW m^-2 sr^-1 K^-4 (SI 2019).
pub const RADIANCE_PER_T4: f64 = 5.670_374_419e-8 * 1e-6 / std::f64::consts::PI;
/// Below this temperature in kelvin the colour stays what it is here, a deep red.
pub const COLDEST: f32 = 500.0;
/// Above this temperature in kelvin the colour stays what it is here, a pale blue.
pub const HOTTEST: f32 = 40_000.0;

/// h c / k in nm K (SI 2019).
const C2: f64 = 1.438_776_877e7;
/// Linear Rec.709 from CIE XYZ: ITU-R BT.709 primaries, white D65.
const REC709_FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_969_94, -1.537_383_18, -0.498_610_76],
    [-0.969_243_64, 1.875_967_50, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_51],
];

/// Entries of the table, equally spaced in 1 / T, in which the colour is smooth.
const N: usize = 512;
static COLORS: LazyLock<Vec<Rgb>> =
    LazyLock::new(|| (0..N).map(|i| planckian(1.0 / f64::from(reciprocal(i)))).collect());

/// Colour of a body of `kelvin`, linear Rec.709 with luminance 1. Channels that Rec.709 cannot show are cut at 0, which
/// happens below 1900 K, and the others rescaled. Outside [[`COLDEST`], [`HOTTEST`]] the colour stays; NaN is coldest.
#[inline]
pub fn blackbody_color(kelvin: f32) -> Rgb {
    let kelvin = if kelvin.is_nan() { COLDEST } else { kelvin.clamp(COLDEST, HOTTEST) };
    let (first, last) = (reciprocal(0), reciprocal(N - 1));
    let x = ((kelvin.recip() - first) / (last - first)).clamp(0.0, 1.0) * (N - 1) as f32;
    let i = (x as usize).min(N - 2);
    COLORS[i].lerp(COLORS[i + 1], x - i as f32)
}

/// Radiance of a body of `kelvin`, linear Rec.709, in MW m^-2 sr^-1: [`RADIANCE_PER_T4`] T^4 times
/// [`blackbody_color`]. 0 for temperatures that are not positive numbers.
#[inline]
pub fn blackbody_radiance(kelvin: f32) -> Rgb {
    if !(kelvin > 0.0 && kelvin.is_finite()) {
        return Rgb::ZERO;
    }
    // T^4 of a temperature that f32 can hold may be infinite; emission per length is cut elsewhere.
    let t4 = f64::from(kelvin).powi(4);
    blackbody_color(kelvin) * ((RADIANCE_PER_T4 * t4).min(f64::from(f32::MAX) / 16.0) as f32)
}

/// 1 / T of table entry `i`.
#[inline]
fn reciprocal(i: usize) -> f32 {
    let (hot, cold) = (1.0 / HOTTEST, 1.0 / COLDEST);
    hot + (cold - hot) * (i as f32 / (N - 1) as f32)
}

/// CIE XYZ of Planck's law, up to a factor.
fn xyz(kelvin: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (i, row) in cie_1931::XYZ.iter().enumerate() {
        let nm = cie_1931::FIRST + cie_1931::STEP * i as f64;
        let planck = (nm / 560.0).powi(-5) / (C2 / (nm * kelvin)).exp_m1();
        for (sum, matching) in sum.iter_mut().zip(row) {
            *sum += planck * matching;
        }
    }
    sum
}

fn planckian(kelvin: f64) -> Rgb {
    let xyz = xyz(kelvin);
    let channel = |row: &[f64; 3]| (row.iter().zip(&xyz).map(|(m, c)| m * c / xyz[1]).sum::<f64>()).max(0.0);
    let color = Rgb::from_array(REC709_FROM_XYZ.each_ref().map(|row| channel(row) as f32));
    color / luminance(color)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Illuminant A is 2856 K; the others are points of the Planckian locus.
    #[test]
    fn chromaticities_are_the_known_ones() {
        for (kelvin, x, y) in [(2856.0, 0.4475, 0.4074), (6500.0, 0.3135, 0.3237), (2000.0, 0.5267, 0.4133)] {
            let [cx, cy, cz] = xyz(kelvin);
            let sum = cx + cy + cz;
            assert!(
                (cx / sum - x).abs() < 1e-4 && (cy / sum - y).abs() < 1e-4,
                "{kelvin}: {}, {}",
                cx / sum,
                cy / sum
            );
        }
    }

    #[test]
    fn the_table_agrees_with_the_integral() {
        for i in 0..=2000 {
            let kelvin = 500.0 * 80f64.powf(f64::from(i) / 2000.0);
            let (found, exact) = (blackbody_color(kelvin as f32), planckian(kelvin));
            let difference = (found - exact).abs().max_element();
            assert!(difference < 1e-3 * exact.max_element(), "{kelvin} K: {found} for {exact}");
        }
    }

    /// Cycles, `svm_math_blackbody_color_rec709`, where no channel is cut.
    #[test]
    fn colours_are_those_of_a_peer() {
        for (kelvin, peer) in [
            (3315.0, [1.6318, 0.8777, 0.3559]),
            (6500.0, [1.0426, 0.9841, 1.0353]),
            (12_000.0, [0.8263, 0.9945, 1.5663]),
        ] {
            let difference = (blackbody_color(kelvin) - Rgb::from_array(peer)).abs().max_element();
            assert!(difference < 0.02, "{kelvin} K: {}", blackbody_color(kelvin));
        }
    }

    #[test]
    fn radiance_follows_stefan_and_boltzmann() {
        for kelvin in [1.0f32, 300.0, 900.0, 1500.0, 6500.0, 1e5] {
            let expected = 5.670_374e-14 / std::f64::consts::PI * f64::from(kelvin).powi(4);
            let found = f64::from(luminance(blackbody_radiance(kelvin)));
            assert!((found / expected - 1.0).abs() < 1e-5, "{kelvin}: {found} for {expected}");
        }
        assert!((luminance(blackbody_radiance(1500.0)) - 0.091_375).abs() < 1e-5);
    }

    #[test]
    fn no_temperature_is_too_odd() {
        for kelvin in [0.0, -300.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(blackbody_radiance(kelvin), Rgb::ZERO);
            assert!(blackbody_color(kelvin).is_finite());
        }
        assert!(blackbody_radiance(f32::MAX).is_finite());
        assert!(blackbody_color(1500.0).min_element() >= 0.0);
    }
}

//! Products of a mixture with what a vertex does to light: in closed form, lobe by lobe.

use super::lanes::Lanes;
use super::mixture::{Group, VmfMixture};
use super::vmf::{MAX_CONCENTRATION, VmfLobe, concentration_from_mean_cosine, mean_cosines, peak_densities};
use glam::Vec3A;
use tyndall_math::INV_4PI;

/// Concentration of the lobe that stands for a cosine: it minimises the variance of sampling the cosine with it (1.13 for 1).
const COSINE_KAPPA: f32 = 2.64;

/// What the weights of products may depend on.
struct Factors {
    /// π_k.
    weight: Lanes,
    /// κ_k.
    kappa: Lanes,
    /// 1 - μ_k · axis.
    one_minus_cos: Lanes,
    /// π_k ∫ v_k v dω.
    integral: Lanes,
}

impl VmfMixture {
    /// The mixture proportional to its product with `other`, and the integral of that product. A product that vanishes
    /// to f32 leaves the mixture as it is, and integrates to 0.
    #[inline]
    pub fn product(&self, other: &VmfLobe) -> (Self, f32) {
        self.product_weighted(other, |factors| factors.integral)
    }

    /// The mixture times the cosine to the unit vector `normal`, and the integral of that product. Some density stays
    /// below the horizon: 7 % of it if light comes from everywhere.
    #[inline]
    pub fn product_with_cosine(&self, normal: Vec3A) -> (Self, f32) {
        let cosine = VmfLobe::new(normal, COSINE_KAPPA);
        let (mixture, integral) = self.product(&cosine);
        // ∫ max(cos, 0) dω = π.
        (mixture, integral * std::f32::consts::PI)
    }

    /// The mixture times a Henyey–Greenstein phase function of mean cosine `g`, and the integral of that product, for
    /// light that goes on to the unit vector `wo`: the phase function peaks at `-wo` for g > 0.
    ///
    /// Shapes are products with the lobe of mean cosine |g|. That lobe has neither the peak nor the tails, which narrow lobes
    /// see: their weights come from the phase function blurred by the lobe. Coefficients of degree one multiply, which makes
    /// that about a Henyey–Greenstein function of mean cosine g·A(κ_k). Weights go over from the one to the other with κ_k,
    /// and are within a factor of about two for |g| up to 0.9. To be mixed with sampling the phase function itself.
    #[inline]
    pub fn product_with_hg(&self, wo: Vec3A, g: f32) -> (Self, f32) {
        let g = if g.is_nan() { 0.0 } else { g.clamp(-0.999, 0.999) };
        let axis = if g > 0.0 { -wo } else { wo };
        let lobe = VmfLobe::new(axis, concentration_from_mean_cosine(g.abs()));
        let broad = Lanes::splat(5.0 * lobe.kappa() + f32::MIN_POSITIVE);
        self.product_weighted(&lobe, |factors| {
            let (one, blurred) = (Lanes::splat(1.0), mean_cosines(factors.kappa) * g.abs());
            // (1 - g)² + 2g(1 - cos): the denominator of the phase function without cancellation.
            let square = (one - blurred) * (one - blurred) + blurred * factors.one_minus_cos * 2.0;
            let phase = (one - blurred * blurred) * INV_4PI / (square * square.sqrt());
            (factors.kappa * factors.weight * phase + broad * factors.integral) / (factors.kappa + broad)
        })
    }

    /// Lobes are products with `other`, their weights what `weigh` says.
    #[inline(always)]
    fn product_weighted(&self, other: &VmfLobe, weigh: impl Fn(&Factors) -> Lanes) -> (Self, f32) {
        if self.is_empty() {
            return (Self::from_lobes([(1.0, *other)]), INV_4PI);
        }
        let kappa_2 = Lanes::splat(other.kappa());
        self.map_groups(|_, lobes| {
            // The same steps as `VmfLobe::product`.
            let axis = other.mean().to_array();
            let sum: [Lanes; 3] = std::array::from_fn(|i| lobes.mean[i] * lobes.kappa + kappa_2 * axis[i]);
            let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
            let one_minus_cos = lobes.one_minus_cos(other.mean());
            let total = (lobes.kappa + kappa_2 + length).max(Lanes::splat(f32::MIN_POSITIVE));
            let loss = lobes.kappa * kappa_2 * one_minus_cos * -2.0 / total;
            let peaks = lobes.weighted_peak * other.peak() / peak_densities(length);
            let integral = peaks * loss.exp_nonpositive();
            let factors = Factors { weight: lobes.weight, kappa: lobes.kappa, one_minus_cos, integral };
            // Shorter sums are uniform lobes, and too short to be divided by.
            let inverse = Lanes::splat(1.0) / length.max(Lanes::splat(1e-12));
            let mean = std::array::from_fn(|i| length.if_above(1e-12, sum[i] * inverse, lobes.mean[i]));
            let kappa = length.min(Lanes::splat(MAX_CONCENTRATION));
            Group { weight: weigh(&factors), kappa, mean, ..lobes }
        })
    }
}

#[cfg(test)]
#[path = "product_tests.rs"]
mod tests;

//! Products of a mixture with what a vertex does to light: in closed form, lobe by lobe.
//!
//! Whoever mixes a product with sampling the vertex alone needs only a part of it. A lobe much broader than the phase
//! function (or the cosine) changes nothing about it: their product *is* the phase function, and better sampled as that. A
//! much narrower one stays what it is. [`VmfMixture::narrower_than_hg`] keeps of each lobe the part κ/(κ + κ_v), κ_v being
//! the vertex's concentration, and says how much that is of all: where light comes from everywhere there is nothing to be
//! guided to, and no weight to be lost (error of guided over unguided images with such shares, and with one half
//! throughout: underwater .67, .75; landscape 1.20, 1.39; jungle 1.06, 1.10; kitchen .83, .83; cloud 1.16, 1.11).

use super::lanes::Lanes;
use super::mixture::{Group, VmfMixture};
use super::vmf::{MAX_CONCENTRATION, VmfLobe, mean_cosines, nearly_concentration, peak_densities};
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

/// A mixture times one more lobe.
struct Product {
    mixture: VmfMixture,
    /// Integral of the whole product.
    integral: f32,
    /// Part of the integral that the mixture stands for.
    share: f32,
}

impl VmfMixture {
    /// The mixture proportional to its product with `other`, and the integral of that product. A product that vanishes
    /// to f32 leaves the mixture as it is, and integrates to 0.
    #[inline]
    pub fn product(&self, other: &VmfLobe) -> (Self, f32) {
        let product =
            self.product_weighted(other, |factors| factors.integral, |_| Lanes::splat(1.0), |_, lobes| lobes);
        (product.mixture, product.integral)
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
        let product = self.hg_product(wo, g, |_, _| Lanes::splat(1.0), |_, lobes| lobes);
        (product.mixture, product.integral)
    }

    /// What is narrower than the cosine in [`Self::product_with_cosine`] of these lobes after `change`, and its share in
    /// that product. (One step: vertices ask this of lobes that they see from where they are.)
    #[inline(always)]
    pub(crate) fn narrower_than_cosine(
        &self,
        normal: Vec3A,
        change: impl Fn(usize, Group) -> Group,
    ) -> (Self, f32) {
        let cosine = VmfLobe::new(normal, COSINE_KAPPA);
        let keep = |kappa| kept(kappa, COSINE_KAPPA);
        let product = self.product_weighted(&cosine, |factors| factors.integral, keep, change);
        (product.mixture, product.share)
    }

    /// What is narrower than the phase function in [`Self::product_with_hg`] of these lobes after `change`, and its share
    /// in that product.
    #[inline(always)]
    pub(crate) fn narrower_than_hg(
        &self,
        wo: Vec3A,
        g: f32,
        change: impl Fn(usize, Group) -> Group,
    ) -> (Self, f32) {
        let product = self.hg_product(wo, g, kept, change);
        (product.mixture, product.share)
    }

    #[inline(always)]
    fn hg_product(
        &self,
        wo: Vec3A,
        g: f32,
        keep: impl Fn(Lanes, f32) -> Lanes,
        change: impl Fn(usize, Group) -> Group,
    ) -> Product {
        let g = if g.is_nan() { 0.0 } else { g.clamp(-0.999, 0.999) };
        let axis = if g > 0.0 { -wo } else { wo };
        let lobe = VmfLobe::new(axis, nearly_concentration(g.abs()));
        let broad = Lanes::splat(5.0 * lobe.kappa() + f32::MIN_POSITIVE);
        let weigh = |factors: &Factors| {
            let (one, blurred) = (Lanes::splat(1.0), mean_cosines(factors.kappa) * g.abs());
            // (1 - g)² + 2g(1 - cos): the denominator of the phase function without cancellation.
            let square = (one - blurred) * (one - blurred) + blurred * factors.one_minus_cos * 2.0;
            let phase = (one - blurred * blurred) * INV_4PI / (square * square.sqrt());
            (factors.kappa * factors.weight * phase + broad * factors.integral) / (factors.kappa + broad)
        };
        self.product_weighted(&lobe, weigh, |kappa| keep(kappa, lobe.kappa()), change)
    }

    /// Lobes are products of the changed ones with `other`, their weights what `weigh` says, of which they get the part that `keep` says of
    /// their concentration.
    #[inline(always)]
    fn product_weighted(
        &self,
        other: &VmfLobe,
        weigh: impl Fn(&Factors) -> Lanes,
        keep: impl Fn(Lanes) -> Lanes,
        change: impl Fn(usize, Group) -> Group,
    ) -> Product {
        if self.is_empty() {
            return Product {
                mixture: Self::from_lobes([(1.0, *other)]),
                integral: INV_4PI,
                share: keep(Lanes::splat(0.0)).0[0],
            };
        }
        let mut weights = Lanes::splat(0.0);
        let kappa_2 = Lanes::splat(other.kappa());
        let (mixture, kept) = self.map_groups(|g, lobes| {
            let lobes = change(g, lobes);
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
            let weight = weigh(&factors);
            weights = weights + weight;
            Group { weight: weight * keep(lobes.kappa), kappa, mean, ..lobes }
        });
        let integral = weights.sum();
        let share = if kept > 0.0 { (kept / integral).min(1.0) } else { 0.0 };
        Product { mixture, integral, share }
    }
}

/// The part of lobes that a vertex of concentration `own` would not sample by itself.
#[inline(always)]
fn kept(kappa: Lanes, own: f32) -> Lanes {
    // A uniform lobe has no such part, even where the vertex scatters to all sides alike.
    kappa / (kappa + own + 1e-6)
}

#[cfg(test)]
#[path = "product_tests.rs"]
mod tests;

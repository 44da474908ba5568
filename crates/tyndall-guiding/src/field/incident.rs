//! What a vertex asks its region.

use super::Region;
use super::parallax::seen_from;
use crate::directional::{DirectionAndPdf, VmfMixture};
use glam::{Vec2, Vec3A};

/// The light that arrives at a point, as a distribution over directions.
#[derive(Debug, Clone)]
pub struct Incident {
    mixture: VmfMixture,
    fluence: f32,
}

impl Incident {
    #[inline]
    pub(super) fn new(region: &Region, position: Vec3A) -> Self {
        let offset = Vec3A::from(region.pivot) - position;
        let (mixture, factor) = seen_from(&region.mixture, &region.inverse_distance, offset);
        let fluence = region.statistics.mean_weight() * factor;
        Self { mixture, fluence }
    }

    /// The distribution, proportional to incident radiance.
    pub fn mixture(&self) -> &VmfMixture {
        &self.mixture
    }

    /// Its density at a unit vector, per steradian.
    #[inline]
    pub fn pdf(&self, direction: Vec3A) -> f32 {
        self.mixture.pdf(direction)
    }

    /// The direction of the point `u` in [0, 1)².
    #[inline]
    pub fn sample(&self, u: Vec2) -> DirectionAndPdf {
        self.mixture.sample(u)
    }

    /// The distribution proportional to radiance times the cosine to the unit vector `normal`; see
    /// [`VmfMixture::product_with_cosine`].
    #[inline]
    pub fn product_with_cosine(&self, normal: Vec3A) -> VmfMixture {
        self.mixture.product_with_cosine(normal).0
    }

    /// The distribution proportional to radiance times a Henyey–Greenstein phase function that scatters to `wo`; see
    /// [`VmfMixture::product_with_hg`].
    #[inline]
    pub fn product_with_hg(&self, wo: Vec3A, g: f32) -> VmfMixture {
        self.mixture.product_with_hg(wo, g).0
    }

    /// ∫ L dω, in the unit of the samples' radiance. Over the hemisphere on surfaces that were sampled there only.
    #[inline]
    pub fn fluence(&self) -> f32 {
        self.fluence
    }

    /// L(ω): radiance arriving from a unit vector, in the unit of the samples' radiance.
    #[inline]
    pub fn radiance(&self, direction: Vec3A) -> f32 {
        self.fluence * self.pdf(direction)
    }

    /// ∫ L max(cos, 0) dω about a unit vector: irradiance, for the radiance that a diffuse surface will send on.
    #[inline]
    pub fn irradiance(&self, normal: Vec3A) -> f32 {
        self.fluence * self.mixture.product_with_cosine(normal).1
    }

    /// ∫ L p_HG dω: the radiance that scattering will send to `wo`, before the albedo.
    #[inline]
    pub fn in_scattered(&self, wo: Vec3A, g: f32) -> f32 {
        self.fluence * self.mixture.product_with_hg(wo, g).1
    }
}

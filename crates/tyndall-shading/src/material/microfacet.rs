//! GGX microfacets, isotropic.
//!
//! Distribution and shadowing: Walter et al. 2007, doi:10.2312/EGWR/EGSR07/195-206; height-correlated masking: Heitz
//! 2014, JCGT 3(2); visible normals by spherical caps: Dupuy & Benyoub 2023, doi:10.1111/cgf.14867. Directions are local,
//! z is the normal.

use super::Spread;
use glam::{Vec2, Vec3A};
use std::f32::consts::{PI, TAU};

/// Below this the surface is a mirror.
const SMOOTH: f32 = 0.005;
/// From here on lobes are wide enough to follow the light.
const WIDE: f32 = 0.3;
/// Narrowest lobe that f32 half vectors resolve.
const MIN_ALPHA: f32 = 1e-4;

/// Perceptual roughness in [0, 1]; its square is GGX's alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness(f32);

impl Roughness {
    /// Clamped to [0, 1]; NaN is 0.
    pub fn new(roughness: f32) -> Self {
        Self(super::unit(roughness))
    }

    /// As given.
    #[inline]
    pub fn value(self) -> f32 {
        self.0
    }

    /// The lobes that use it, or `None` for a mirror.
    #[inline]
    pub(super) fn ggx(self) -> Option<Ggx> {
        (self.0 >= SMOOTH).then(|| Ggx { alpha: (self.0 * self.0).max(MIN_ALPHA) })
    }

    /// `wide` if a lobe of this roughness is wide enough to follow the light.
    #[inline]
    pub(super) fn spread(self, wide: Spread) -> Spread {
        if self.0 >= WIDE { wide } else { Spread::Narrow }
    }

    /// Whether it is a mirror.
    #[inline]
    pub(super) fn is_smooth(self) -> bool {
        self.0 < SMOOTH
    }
}

/// The distribution with a given alpha.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ggx {
    pub alpha: f32,
}

impl Ggx {
    /// D(h).
    #[inline]
    pub(super) fn distribution(&self, h: Vec3A) -> f32 {
        let a2 = self.alpha * self.alpha;
        // From x and y: near the normal 1 - z^2 has no digits left.
        let s = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
        1.0 / (PI * a2 * s * s)
    }

    /// Lambda(w) of Smith's masking function.
    #[inline]
    fn lambda(&self, w: Vec3A) -> f32 {
        let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// G_1(w).
    #[inline]
    pub(super) fn masking(&self, w: Vec3A) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// G_2, height-correlated, for two directions on the same side.
    #[inline]
    pub(super) fn masking_shadowing(&self, wo: Vec3A, wi: Vec3A) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// D_v(h): density per steradian of [`Self::sample_visible`].
    #[inline]
    pub(super) fn visible_pdf(&self, wo: Vec3A, h: Vec3A) -> f32 {
        self.masking(wo) * self.distribution(h) * wo.dot(h).max(0.0) / wo.z
    }

    /// A microfacet normal as seen from `wo` (z > 0).
    #[inline]
    pub(super) fn sample_visible(&self, wo: Vec3A, u: Vec2) -> Vec3A {
        let standard = Vec3A::new(wo.x * self.alpha, wo.y * self.alpha, wo.z).normalize();
        // A point of the spherical cap that reflects into the upper hemisphere.
        let phi = TAU * u.x;
        let z = (1.0 - u.y) * (1.0 + standard.z) - standard.z;
        let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
        let h = Vec3A::new(r * phi.cos(), r * phi.sin(), z) + standard;
        Vec3A::new(h.x * self.alpha, h.y * self.alpha, h.z).normalize()
    }

    /// D G_2 / (4 cos_o cos_i) times cos_i: the reflection lobe without Fresnel.
    #[inline]
    pub(super) fn reflection(&self, wo: Vec3A, wi: Vec3A, h: Vec3A) -> f32 {
        self.distribution(h) * self.masking_shadowing(wo, wi) / (4.0 * wo.z)
    }

    /// Density per steradian of `wi` = `wo` mirrored about a visible normal: D_v(h) / (4 wo.h) simplified.
    #[inline]
    pub(super) fn reflection_pdf(&self, wo: Vec3A, h: Vec3A) -> f32 {
        self.masking(wo) * self.distribution(h) / (4.0 * wo.z)
    }
}

/// `wo` mirrored about `h`.
#[inline]
pub(super) fn reflect(wo: Vec3A, h: Vec3A) -> Vec3A {
    h * (2.0 * wo.dot(h)) - wo
}

/// `wo` mirrored about the normal.
#[inline]
pub(super) fn mirror(wo: Vec3A) -> Vec3A {
    Vec3A::new(-wo.x, -wo.y, wo.z)
}

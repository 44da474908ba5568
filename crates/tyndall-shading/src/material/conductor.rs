//! Metal: GGX reflection (Walter et al. 2007) with the energy of further bounces between microfacets given back as a
//! diffuse-like lobe (Kulla & Conty 2017), so that a perfect reflector loses nothing at any roughness.

use super::directional_albedo::{average, split_sum};
use super::frame::LocalFrame;
use super::microfacet::{Ggx, Roughness, mirror, reflect};
use super::{BsdfValue, LobeSample, Scatter, Spread, fresnel, limited, unit_color};
use glam::{Vec2, Vec3A};
use tyndall_math::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use tyndall_math::{INV_PI, Rgb};

/// Reflection on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductor {
    fresnel: Fresnel,
    roughness: Roughness,
    /// Cosine-weighted average of the Fresnel reflectance.
    average: Rgb,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fresnel {
    Schlick { f0: Rgb },
    Index { n: Rgb, k: Rgb },
}

impl Fresnel {
    fn at(&self, cos: f32) -> Rgb {
        match *self {
            Self::Schlick { f0 } => f0 + (Rgb::ONE - f0) * fresnel::schlick_weight(cos),
            Self::Index { n, k } => fresnel::conductor(cos, n, k),
        }
    }
}

impl Conductor {
    /// From the reflectance at normal incidence (Schlick's approximation).
    pub fn from_reflectance(f0: Rgb, roughness: f32) -> Self {
        let f0 = unit_color(f0);
        let average = f0 + (Rgb::ONE - f0) / 21.0;
        Self { fresnel: Fresnel::Schlick { f0 }, roughness: Roughness::new(roughness), average }
    }

    /// From refractive index and extinction coefficient per channel.
    pub fn from_index(n: Rgb, k: Rgb, roughness: f32) -> Self {
        let clean = |c: Rgb| Rgb::from_array(c.to_array().map(|x| limited(x, 100.0)));
        let (n, k) = (clean(n), clean(k));
        // Midpoint rule in cos^2, over which the cosine weight is uniform.
        let steps = 16;
        let at = |i: i32| fresnel::conductor(((i as f32 + 0.5) / steps as f32).sqrt(), n, k);
        let average = unit_color((0..steps).map(at).sum::<Rgb>() / steps as f32);
        Self { fresnel: Fresnel::Index { n, k }, roughness: Roughness::new(roughness), average }
    }

    /// Colour of the light that bounced more than once.
    fn multiple(&self) -> Rgb {
        let kept = average(self.roughness).total();
        self.average * self.average * kept / (Rgb::ONE - self.average * (1.0 - kept)).max(Rgb::splat(1e-6))
    }

    /// Fraction of `wo`'s light that the single bounce loses: also the chance of drawing the other lobe.
    fn lost(&self, cos: f32) -> f32 {
        1.0 - split_sum(cos, self.roughness).total()
    }

    fn rough(&self, ggx: Ggx, wo: Vec3A, wi: Vec3A) -> BsdfValue {
        let Some(h) = (wo + wi).try_normalize() else { return BsdfValue::default() };
        let lost = self.lost(wo.z);
        let single = self.fresnel.at(wo.dot(h).max(0.0)) * ggx.reflection(wo, wi, h);
        let lost_on_average = (1.0 - average(self.roughness).total()).max(1e-6);
        let multiple = self.multiple() * (lost * self.lost(wi.z) / lost_on_average * INV_PI * wi.z);
        let pdf = (1.0 - lost) * ggx.reflection_pdf(wo, h) + lost * cosine_hemisphere_pdf(wi.z);
        BsdfValue { diffuse: Rgb::ZERO, glossy: single + multiple, pdf }
    }
}

impl Scatter for Conductor {
    fn sample(&self, _: &LocalFrame, wo: Vec3A, u: [f32; 3]) -> Option<LobeSample> {
        let Some(ggx) = self.roughness.ggx() else {
            let delta_weight = Some(self.fresnel.at(wo.z));
            return Some(LobeSample { wi: mirror(wo), delta_weight, roughness: 0.0, eta: 1.0 });
        };
        let u2 = Vec2::new(u[0], u[1]);
        let wi = if u[2] < self.lost(wo.z) {
            cosine_hemisphere(u2)
        } else {
            reflect(wo, ggx.sample_visible(wo, u2))
        };
        (wi.z > 0.0).then_some(LobeSample {
            wi,
            delta_weight: None,
            roughness: self.roughness.value(),
            eta: 1.0,
        })
    }

    fn evaluate(&self, _: &LocalFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue {
        match self.roughness.ggx() {
            Some(ggx) if wi.z > 0.0 => self.rough(ggx, wo, wi),
            _ => BsdfValue::default(),
        }
    }

    fn is_delta_only(&self) -> bool {
        self.roughness.is_smooth()
    }

    fn spread(&self) -> Spread {
        self.roughness.spread(Spread::Reflection)
    }

    fn albedo(&self, _: &LocalFrame, wo: Vec3A) -> Rgb {
        self.fresnel.at(wo.z)
    }
}

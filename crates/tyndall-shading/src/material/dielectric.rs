//! The boundary of a transparent body, smooth or rough.
//!
//! Walter, Marschner, Li, Torrance 2007, "Microfacet Models for Refraction through Rough Surfaces",
//! doi:10.2312/EGWR/EGSR07/195-206. The side to which the geometric normal points has index 1, the other `ior`.
//! Radiance, unlike power, changes by `1 / eta^2` on refraction; over a closed body the factors cancel.

use super::frame::LocalFrame;
use super::microfacet::{Ggx, Roughness, mirror, reflect};
use super::{BsdfValue, LobeSample, Scatter, Spread, fresnel, unit_color};
use glam::{Vec2, Vec3A};
use tyndall_math::Rgb;

/// Index differences below this pass light straight through.
const INDEX_MATCHED: f32 = 1e-4;
/// Index differences below this are smooth: a rough boundary could not bend light noticeably, and the half vector of
/// refraction is not determined in f32.
const NEARLY_MATCHED: f32 = 1e-2;

/// Which parts of the scattering exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ScatterMode {
    /// Reflection only; what would be refracted is absorbed.
    Reflect,
    /// Refraction only.
    Transmit,
    /// Both.
    #[default]
    Both,
}

impl ScatterMode {
    /// From MaterialX's `scatter_mode`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "R" => Some(Self::Reflect),
            "T" => Some(Self::Transmit),
            "RT" => Some(Self::Both),
            _ => None,
        }
    }

    /// Chance of reflection where the boundary reflects `f`.
    fn reflection_chance(self, f: f32) -> f32 {
        match self {
            Self::Reflect => 1.0,
            Self::Transmit => 0.0,
            Self::Both => f,
        }
    }
}

/// Reflection and refraction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dielectric {
    ior: f32,
    roughness: Roughness,
    tint: Rgb,
    mode: ScatterMode,
}

impl Dielectric {
    /// `ior` is that of the inside over the outside, limited to [0.01, 100]; invalid ones are 1. `tint` multiplies both
    /// parts.
    pub fn new(ior: f32, roughness: f32, tint: Rgb, mode: ScatterMode) -> Self {
        let ior = if ior > 0.0 { ior.clamp(0.01, 100.0) } else { 1.0 };
        let is_nearly_matched = (ior - 1.0).abs() < NEARLY_MATCHED;
        let roughness = Roughness::new(if is_nearly_matched { 0.0 } else { roughness });
        Self { ior, roughness, tint: unit_color(tint), mode }
    }

    /// The fraction that passes if the boundary does nothing else.
    pub(super) fn straight_through(&self) -> Option<Rgb> {
        let is_matched = (self.ior - 1.0).abs() < INDEX_MATCHED;
        is_matched.then_some(if self.mode == ScatterMode::Reflect { Rgb::ZERO } else { self.tint })
    }

    /// Index on the far side over that on the side of `wo`.
    fn eta(&self, local: &LocalFrame) -> f32 {
        if local.is_outside { self.ior } else { 1.0 / self.ior }
    }

    fn sample_smooth(&self, wo: Vec3A, eta: f32, u: f32) -> Option<LobeSample> {
        let interface = fresnel::dielectric(wo.z.min(1.0), eta);
        let chance = self.mode.reflection_chance(interface.reflectance);
        if u < chance {
            let weight = self.tint * (interface.reflectance / chance);
            return Some(LobeSample { wi: mirror(wo), delta_weight: Some(weight), roughness: 0.0, eta: 1.0 });
        }
        let refracted = (1.0 - interface.reflectance) / (1.0 - chance);
        let wi = Vec3A::new(-wo.x / eta, -wo.y / eta, -interface.cos_t);
        let weight = self.tint * (refracted / (eta * eta));
        (interface.cos_t > 0.0).then_some(LobeSample { wi, delta_weight: Some(weight), roughness: 0.0, eta })
    }

    fn sample_rough(&self, ggx: Ggx, wo: Vec3A, eta: f32, u: [f32; 3]) -> Option<LobeSample> {
        let h = ggx.sample_visible(wo, Vec2::new(u[0], u[1]));
        let cos_o = wo.dot(h);
        let interface = fresnel::dielectric(cos_o.clamp(0.0, 1.0), eta);
        let roughness = self.roughness.value();
        if u[2] < self.mode.reflection_chance(interface.reflectance) {
            let wi = reflect(wo, h);
            return (wi.z > 0.0).then_some(LobeSample { wi, delta_weight: None, roughness, eta: 1.0 });
        }
        let wi = h * (cos_o / eta - interface.cos_t) - wo / eta;
        let is_refracted = interface.cos_t > 0.0 && wi.z < 0.0;
        is_refracted.then_some(LobeSample { wi, delta_weight: None, roughness, eta })
    }

    fn reflection(&self, ggx: Ggx, wo: Vec3A, wi: Vec3A, eta: f32) -> BsdfValue {
        let Some(h) = (wo + wi).try_normalize() else { return BsdfValue::default() };
        if self.mode == ScatterMode::Transmit {
            return BsdfValue::default();
        }
        let f = fresnel::dielectric(wo.dot(h).clamp(0.0, 1.0), eta).reflectance;
        BsdfValue {
            diffuse: Rgb::ZERO,
            glossy: self.tint * (f * ggx.reflection(wo, wi, h)),
            pdf: self.mode.reflection_chance(f) * ggx.reflection_pdf(wo, h),
        }
    }

    fn transmission(&self, ggx: Ggx, wo: Vec3A, wi: Vec3A, eta: f32) -> BsdfValue {
        let Some(h) = (wo + wi * eta).try_normalize() else { return BsdfValue::default() };
        let h = if h.z < 0.0 { -h } else { h };
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        if !(cos_o > 0.0 && cos_i < 0.0) || self.mode == ScatterMode::Reflect {
            return BsdfValue::default();
        }
        let f = fresnel::dielectric(cos_o.min(1.0), eta).reflectance;
        let half_vector = cos_i + cos_o / eta;
        let jacobian = -cos_i / (half_vector * half_vector);
        let value = ggx.distribution(h) * ggx.masking_shadowing(wo, wi) * cos_o * jacobian / wo.z;
        BsdfValue {
            diffuse: Rgb::ZERO,
            glossy: self.tint * ((1.0 - f) * value / (eta * eta)),
            pdf: (1.0 - self.mode.reflection_chance(f)) * ggx.visible_pdf(wo, h) * jacobian,
        }
    }
}

impl Scatter for Dielectric {
    fn sample(&self, local: &LocalFrame, wo: Vec3A, u: [f32; 3]) -> Option<LobeSample> {
        let eta = self.eta(local);
        match self.roughness.ggx() {
            None => self.sample_smooth(wo, eta, u[2]),
            Some(ggx) => self.sample_rough(ggx, wo, eta, u),
        }
    }

    fn evaluate(&self, local: &LocalFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue {
        let eta = self.eta(local);
        match self.roughness.ggx() {
            None => BsdfValue::default(),
            Some(ggx) if wi.z > 0.0 => self.reflection(ggx, wo, wi, eta),
            Some(ggx) => self.transmission(ggx, wo, wi, eta),
        }
    }

    fn is_delta_only(&self) -> bool {
        self.roughness.is_smooth()
    }

    fn spread(&self) -> Spread {
        let is_one_sided = self.mode == ScatterMode::Reflect;
        self.roughness.spread(if is_one_sided { Spread::Reflection } else { Spread::BothSides })
    }

    fn albedo(&self, local: &LocalFrame, wo: Vec3A) -> Rgb {
        let f = fresnel::dielectric(wo.z.min(1.0), self.eta(local)).reflectance;
        match self.mode {
            ScatterMode::Reflect => self.tint * f,
            ScatterMode::Transmit => self.tint * (1.0 - f),
            ScatterMode::Both => self.tint,
        }
    }
}

//! Rough diffuse reflection that loses no energy.
//!
//! Portsmouth, Kutz, Hill 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF", JCGT 14(1), arXiv:2410.18026.
//! With roughness 0 it is exactly Lambert's. Names follow the paper.

use super::frame::LocalFrame;
use super::{BsdfValue, LobeSample, Scatter, Spread, unit, unit_color};
use glam::{Vec2, Vec3A};
use std::f32::consts::PI;
use tyndall_math::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use tyndall_math::{INV_PI, Rgb};

/// 1/2 - 2/(3 pi).
const CONSTANT1: f32 = 0.5 - 2.0 / (3.0 * PI);
/// 2/3 - 28/(15 pi).
const CONSTANT2: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// Diffuse reflection on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diffuse {
    /// rho.
    albedo: Rgb,
    /// r: 0 is Lambert.
    roughness: f32,
}

impl Diffuse {
    /// Arguments are clamped to [0, 1].
    pub fn new(albedo: Rgb, roughness: f32) -> Self {
        Self { albedo: unit_color(albedo), roughness: unit(roughness) }
    }

    /// A_F.
    #[inline]
    fn a_f(&self) -> f32 {
        1.0 / (1.0 + CONSTANT1 * self.roughness)
    }

    /// Directional albedo of the single-scattering part with rho = 1.
    #[inline]
    fn directional(&self, mu: f32) -> f32 {
        let mu = mu.clamp(1e-6, 1.0);
        let si = (1.0 - mu * mu).max(0.0).sqrt();
        let g = si * (mu.acos() - si * mu) + (2.0 / 3.0) * ((si / mu) * (1.0 - si * si * si) - si);
        self.a_f() * (1.0 + self.roughness * INV_PI * g)
    }

    /// The BRDF for two directions on the same side.
    #[inline]
    pub(super) fn brdf(&self, wo: Vec3A, wi: Vec3A) -> Rgb {
        if self.roughness == 0.0 {
            return self.albedo * INV_PI;
        }
        let s = wi.dot(wo) - wi.z * wo.z;
        let s_over_t = if s > 0.0 { s / wi.z.max(wo.z) } else { s };
        let single = self.albedo * (INV_PI * self.a_f() * (1.0 + self.roughness * s_over_t));
        let average = self.a_f() * (1.0 + CONSTANT2 * self.roughness);
        let rho_ms = self.albedo * self.albedo * average / (Rgb::ONE - self.albedo * (1.0 - average));
        let lost = |mu: f32| (1.0 - self.directional(mu)).max(1e-7);
        single + rho_ms * (INV_PI * lost(wo.z) * lost(wi.z) / (1.0 - average).max(1e-7))
    }
}

impl Scatter for Diffuse {
    fn sample(&self, _: &LocalFrame, _: Vec3A, u: [f32; 3]) -> Option<LobeSample> {
        let wi = cosine_hemisphere(Vec2::new(u[0], u[1]));
        Some(LobeSample { wi, delta_weight: None, roughness: 1.0, eta: 1.0 })
    }

    fn evaluate(&self, _: &LocalFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue {
        if wi.z <= 0.0 {
            return BsdfValue::default();
        }
        let diffuse = self.brdf(wo, wi) * wi.z;
        BsdfValue { diffuse, glossy: Rgb::ZERO, pdf: cosine_hemisphere_pdf(wi.z) }
    }

    fn is_delta_only(&self) -> bool {
        false
    }

    fn spread(&self) -> Spread {
        Spread::Reflection
    }

    fn albedo(&self, _: &LocalFrame, _: Vec3A) -> Rgb {
        self.albedo
    }
}

//! UsdPreviewSurface (specification 2.6, node definition of usd-core 26.11): a diffuse base under a specular lobe under a
//! white clear coat.
//!
//! Choices the specification leaves open:
//! - alpha = roughness^2, GGX; layers are coupled by the tabulated albedo of the layer above, which is reciprocal and
//!   loses nothing (Kulla & Conty 2017).
//! - The edge reflectance fades out where f0 is below 2 %, so that `specularColor` 0 (or `ior` 1) leaves no lobe at all.
//! - `opacityMode` transparent: the diffuse lobe is scaled by opacity, the reflectance at normal incidence is kept, and
//!   the light left over passes straight through. The rise of the reflectance towards the edge is scaled by opacity:
//!   the straight-through fraction does not depend on direction, and together they never exceed 1.
//! - `opacity` fixed at 0 is a body of index `ior` that refracts (glass).

use super::directional_albedo::{SplitSum, average, split_sum};
use super::frame::LocalFrame;
use super::microfacet::{Roughness, mirror, reflect};
use super::{
    Bsdf, BsdfValue, Dielectric, LobeSample, Scatter, ScatterMode, Spread, bsdf::choose, fresnel, unit,
    unit_color,
};
use glam::{Vec2, Vec3A};
use tyndall_math::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use tyndall_math::{INV_PI, Rgb, luminance};

/// Reflectance of the clear coat at normal incidence: index 1.5.
const COAT_F0: f32 = 0.04;

/// What opacity below 1 means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OpacityMode {
    /// Reduces the diffuse lobe; highlights stay.
    #[default]
    Transparent,
    /// Reduces everything: the surface is partly absent.
    Presence,
}

/// The node's inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "named and documented in the node's table")]
pub struct PreviewParams {
    pub diffuse_color: Rgb,
    pub use_specular_workflow: bool,
    pub specular_color: Rgb,
    pub metallic: f32,
    pub roughness: f32,
    pub clearcoat: f32,
    pub clearcoat_roughness: f32,
    pub opacity: f32,
    pub opacity_mode: OpacityMode,
    pub opacity_threshold: f32,
    pub ior: f32,
}

impl Default for PreviewParams {
    fn default() -> Self {
        Self {
            diffuse_color: Rgb::splat(0.18),
            use_specular_workflow: false,
            specular_color: Rgb::ZERO,
            metallic: 0.0,
            roughness: 0.5,
            clearcoat: 0.0,
            clearcoat_roughness: 0.01,
            opacity: 1.0,
            opacity_mode: OpacityMode::Transparent,
            opacity_threshold: 0.0,
            ior: 1.5,
        }
    }
}

impl PreviewParams {
    /// The fraction of the surface that is there: emission is scaled by it.
    pub fn presence(&self) -> f32 {
        match self.opacity_mode {
            _ if self.opacity_threshold > 0.0 => f32::from(self.opacity >= self.opacity_threshold),
            OpacityMode::Presence => unit(self.opacity),
            OpacityMode::Transparent => 1.0,
        }
    }

    /// The scattering. `is_glass` says that an opacity of 0 was authored for the whole surface.
    pub fn bsdf(&self, is_glass: bool) -> Bsdf {
        let presence = self.presence();
        if presence <= 0.0 {
            return Bsdf::transparent();
        }
        let is_transparent = self.opacity_threshold <= 0.0 && self.opacity_mode == OpacityMode::Transparent;
        if is_glass && is_transparent && self.opacity <= 0.0 && self.metallic <= 0.0 {
            return Dielectric::new(self.ior, self.roughness, Rgb::ONE, ScatterMode::Both).into();
        }
        let mut bsdf = Bsdf::black();
        bsdf.add(PreviewSurface::new(self).into(), Rgb::splat(presence));
        bsdf.add_transparency(Rgb::splat(1.0 - presence));
        bsdf
    }
}

/// The layered lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PreviewSurface {
    /// Diffuse albedo, opacity included.
    diffuse: Rgb,
    f0: Rgb,
    /// Edge reflectance of an opaque surface: couples the diffuse lobe.
    f90: Rgb,
    /// Edge reflectance with opacity taken into account.
    f90_kept: Rgb,
    roughness: Roughness,
    coat: f32,
    coat_f90: f32,
    coat_roughness: Roughness,
    transparency: Rgb,
}

/// The shares of the three layers seen from a cosine.
struct Layers {
    coat: f32,
    specular: Rgb,
    diffuse: Rgb,
}

impl PreviewSurface {
    /// From the node's inputs, presence and cut-out excepted.
    pub fn new(p: &PreviewParams) -> Self {
        let base = unit_color(p.diffuse_color);
        let metallic = if p.use_specular_workflow { 0.0 } else { unit(p.metallic) };
        let f0 = if p.use_specular_workflow {
            unit_color(p.specular_color)
        } else {
            Rgb::splat(unit(fresnel::normal_reflectance(p.ior.max(0.0)))).lerp(base, metallic)
        };
        let edge = Rgb::splat(unit(50.0 * f0.max_element())).lerp(base, metallic).max(f0);
        let is_cut_out = p.opacity_threshold > 0.0 || p.opacity_mode == OpacityMode::Presence;
        let opacity = if is_cut_out { 1.0 } else { unit(p.opacity) };
        let coat = unit(p.clearcoat);
        let passing = (Rgb::ONE - f0) * (1.0 - opacity);
        Self {
            diffuse: base * ((1.0 - metallic) * opacity),
            f0,
            f90: edge,
            f90_kept: f0 + (edge - f0) * opacity,
            roughness: Roughness::new(p.roughness),
            coat,
            // Faster than opacity: what the coat reflects at the edge also passes straight through otherwise.
            coat_f90: COAT_F0 + (1.0 - COAT_F0) * (1.0 - 4.0 * passing.max_element()).max(0.0),
            coat_roughness: Roughness::new(p.clearcoat_roughness),
            transparency: passing * (1.0 - COAT_F0 * coat),
        }
    }

    /// The fraction that passes straight through.
    pub(super) fn transparency(&self) -> Rgb {
        self.transparency
    }

    fn has_specular(&self) -> bool {
        self.f90_kept != Rgb::ZERO
    }

    /// Albedo of the coat.
    fn coat_albedo(&self, cos: f32) -> f32 {
        if self.coat == 0.0 {
            return 0.0;
        }
        let e = split_sum(cos, self.coat_roughness);
        self.coat * (COAT_F0 * e.f0 + self.coat_f90 * e.f90)
    }

    /// What the specular lobe of an opaque surface lets through to the diffuse one.
    fn below_specular(&self, e: SplitSum) -> Rgb {
        (Rgb::ONE - self.f0 * e.f0 - self.f90 * e.f90).max(Rgb::ZERO)
    }

    fn specular_split(&self, cos: f32) -> SplitSum {
        if self.has_specular() { split_sum(cos, self.roughness) } else { SplitSum::default() }
    }

    fn layers(&self, cos: f32) -> Layers {
        let coat = self.coat_albedo(cos);
        let e = self.specular_split(cos);
        Layers {
            coat,
            specular: (self.f0 * e.f0 + self.f90_kept * e.f90) * (1.0 - coat),
            diffuse: self.diffuse * self.below_specular(e) * (1.0 - coat),
        }
    }

    /// Chances of coat, specular and diffuse lobe.
    fn chances(&self, cos: f32) -> [f32; 3] {
        let layers = self.layers(cos);
        let weights = [layers.coat, luminance(layers.specular), luminance(layers.diffuse)];
        let total: f32 = weights.iter().sum();
        weights.map(|w| if total > 0.0 { w / total } else { 0.0 })
    }

    /// The diffuse lobe below the specular one, cosine included.
    fn diffuse_value(&self, wo: Vec3A, wi: Vec3A) -> Rgb {
        if self.diffuse == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let coupled = if self.has_specular() {
            let average = self.below_specular(average(self.roughness)).max(Rgb::splat(1e-6));
            self.below_specular(self.specular_split(wo.z)) * self.below_specular(self.specular_split(wi.z))
                / average
        } else {
            Rgb::ONE
        };
        self.diffuse * coupled * (INV_PI * wi.z)
    }
}

fn schlick(f0: Rgb, f90: Rgb, cos: f32) -> Rgb {
    f0 + (f90 - f0) * fresnel::schlick_weight(cos)
}

impl Scatter for PreviewSurface {
    fn sample(&self, _: &LocalFrame, wo: Vec3A, u: [f32; 3]) -> Option<LobeSample> {
        let chances = self.chances(wo.z);
        let (layer, _) = choose(&chances, u[2])?;
        let u2 = Vec2::new(u[0], u[1]);
        if layer == 2 {
            let wi = cosine_hemisphere(u2);
            return (wi.z > 0.0).then_some(LobeSample { wi, delta_weight: None, roughness: 1.0, eta: 1.0 });
        }
        let roughness = if layer == 0 { self.coat_roughness } else { self.roughness };
        if let Some(ggx) = roughness.ggx() {
            let wi = reflect(wo, ggx.sample_visible(wo, u2));
            return (wi.z > 0.0).then_some(LobeSample {
                wi,
                delta_weight: None,
                roughness: roughness.value(),
                eta: 1.0,
            });
        }
        let value = if layer == 0 {
            schlick(Rgb::splat(COAT_F0), Rgb::splat(self.coat_f90), wo.z) * self.coat
        } else {
            schlick(self.f0, self.f90_kept, wo.z) * (1.0 - self.coat_albedo(wo.z)).powi(2)
        };
        Some(LobeSample {
            wi: mirror(wo),
            delta_weight: Some(value / chances[layer]),
            roughness: 0.0,
            eta: 1.0,
        })
    }

    fn evaluate(&self, _: &LocalFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue {
        let h = (wo + wi).normalize_or(Vec3A::Z);
        if wi.z <= 0.0 {
            return BsdfValue::default();
        }
        let chances = self.chances(wo.z);
        let below_coat = (1.0 - self.coat_albedo(wo.z)) * (1.0 - self.coat_albedo(wi.z));
        let cos = wo.dot(h).max(0.0);
        let mut value = BsdfValue {
            diffuse: self.diffuse_value(wo, wi) * below_coat,
            glossy: Rgb::ZERO,
            pdf: chances[2] * cosine_hemisphere_pdf(wi.z),
        };
        if let Some(ggx) = self.coat_roughness.ggx().filter(|_| self.coat > 0.0) {
            let f = schlick(Rgb::splat(COAT_F0), Rgb::splat(self.coat_f90), cos) * self.coat;
            value.glossy += f * ggx.reflection(wo, wi, h);
            value.pdf += chances[0] * ggx.reflection_pdf(wo, h);
        }
        if let Some(ggx) = self.roughness.ggx().filter(|_| self.has_specular()) {
            value.glossy += schlick(self.f0, self.f90_kept, cos) * (below_coat * ggx.reflection(wo, wi, h));
            value.pdf += chances[1] * ggx.reflection_pdf(wo, h);
        }
        value
    }

    fn is_delta_only(&self) -> bool {
        let has_rough_specular = self.has_specular() && !self.roughness.is_smooth();
        let has_rough_coat = self.coat > 0.0 && !self.coat_roughness.is_smooth();
        self.diffuse == Rgb::ZERO && !has_rough_specular && !has_rough_coat
    }

    fn spread(&self) -> Spread {
        if self.diffuse != Rgb::ZERO { Spread::Reflection } else { self.roughness.spread(Spread::Reflection) }
    }

    fn albedo(&self, _: &LocalFrame, wo: Vec3A) -> Rgb {
        let layers = self.layers(wo.z);
        (layers.diffuse + layers.specular + Rgb::splat(layers.coat)).min(Rgb::ONE)
    }
}

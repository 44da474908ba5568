//! From a light prim to a light: checks, units, and the choice of kind.

use super::emission::Emission;
use super::{Body, Cylinder, Disk, Distant, Dome, Line, Point, Rect, Sphere};
use glam::{DMat3, DVec3};
use std::path::Path;
use std::sync::Arc;
use tyndall_math::Rgb;
use tyndall_scene::prim::{self, LightKind};
use tyndall_scene::{AssetLoader, ColorSpace, Diagnostics, ImageData, PrimPath};

/// Largest radiance that is kept; larger ones are clamped with a message so that sums stay finite.
const MAX_RADIANCE: f64 = 1e30;

/// Everything a kind needs to build itself.
pub(super) struct LightBuilder<'a> {
    path: &'a PrimPath,
    pub(super) prim: &'a prim::Light,
    /// Linear part of the light's transform.
    pub(super) linear: DMat3,
    /// Origin of the light relative to the world origin.
    pub(super) center: DVec3,
    assets: &'a dyn AssetLoader,
    diags: &'a mut Diagnostics,
}

impl<'a> LightBuilder<'a> {
    pub(super) fn new(
        path: &'a PrimPath,
        prim: &'a prim::Light,
        world_origin: DVec3,
        assets: &'a dyn AssetLoader,
        diags: &'a mut Diagnostics,
    ) -> Option<Self> {
        let linear = prim.world_from_light.matrix3;
        let center = prim.world_from_light.translation - world_origin;
        if !(linear.is_finite() && center.is_finite()) {
            diags.error(
                path,
                "the light's transform is not finite",
                "the light was removed; repair its transform",
            );
            return None;
        }
        Some(Self { path, prim, linear, center, assets, diags })
    }

    /// The kind that the prim asks for.
    pub(super) fn body(&mut self) -> Option<Body> {
        let prim = self.prim;
        Some(match &prim.kind {
            LightKind::Sphere { radius, as_point } => {
                let radius = self.extent("radius", *radius)?;
                if *as_point || (radius == 0.0 && prim.normalize) {
                    Point::build(self, radius)?.into()
                } else {
                    Sphere::build(self, radius)?.into()
                }
            }
            LightKind::Rect { width, height, texture } => {
                let (width, height) = (self.extent("width", *width)?, self.extent("height", *height)?);
                Rect::build(self, width, height, texture.as_deref())?.into()
            }
            LightKind::Disk { radius } => {
                let radius = self.extent("radius", *radius)?;
                Disk::build(self, radius)?.into()
            }
            LightKind::Cylinder { length, radius, as_line } => {
                let (length, radius) = (self.extent("length", *length)?, self.extent("radius", *radius)?);
                if *as_line || (radius == 0.0 && prim.normalize) {
                    Line::build(self, length, radius)?.into()
                } else {
                    Cylinder::build(self, length, radius)?.into()
                }
            }
            LightKind::Distant { angle } => Distant::build(self, *angle)?.into(),
            LightKind::Dome { texture } => {
                Dome::build(self, texture.as_ref().map(|t| t.path.as_path()))?.into()
            }
        })
    }

    /// A length that must not be negative.
    fn extent(&mut self, name: &str, value: f64) -> Option<f64> {
        if value.is_finite() && value >= 0.0 {
            return Some(value);
        }
        self.reject(format!("{name} {value} is not a length"), format!("set {name} to a positive number"))
    }

    /// `intensity * 2^exposure * color / size`; `None` for black or invalid lights.
    pub(super) fn radiance(&mut self, size: f64) -> Option<Rgb> {
        let p = self.prim;
        let scale = f64::from(p.intensity) * f64::from(p.exposure).exp2();
        let color = DVec3::new(p.color[0].into(), p.color[1].into(), p.color[2].into());
        if !(scale.is_finite() && color.is_finite() && size.is_finite()) {
            return self.reject(
                format!(
                    "intensity {}, exposure {} and color {:?} are not finite",
                    p.intensity, p.exposure, p.color
                ),
                "the light was removed; set finite values",
            );
        }
        if scale < 0.0 || color.min_element() < 0.0 {
            return self.reject(
                format!("intensity {} and color {:?}: light cannot be negative", p.intensity, p.color),
                "the light was removed; use positive intensity and color",
            );
        }
        if scale == 0.0 || color == DVec3::ZERO {
            return None;
        }
        let mut radiance = color * (scale / size);
        if radiance.max_element() > MAX_RADIANCE {
            self.warn(
                format!("radiance {:e} is too large", radiance.max_element()),
                format!("it was scaled down to {MAX_RADIANCE:e}"),
            );
            radiance *= MAX_RADIANCE / radiance.max_element();
        }
        Some(radiance.as_vec3a())
    }

    /// Radiance and shaping of a body whose world-space surface area is `area`.
    pub(super) fn area_emission(&mut self, area: f64) -> Option<Emission> {
        if !(area > 0.0 && area.is_finite()) {
            return self.reject(
                format!("the surface area is {area}"),
                "the light was removed; give it a size or scale",
            );
        }
        let size = if self.prim.normalize { area } else { 1.0 };
        let radiance = self.radiance(size)?;
        Some(self.shaped(radiance))
    }

    /// `radiance` restricted by the prim's shaping.
    pub(super) fn shaped(&self, radiance: Rgb) -> Emission {
        Emission::new(radiance, &self.prim.shaping, self.linear * DVec3::NEG_Z)
    }

    /// The image at `path` with non-finite and negative texels replaced by 0; `None` after a message.
    pub(super) fn image(&mut self, path: &Path) -> Option<Arc<ImageData>> {
        let image = match self.assets.image(path, ColorSpace::Auto) {
            Ok(image) => image,
            Err(error) => {
                self.diags.error(self.path, error.message, "the light was rendered without its texture");
                return None;
            }
        };
        if image.width == 0 || image.height == 0 || image.pixels.len() != image.width * image.height {
            self.diags.error(
                self.path,
                format!("texture {} has no pixels", path.display()),
                "the light was rendered without its texture",
            );
            return None;
        }
        let is_bad = |p: &[f32; 4]| p[..3].iter().any(|c| !(c.is_finite() && *c >= 0.0));
        let n_bad = image.pixels.iter().filter(|p| is_bad(p)).count();
        if n_bad == 0 {
            return Some(image);
        }
        self.warn(
            format!("{n_bad} texels of {} are negative or not finite", path.display()),
            "they were replaced by 0",
        );
        let mut cleaned = (*image).clone();
        for channel in cleaned.pixels.iter_mut().flat_map(|p| &mut p[..3]) {
            if !(channel.is_finite() && *channel >= 0.0) {
                *channel = 0.0;
            }
        }
        Some(Arc::new(cleaned))
    }

    /// A non-negative multiplier.
    pub(super) fn factor(&mut self, name: &str, value: f32) -> f32 {
        if value.is_finite() && value >= 0.0 {
            return value;
        }
        self.warn(format!("{name} {value} is not a factor"), "1 was used");
        1.0
    }

    pub(super) fn warn(&mut self, what: impl Into<String>, action: impl Into<String>) {
        self.diags.warn(self.path, what, action);
    }

    pub(super) fn reject<T>(&mut self, what: impl Into<String>, action: impl Into<String>) -> Option<T> {
        self.diags.warn(self.path, what, action);
        None
    }
}

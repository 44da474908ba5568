//! A rectangle (a parallelogram under shear) that emits from one side.

use super::bounds::{LightBounds, Outreach};
use super::build::LightBuilder;
use super::emission::Emission;
use super::plane::Plane;
use super::spherical_rect::{MIN_SOLID_ANGLE, SphericalRect};
use super::{Emitter, LightSample};
use crate::kind::{KindSpec, POSITIVE, ParamSpec};
use crate::texture::{Texture, Wrap};
use glam::{Vec2, Vec3A};
use std::path::Path;
use tyndall_math::{Ray, Rgb};

#[derive(Debug, Clone)]
pub(super) struct Rect {
    plane: Plane,
    pdf_area: f32,
    /// The axes are perpendicular.
    is_rectangle: bool,
    emission: Emission,
    texture: Option<Texture>,
    /// Largest channel of the mean intensity along the normal, inside the shaping's cone.
    intensity: f64,
}

impl Rect {
    pub(super) fn build(
        builder: &mut LightBuilder,
        width: f64,
        height: f64,
        texture: Option<&Path>,
    ) -> Option<Self> {
        let found = Plane::build(builder, 0.5 * width, 0.5 * height);
        let area = 4.0 * found.as_ref().map_or(0.0, |(_, area)| *area);
        let emission = builder.area_emission(area)?;
        let (plane, _) = found?;
        let texture =
            texture.and_then(|path| builder.image(path)).map(|i| Texture::new(i, Wrap::Clamp, Wrap::Clamp));
        let mean = texture.as_ref().map_or(1.0, |t| f64::from(t.mean().max_element()));
        if mean == 0.0 {
            return None;
        }
        let skew = plane.axis_x.dot(plane.axis_y) / (plane.axis_x.length() * plane.axis_y.length());
        let radiance = f64::from(emission.radiance.max_element());
        Some(Self {
            plane,
            pdf_area: (1.0 / area) as f32,
            is_rectangle: skew.abs() < 1e-5,
            intensity: radiance * area * mean * emission.mean_factor(),
            emission,
            texture,
        })
    }

    fn corners(&self) -> (Vec3A, Vec3A) {
        self.plane.bounds(self.plane.axis_x.abs() + self.plane.axis_y.abs())
    }

    #[inline]
    fn contains(xy: Vec2) -> bool {
        xy.abs().max_element() <= 1.0
    }

    /// The rectangle as seen from `from` if directions are drawn uniformly in solid angle there.
    #[inline]
    fn spherical(&self, from: Vec3A) -> Option<SphericalRect> {
        if !self.is_rectangle {
            return None;
        }
        // Cheap upper bound of the solid angle before the four arc cosines.
        let offset = from - self.plane.center;
        let bound = 1.0 / (self.pdf_area * offset.length_squared());
        if bound < 0.5 * MIN_SOLID_ANGLE {
            return None;
        }
        let rect = SphericalRect::new(&self.plane, from);
        (rect.solid_angle > MIN_SOLID_ANGLE).then_some(rect)
    }

    fn emitted(&self, xy: Vec2, direction: Vec3A) -> Rgb {
        let radiance = self.emission.towards(-direction);
        match &self.texture {
            None => radiance,
            // The image's first texel is at (+x, +y): seen from the lit side it is upright and not mirrored.
            Some(texture) => radiance * Vec3A::from_slice(&texture.lookup_from_top(0.5 - 0.5 * xy)[..3]),
        }
    }
}

impl Emitter for Rect {
    const KIND: KindSpec = KindSpec {
        name: "rect",
        doc: "A rectangle in the xy plane that emits along -z.",
        params: &[
            ParamSpec::float("width", 1.0, POSITIVE, "stage units", "Extent along x."),
            ParamSpec::float("height", 1.0, POSITIVE, "stage units", "Extent along y."),
            ParamSpec::text("texture:file", "", "", "Image that covers the rectangle once."),
        ],
    };

    fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample> {
        if !self.plane.is_seen_from(from) {
            return None;
        }
        let spherical = self.spherical(from);
        let point = match &spherical {
            Some(rect) => rect.sample(u),
            None => self.plane.at(u * 2.0 - 1.0),
        };
        let offset = point - from;
        let distance = offset.length();
        let direction = offset / distance;
        let pdf = match &spherical {
            Some(rect) => 1.0 / rect.solid_angle,
            None => self.plane.solid_angle_pdf(self.pdf_area, distance, direction),
        };
        if !(pdf > 0.0 && pdf.is_finite()) {
            return None;
        }
        let xy = match &spherical {
            Some(_) if self.texture.is_some() => self.plane.hit(from, direction).xy,
            _ => u * 2.0 - 1.0,
        };
        Some(LightSample { direction, distance, radiance: self.emitted(xy, direction), pdf, is_delta: false })
    }

    fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32 {
        let hit = self.plane.hit(from, direction);
        if !(hit.t > 0.0 && Self::contains(hit.xy) && self.plane.is_seen_from(from)) {
            return 0.0;
        }
        match self.spherical(from) {
            Some(rect) => 1.0 / rect.solid_angle,
            None => self.plane.solid_angle_pdf(self.pdf_area, hit.t, direction),
        }
    }

    fn radiance(&self, from: Vec3A, direction: Vec3A) -> Rgb {
        if !self.plane.is_seen_from(from) {
            return Rgb::ZERO;
        }
        self.emitted(self.plane.hit(from, direction).xy, direction)
    }

    fn intersect(&self, ray: &Ray) -> Option<f32> {
        self.plane.intersect(ray, Self::contains)
    }

    fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        Some(self.corners())
    }

    fn outreach(&self) -> Outreach {
        let cone = self.emission.cone_of_card(self.plane.normal);
        Outreach::Local(LightBounds::new(self.corners(), cone, self.intensity))
    }
}

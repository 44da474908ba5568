//! Light from everywhere: constant, or a lat-long image in the orientation of OpenEXR and UsdLux.
//!
//! Image coordinates (u, v), from the top left, and directions: a = pi - 2 pi u, b = pi/2 - pi v,
//! direction = (sin a cos b, sin b, cos a cos b). The middle of the image lies at +z, +x at u = 1/4.

use super::bounds::Outreach;
use super::build::LightBuilder;
use super::dome_table::DomeTable;
use super::{Emitter, LightSample};
use crate::kind::{KindSpec, ParamSpec};
use crate::texture::{Texture, Wrap};
use glam::{DMat3, DVec2, DVec3, Mat3A, Vec2, Vec3A};
use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;
use std::path::Path;
use tyndall_math::sampling::uniform_sphere;
use tyndall_math::{INV_4PI, Rgb};

#[derive(Debug, Clone)]
pub(super) struct Dome {
    radiance: Rgb,
    image: Option<(Texture, DomeTable)>,
    /// Orthonormal.
    world_from_dome: Mat3A,
    /// Largest channel of the mean radiance.
    mean: f64,
}

impl Dome {
    pub(super) fn build(builder: &mut LightBuilder, texture: Option<&Path>) -> Option<Self> {
        let radiance = builder.radiance(1.0)?;
        let mut mean = f64::from(radiance.max_element());
        let image = match texture.and_then(|path| builder.image(path)) {
            Some(image) => {
                let table = DomeTable::new(&image)?;
                let texture = Texture::new(image, Wrap::Repeat, Wrap::Clamp);
                mean *= f64::from(texture.mean_on_sphere().max_element());
                Some((texture, table))
            }
            None => None,
        };
        let Some(world_from_dome) = rotation(builder.linear) else {
            return builder
                .reject("the transform is singular", "the light was removed; repair its transform");
        };
        Some(Self { radiance, image, world_from_dome, mean })
    }

    #[inline]
    fn uv(&self, direction: Vec3A) -> Vec2 {
        uv_of(self.world_from_dome.transpose() * direction)
    }

    #[inline]
    fn radiance_at(&self, texture: &Texture, uv: Vec2) -> Rgb {
        self.radiance * Vec3A::from_slice(&texture.lookup_from_top(uv)[..3])
    }
}

/// The rotation (and mirroring) in a transform: its columns made orthonormal.
fn rotation(m: DMat3) -> Option<Mat3A> {
    let y = m.y_axis.try_normalize()?;
    let z = (m.z_axis - y * m.z_axis.dot(y)).try_normalize()?;
    let x = y.cross(z);
    let x = if m.x_axis.dot(x) < 0.0 { -x } else { x };
    Some(Mat3A::from_cols(x.as_vec3a(), y.as_vec3a(), z.as_vec3a()))
}

/// The direction at column `u` whose (cos, sin) of latitude is given.
pub(super) fn direction_of(u: f64, latitude: DVec2) -> Vec3A {
    let (sin_a, cos_a) = (PI - 2.0 * PI * u).sin_cos();
    DVec3::new(sin_a * latitude.x, latitude.y, cos_a * latitude.x).as_vec3a()
}

/// Image coordinates of a unit vector in the dome's space.
fn uv_of(d: Vec3A) -> Vec2 {
    let u = 0.5 - d.x.atan2(d.z) / TAU;
    let v = 0.5 - d.y.atan2(d.x.hypot(d.z)) * FRAC_1_PI;
    Vec2::new(u, v)
}

impl Emitter for Dome {
    const KIND: KindSpec = KindSpec {
        name: "dome",
        doc: "Light from all directions, constant or an image.",
        params: &[ParamSpec::text(
            "texture:file",
            "",
            "",
            "Lat-long image; the middle lies at +z, +x at a quarter.",
        )],
    };
    const IS_INFINITE: bool = true;

    fn sample(&self, _: Vec3A, u: Vec2) -> Option<LightSample> {
        let (local, radiance, pdf) = match &self.image {
            None => (uniform_sphere(u), self.radiance, INV_4PI),
            Some((texture, table)) => {
                let (local, uv, pdf) = table.sample(u);
                (local, self.radiance_at(texture, uv), pdf)
            }
        };
        let direction = (self.world_from_dome * local).normalize();
        (pdf > 0.0).then_some(LightSample {
            direction,
            distance: f32::INFINITY,
            radiance,
            pdf,
            is_delta: false,
        })
    }

    fn pdf(&self, _: Vec3A, direction: Vec3A) -> f32 {
        match &self.image {
            None => INV_4PI,
            Some((_, table)) => table.pdf(self.uv(direction)),
        }
    }

    fn radiance(&self, _: Vec3A, direction: Vec3A) -> Rgb {
        match &self.image {
            None => self.radiance,
            Some((texture, _)) => self.radiance_at(texture, self.uv(direction)),
        }
    }

    fn outreach(&self) -> Outreach {
        Outreach::Infinite { irradiance: PI * self.mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientation_is_that_of_openexr() {
        let at = |u: f64, b: f64| direction_of(u, DVec2::new(b.cos(), b.sin()));
        assert!((at(0.5, 0.0) - Vec3A::Z).length() < 1e-6);
        assert!((at(0.25, 0.0) - Vec3A::X).length() < 1e-6);
        assert!((at(0.3, PI / 2.0) - Vec3A::Y).length() < 1e-6);
        for (u, v) in [(0.1f32, 0.2f32), (0.7, 0.9), (0.25, 0.5), (0.99, 0.01)] {
            let d = at(f64::from(u), PI * (0.5 - f64::from(v)));
            assert!((uv_of(d) - Vec2::new(u, v)).length() < 1e-5);
        }
    }
}

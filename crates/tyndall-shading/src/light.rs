//! Lights: the closed set of kinds and the questions a renderer asks of each.
//!
//! Units are UsdLux's (schema text of usd-core 26.11): the radiance of a light is
//! `intensity * 2^exposure * color / size`, where `size` is 1 unless `normalize` is set. Positions are relative to the
//! world origin the light was built with (the camera), so that f32 suffices.
//!
//! Lights of finite area are bodies: rays hit them from both sides, and the side that does not emit is black. They are
//! opaque unless their prim says otherwise.
//! A new kind is one file with one `impl Emitter` and one name in the `closed_set!` line below.

mod bounds;
mod build;
mod cylinder;
mod disk;
mod distant;
mod dome;
mod dome_table;
mod emission;
mod infinite;
mod line;
mod plane;
mod point;
mod receiver;
mod rect;
mod set;
mod sphere;
mod spherical_rect;
mod tree;

#[cfg(test)]
mod tests;

pub use receiver::Receiver;
pub use set::LightSet;

use crate::KindSpec;
use bounds::Outreach;
use build::LightBuilder;
use cylinder::Cylinder;
use disk::Disk;
use distant::Distant;
use dome::Dome;
use glam::{DVec3, Vec2, Vec3A};
use line::Line;
use point::Point;
use rect::Rect;
use sphere::Sphere;
use tyndall_math::{Ray, Rgb};
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath, prim};

/// A direction towards a light, drawn by [`Light::sample`].
#[derive(Debug, Clone, Copy)]
pub struct LightSample {
    /// Unit vector from the receiver towards the light.
    pub direction: Vec3A,
    /// Distance to the sampled point; `f32::INFINITY` for distant lights and domes.
    pub distance: f32,
    /// Radiance arriving along `direction`. For delta lights: what a surface facing the light receives, so that in
    /// both cases `radiance / pdf` times cosine times BSDF is the estimate.
    pub radiance: Rgb,
    /// Density per steradian; 1 for delta lights.
    pub pdf: f32,
    /// The direction cannot be found by any other technique.
    pub is_delta: bool,
}

/// What a kind of light answers.
trait Emitter {
    /// Name and parameters.
    const KIND: KindSpec;

    /// Draws a direction; `None` where nothing can arrive from this light.
    fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample>;

    /// Density per steradian of [`Emitter::sample`]; 0 for directions it never draws and for delta lights.
    fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32;

    /// Radiance arriving at `from` from `direction`.
    fn radiance(&self, from: Vec3A, direction: Vec3A) -> Rgb;

    /// The nearest hit of a light that is a body.
    fn intersect(&self, _ray: &Ray) -> Option<f32> {
        None
    }

    /// Corners of the box around a light that is a body.
    fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        None
    }

    /// What the choice of a light needs to know: how much is sent, from where, and which way.
    fn outreach(&self) -> Outreach;

    /// No light comes from a place: distant lights and domes.
    const IS_INFINITE: bool = false;

    /// Only [`Emitter::sample`] can find it.
    fn is_delta(&self) -> bool {
        false
    }
}

macro_rules! closed_set {
    ($($kind:ident),+ $(,)?) => {
        #[derive(Debug, Clone)]
        enum Body { $($kind($kind)),+ }

        impl Light {
            /// Every kind with its parameters.
            pub const KINDS: &'static [KindSpec] = &[$(<$kind as Emitter>::KIND),+];

            /// Name of the kind.
            pub fn kind(&self) -> &'static str {
                match &self.body { $(Body::$kind(_) => <$kind as Emitter>::KIND.name),+ }
            }

            /// Draws a direction from `from` towards the light.
            #[inline]
            pub fn sample(&self, from: Vec3A, u: Vec2) -> Option<LightSample> {
                match &self.body { $(Body::$kind(it) => it.sample(from, u)),+ }
            }

            /// Density per steradian with which [`Self::sample`] draws the unit vector `direction`; 0 for delta lights.
            #[inline]
            pub fn pdf(&self, from: Vec3A, direction: Vec3A) -> f32 {
                match &self.body { $(Body::$kind(it) => it.pdf(from, direction)),+ }
            }

            /// Radiance that arrives at `from` from `direction`, given that the ray hits this light (or escapes, for
            /// distant lights and domes); 0 for delta lights.
            #[inline]
            pub fn radiance(&self, from: Vec3A, direction: Vec3A) -> Rgb {
                match &self.body { $(Body::$kind(it) => it.radiance(from, direction)),+ }
            }

            /// Parameter of the nearest hit in `[0, t_max]` with a light that has a surface.
            #[inline]
            pub fn intersect(&self, ray: &Ray) -> Option<f32> {
                match &self.body { $(Body::$kind(it) => it.intersect(ray)),+ }
            }

            /// Smallest and largest corner of a light that has a surface.
            pub fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
                match &self.body { $(Body::$kind(it) => it.bounds()),+ }
            }

            /// Whether its light comes from outside the scene.
            #[inline]
            pub fn is_infinite(&self) -> bool {
                match &self.body { $(Body::$kind(_) => <$kind as Emitter>::IS_INFINITE),+ }
            }

            /// Whether only [`Self::sample`] can find it.
            #[inline]
            pub fn is_delta(&self) -> bool {
                match &self.body { $(Body::$kind(it) => it.is_delta()),+ }
            }

            fn outreach(&self) -> Outreach {
                match &self.body { $(Body::$kind(it) => it.outreach()),+ }
            }
        }
        $(impl From<$kind> for Body { fn from(it: $kind) -> Self { Self::$kind(it) } })+
    };
}

closed_set!(Sphere, Point, Rect, Disk, Cylinder, Line, Distant, Dome);

/// A light, ready to be sampled.
#[derive(Debug, Clone)]
pub struct Light {
    body: Body,
    diffuse: f32,
    specular: f32,
    camera_visible: bool,
    opaque: bool,
}

impl Light {
    /// Builds the light of a prim; positions become relative to `world_origin`.
    ///
    /// `None` if it does not shine: hidden or black without a message, negative, without area or damaged with one.
    pub fn from_prim(
        path: &PrimPath,
        light: &prim::Light,
        world_origin: DVec3,
        assets: &dyn AssetLoader,
        diags: &mut Diagnostics,
    ) -> Option<Self> {
        if !light.visible {
            return None;
        }
        let mut builder = LightBuilder::new(path, light, world_origin, assets, diags)?;
        let body = builder.body()?;
        Some(Self {
            body,
            diffuse: builder.factor("diffuse", light.diffuse),
            specular: builder.factor("specular", light.specular),
            camera_visible: light.camera_visible,
            opaque: light.opaque,
        })
    }

    /// Whether camera rays see it.
    pub fn is_camera_visible(&self) -> bool {
        self.camera_visible
    }

    /// Whether its body, if it has one, is in the way of other light.
    pub fn is_opaque(&self) -> bool {
        self.opaque
    }

    /// Factor on what diffuse lobes and media receive.
    pub fn diffuse_factor(&self) -> f32 {
        self.diffuse
    }

    /// Factor on what glossy lobes receive.
    pub fn specular_factor(&self) -> f32 {
        self.specular
    }
}

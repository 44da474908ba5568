//! What a medium is: coefficients, phase function, emission, optional density.

use crate::{BrickGrid, PhaseMix, Tint};
use glam::{Affine3A, BVec3A, Vec3A};
use std::sync::Arc;
use tyndall_math::{Ray, Rgb, blackbody_radiance};

/// Coefficients above this (per stage unit) are cut: sums and products stay finite.
const MAX_COEFFICIENT: f32 = 1e20;

/// A density read from a grid.
#[derive(Debug, Clone)]
pub struct GridDensity {
    /// The voxels.
    pub grid: Arc<BrickGrid>,
    /// Maps world points to index coordinates, where voxel centres are integers. Any affine map.
    pub index_from_world: Affine3A,
}

/// A participating medium. Media that overlap add: smoke whose fire comes from another grid is two media in one place,
/// one that only scatters and absorbs and one that only emits. Each grid then bounds and steps by its own voxels.
///
/// Negative, NaN and denormal coefficients read as zero.
#[derive(Debug, Clone)]
pub struct Medium {
    /// Absorption coefficient at density 1, per stage unit.
    pub sigma_a: Rgb,
    /// Scattering coefficient at density 1, per stage unit.
    pub sigma_s: Rgb,
    /// What shines by itself.
    pub emission: Emission,
    /// Where scattered light goes.
    pub phase: PhaseMix,
    /// Multiplies both coefficients and feeds emission; `None` is density 1 everywhere.
    pub density: Option<GridDensity>,
    /// Adds what follows a grid of colours. Only where there is a density.
    pub tint: Option<Tint>,
}

/// Light that a medium emits into all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Emission {
    /// Radiance per stage unit at density 1, times the density.
    Glow(Rgb),
    /// The density is a temperature.
    Blackbody {
        /// Kelvin at density 1, times the density.
        kelvin: f32,
        /// Radiance per stage unit over that of [`blackbody_radiance`].
        intensity: Rgb,
    },
}

impl Emission {
    /// None.
    pub const NONE: Self = Self::Glow(Rgb::ZERO);

    /// Emitted radiance per stage unit where the density is `density`.
    #[inline]
    pub fn at(&self, density: f32) -> Rgb {
        match *self {
            Self::Glow(color) => color * density,
            Self::Blackbody { kelvin, intensity } => usable(intensity * blackbody_radiance(kelvin * density)),
        }
    }

    /// There is no light at any density.
    #[inline]
    pub fn is_dark(&self) -> bool {
        match *self {
            Self::Glow(color) => color == Rgb::ZERO,
            Self::Blackbody { kelvin, intensity } => kelvin == 0.0 || intensity == Rgb::ZERO,
        }
    }

    /// Made fit for arithmetic.
    #[inline]
    pub(crate) fn usable(self) -> Self {
        match self {
            Self::Glow(color) => Self::Glow(usable(color)),
            Self::Blackbody { kelvin, intensity } => {
                let kelvin = if kelvin > 0.0 { kelvin } else { 0.0 };
                Self::Blackbody { kelvin, intensity: usable(intensity) }
            }
        }
    }
}

impl Medium {
    /// The coefficients at density 1, made fit for arithmetic; with a tint, upper bounds over its colours.
    #[inline]
    pub fn coefficients(&self) -> Coefficients {
        if let Some(tint) = &self.tint {
            return self.most_tinted(tint);
        }
        let sigma_s = usable(self.sigma_s);
        Coefficients { sigma_t: usable(self.sigma_a) + sigma_s, sigma_s }
    }

    /// It may emit light.
    #[inline]
    pub fn emits(&self) -> bool {
        !self.emission.usable().is_dark()
            || self.tint.as_ref().is_some_and(|tint| usable(tint.glow) != Rgb::ZERO)
    }
}

/// Zero for NaN, negative and denormal channels; cut at [`MAX_COEFFICIENT`].
#[inline]
pub(crate) fn usable(c: Rgb) -> Rgb {
    let normal = c.cmpge(Vec3A::splat(f32::MIN_POSITIVE));
    Rgb::select(normal, c.min(Vec3A::splat(MAX_COEFFICIENT)), Rgb::ZERO)
}

/// An interval of a ray inside a medium. In f64: the thinnest layer and the first free flight into the densest medium are
/// not lost in the rounding of how far away they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Where it begins, in units of the ray's direction.
    pub t0: f64,
    /// Where it ends; infinite for an unbounded medium.
    pub t1: f64,
    /// Index into the list of media.
    pub medium: u32,
}

impl Span {
    /// The part on the ray, if not empty.
    #[inline]
    pub(crate) fn clipped(&self, ray: &Ray) -> Option<[f64; 2]> {
        let (t0, t1) = (self.t0.max(0.0), self.t1.min(f64::from(ray.t_max)));
        (t0 < t1).then_some([t0, t1])
    }
}

/// The sums of all media at a point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Coefficients {
    /// Extinction, absorption plus scattering, per stage unit.
    pub sigma_t: Rgb,
    /// Scattering, per stage unit.
    pub sigma_s: Rgb,
}

impl Coefficients {
    /// Adds `density` times `other`.
    #[inline]
    pub(crate) fn add_scaled(&mut self, other: &Coefficients, density: f32) {
        self.sigma_t += other.sigma_t * density;
        self.sigma_s += other.sigma_s * density;
    }

    /// Nothing is in the way.
    #[inline]
    pub fn is_zero(&self) -> bool {
        self.sigma_t == Rgb::ZERO
    }

    /// Extinction is the same in all channels.
    #[inline]
    pub fn is_achromatic(&self) -> bool {
        self.sigma_t == Rgb::splat(self.sigma_t.x)
    }

    /// Something scatters.
    #[inline]
    pub fn scatters(&self) -> bool {
        self.sigma_s != Rgb::ZERO
    }

    /// sigma_s / sigma_t per channel, 0 where nothing is there.
    #[inline]
    pub fn albedo(&self) -> Rgb {
        let any: BVec3A = self.sigma_t.cmpgt(Rgb::ZERO);
        Rgb::select(any, self.sigma_s / Rgb::select(any, self.sigma_t, Rgb::ONE), Rgb::ZERO)
    }
}

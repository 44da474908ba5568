//! Colour that varies from point to point: coefficients and glow that follow a grid of colours.

use crate::grid::ColorGrid;
use crate::medium::{Coefficients, Medium, usable};
use glam::{Affine3A, Vec3A};
use std::sync::Arc;
use tyndall_math::Rgb;

/// Extinction that differs by less than this share between colours comes from rounding.
const SAME: f32 = 1e-6;

/// What a grid of colours adds to a medium, all of it multiplied by the medium's density like the rest.
///
/// At colour c the coefficients are `medium.sigma + tint.sigma * c`. An albedo that varies takes from absorption what
/// it gives to scattering: `sigma_a` is then negative and extinction the same everywhere.
#[derive(Debug, Clone)]
pub struct Tint {
    /// The colours.
    pub grid: Arc<ColorGrid>,
    /// Maps world points to index coordinates. Any affine map.
    pub index_from_world: Affine3A,
    /// The density is the largest component of this very grid: what counts is colour over density, at most 1.
    pub is_relative: bool,
    /// Absorption coefficient at density 1 and colour 1, per stage unit.
    pub sigma_a: Rgb,
    /// Scattering coefficient at density 1 and colour 1, per stage unit.
    pub sigma_s: Rgb,
    /// Radiance per stage unit at density 1 and colour 1.
    pub glow: Rgb,
    /// Components above this are cut.
    pub most: f32,
}

impl Tint {
    /// The colour at a point of the world where the density is `density`.
    #[inline]
    pub fn color(&self, point: Vec3A, density: f32) -> Rgb {
        let color = self.grid.color(self.index_from_world.transform_point3a(point));
        let color = if self.is_relative { color / density.max(f32::MIN_POSITIVE) } else { color };
        color.min(Rgb::splat(self.most))
    }
}

impl Medium {
    /// The coefficients at density 1 where the tint's colour is `color`.
    #[inline]
    pub(crate) fn tinted(&self, tint: &Tint, color: Rgb) -> Coefficients {
        let sigma_s = usable(self.sigma_s + tint.sigma_s * color);
        Coefficients { sigma_t: usable(self.sigma_a + tint.sigma_a * color) + sigma_s, sigma_s }
    }

    /// Per channel the largest coefficients that any colour gives at density 1. They are convex in the colour (linear,
    /// but for the cut at 0), so the ends of its range decide.
    pub(crate) fn most_tinted(&self, tint: &Tint) -> Coefficients {
        let [a, b] = self.extremes(tint);
        Coefficients { sigma_t: a.sigma_t.max(b.sigma_t), sigma_s: a.sigma_s.max(b.sigma_s) }
    }

    /// Per channel a lower bound of extinction at density 1.
    #[inline]
    pub(crate) fn least_extinction(&self) -> Rgb {
        let Some(tint) = &self.tint else { return self.coefficients().sigma_t };
        let [a, b] = self.extremes(tint).map(|c| c.sigma_t);
        let brightest = Rgb::splat(tint.most);
        let is_linear = (self.sigma_a + tint.sigma_a * brightest).cmpge(Rgb::ZERO)
            & (self.sigma_s + tint.sigma_s * brightest).cmpge(Rgb::ZERO);
        Rgb::select(is_linear, a.min(b) * (1.0 - SAME), Rgb::ZERO)
    }

    /// Whether extinction at density 1 depends on the colour.
    #[inline]
    pub(crate) fn has_tinted_extinction(&self) -> bool {
        self.tint.as_ref().is_some_and(|tint| {
            let [a, b] = self.extremes(tint).map(|c| c.sigma_t);
            !a.abs_diff_eq(b, SAME * a.max_element())
        })
    }

    fn extremes(&self, tint: &Tint) -> [Coefficients; 2] {
        [Rgb::ZERO, Rgb::splat(tint.most)].map(|color| self.tinted(tint, color))
    }
}

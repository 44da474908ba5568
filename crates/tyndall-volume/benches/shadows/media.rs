//! Media that are hard in different ways, and chords through them.

use glam::{Affine3A, IVec3, Vec3A};
use std::sync::Arc;
use tyndall_math::random::{Pcg, hash_key};
use tyndall_math::{Ray, sampling};
use tyndall_volume::GridDensity;
use tyndall_volume::grid::DenseGrid;

/// Voxels along a side.
const EDGE: i32 = 128;
/// Points of a ray at which the density is read to find its mean.
const STEPS: u32 = 400;

/// A kind of medium: its density at a voxel.
pub(crate) struct Class {
    pub(crate) name: &'static str,
    density: fn(IVec3) -> f32,
}

/// All kinds.
pub(crate) const CLASSES: [Class; 5] = [
    Class { name: "even", density: |v| 1.0 + 0.05 * waves(v) },
    Class { name: "smooth", density: |v| 1.0 + 0.9 * waves(v) },
    Class { name: "core", density: |v| 0.5 + 0.5 * waves(v) + noise(v, 1) },
    Class { name: "wisps", density: wisps },
    Class { name: "spikes", density: |v| if noise(v, 2) < 0.002 { 20.0 } else { 0.2 } },
];

/// A medium of density 1 a voxel, and the rays through it.
pub(crate) struct Scene {
    pub(crate) density: GridDensity,
    pub(crate) rays: Vec<Ray>,
    /// Optical depth of a ray at extinction 1, on average.
    pub(crate) mean_density_along_rays: f32,
}

impl Class {
    pub(crate) fn scene(&self, n_rays: usize) -> Scene {
        let grid = DenseGrid::from_fn(IVec3::ZERO, IVec3::splat(EDGE), self.density).to_bricks();
        let density = GridDensity { grid: Arc::new(grid), index_from_world: Affine3A::IDENTITY };
        let rays: Vec<Ray> = chords().take(n_rays).collect();
        let depth = |ray: &Ray| {
            let at = |i: u32| ray.at((i as f32 + 0.5) / STEPS as f32 * ray.t_max);
            (0..STEPS).map(|i| density.grid.density(at(i))).sum::<f32>() / STEPS as f32 * ray.t_max
        };
        let mean_density_along_rays = rays.iter().map(depth).sum::<f32>() / n_rays as f32;
        Scene { density, rays, mean_density_along_rays }
    }
}

/// A number in [0, 1) that depends on `v` only.
fn noise(v: IVec3, seed: u64) -> f32 {
    (hash_key(&[seed, v.x as u64, v.y as u64, v.z as u64]) >> 40) as f32 / (1u64 << 24) as f32
}

/// Between -1 and 1, with waves of about 40 voxels.
fn waves(v: IVec3) -> f32 {
    let p = v.as_vec3a() * 0.15;
    p.x.sin() * (p.y + 0.5 * p.x).cos() * (p.z - 0.3 * p.y).sin()
}

/// Thin sheets in empty space, torn by noise.
fn wisps(v: IVec3) -> f32 {
    let sheet = 1.0 - 12.0 * (waves(v) - 0.4).abs();
    if sheet > 0.0 { sheet * noise(v, 3) } else { 0.0 }
}

/// From sphere to sphere, as far as the box goes.
fn chords() -> impl Iterator<Item = Ray> {
    let mut rng = Pcg::new(&[2]);
    let centre = Vec3A::splat(0.5 * EDGE as f32);
    std::iter::repeat_with(move || {
        let mut on_sphere = || sampling::uniform_sphere(glam::Vec2::new(rng.next_f32(), rng.next_f32()));
        let (a, b) = (centre + on_sphere() * centre, centre + on_sphere() * centre);
        Ray { origin: a, direction: (b - a).normalize_or(Vec3A::X), t_max: (b - a).length() }
    })
}

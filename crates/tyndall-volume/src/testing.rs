//! What the tests of several modules share.

use crate::grid::DenseGrid;
use crate::phase::Isotropic;
use crate::{BrickGrid, ColorGrid, Emission, GridDensity, Medium, Phase, PhaseMix, SparseVoxels, Tint};
use glam::{Affine3A, IVec3, Mat3, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_math::random::hash_key;
use tyndall_math::{CompensatedSum, Ray, Rgb};

/// Mean and standard error of a stream of numbers.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mean {
    n: u64,
    sum: CompensatedSum,
    squares: CompensatedSum,
}

impl Mean {
    pub(crate) fn add(&mut self, x: f32) {
        let x = f64::from(x);
        assert!(x.is_finite());
        self.n += 1;
        self.sum.add(x);
        self.squares.add(x * x);
    }

    pub(crate) fn value(&self) -> f64 {
        self.sum.value() / self.n as f64
    }

    pub(crate) fn relative_variance(&self) -> f64 {
        self.squares.value() / self.n as f64 / self.value().powi(2) - 1.0
    }

    /// Fails if the mean is more than four standard errors from `expected`, beyond the quadrature's error.
    pub(crate) fn assert_near(&self, expected: f64, what: &str) {
        let n = self.n as f64;
        let variance = (self.squares.value() / n - self.value().powi(2)).max(0.0);
        let error = (variance / n).sqrt();
        let slack = 4.0 * error + 2e-5 * expected.abs() + 1e-9;
        let mean = self.value();
        assert!((mean - expected).abs() < slack, "{what}: {mean} +- {error}, expected {expected}");
    }
}

/// Three means.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RgbMean(pub(crate) [Mean; 3]);

impl RgbMean {
    pub(crate) fn add(&mut self, c: Rgb) {
        for i in 0..3 {
            self.0[i].add(c[i]);
        }
    }

    pub(crate) fn assert_near(&self, expected: [f64; 3], what: &str) {
        for (i, (mean, expected)) in self.0.iter().zip(expected).enumerate() {
            mean.assert_near(expected, &format!("{what}, channel {i}"));
        }
    }
}

pub(crate) fn homogeneous(sigma_a: Rgb, sigma_s: Rgb) -> Medium {
    Medium {
        sigma_a,
        sigma_s,
        emission: Emission::NONE,
        phase: PhaseMix::single(Phase::Isotropic(Isotropic)),
        density: None,
        tint: None,
    }
}

pub(crate) fn with_grid(medium: Medium, grid: BrickGrid, index_from_world: Affine3A) -> Medium {
    Medium { density: Some(GridDensity { grid: Arc::new(grid), index_from_world }), ..medium }
}

/// A number in [0, 1) that depends on `v` only.
pub(crate) fn noise(v: IVec3, seed: u64) -> f32 {
    let key = [seed, v.x as u64, v.y as u64, v.z as u64];
    (hash_key(&key) >> 40) as f32 / (1u64 << 24) as f32
}

/// 24 x 20 x 16 voxels with a smooth part, noise, two empty slabs and a spike.
pub(crate) fn cloud(spike: f32) -> DenseGrid {
    DenseGrid::from_fn(IVec3::new(-3, 2, -9), IVec3::new(40, 20, 16), |v| match v {
        v if (5..14).contains(&v.x) => 0.0,
        v if v == IVec3::new(20, 10, -1) => spike,
        v => 0.3 + 0.7 * noise(v, 1) * (0.2 * v.x as f32).sin().abs(),
    })
}

/// A rotated, sheared, unequally scaled placement and a ray across [`cloud`] in it.
pub(crate) fn placement() -> (Affine3A, Ray) {
    let linear =
        Mat3::from_cols(Vec3::new(11.0, 2.0, 0.5), Vec3::new(-1.0, 7.0, 1.0), Vec3::new(0.3, -2.0, 6.0));
    let index_from_world = Affine3A::from_mat3_translation(linear, Vec3::new(-4.0, 11.0, -1.5));
    let world_from_index = index_from_world.inverse();
    let (a, b) = (Vec3A::new(-9.0, 8.2, -3.0), Vec3A::new(42.0, 11.7, 1.0));
    let (a, b) = (world_from_index.transform_point3a(a), world_from_index.transform_point3a(b));
    let ray = Ray { origin: a, direction: (b - a).normalize(), t_max: (b - a).length() };
    (index_from_world, ray)
}

/// Colours in [0, 1) for the voxels of [`cloud`] and some around them, with a cell of nothing.
fn color(v: IVec3) -> [f32; 3] {
    if v.y < 6 { [0.0; 3] } else { [2, 3, 4].map(|seed| noise(v >> 1i32, seed)) }
}

fn color_grid(color: impl Fn(IVec3) -> [f32; 3]) -> ColorGrid {
    let (lo, size) = (IVec3::new(-8, 0, -16), IVec3::new(56, 24, 24));
    let component = |c: usize| DenseGrid::from_fn(lo, size, |v| color(v)[c]).leaves();
    let (r, g, b) = (component(0), component(1), component(2));
    let joined =
        |i: usize| -> Vec<[f32; 3]> { (0..512).map(|k| [r[i].1[k], g[i].1[k], b[i].1[k]]).collect() };
    let leaves: Vec<_> = (0..r.len()).map(|i| (r[i].0, joined(i))).collect();
    let leaves = leaves.iter().map(|(origin, colors)| (*origin, &colors[..])).collect();
    ColorGrid::build(&SparseVoxels { leaves, ..Default::default() }).0
}

/// [`cloud`] with this base, and a tint by a grid with a placement of its own.
fn tinted(sigma: [Rgb; 2], [sigma_a, sigma_s, glow]: [Rgb; 3]) -> (Medium, Ray) {
    let (index_from_world, ray) = placement();
    let smoke = with_grid(homogeneous(sigma[0], sigma[1]), cloud(3.0).to_bricks(), index_from_world);
    let grid = Arc::new(color_grid(color));
    let most = grid.max_component();
    let index_from_world = Affine3A::from_translation(Vec3::new(0.3, -0.4, 0.7)) * index_from_world;
    let tint = Tint { grid, index_from_world, is_relative: false, sigma_a, sigma_s, glow, most };
    (Medium { tint: Some(tint), ..smoke }, ray)
}

/// The colour is the albedo: extinction is the same everywhere.
pub(crate) fn albedo_tint() -> (Medium, Ray) {
    let k = Rgb::splat(0.8);
    tinted([k, Rgb::ZERO], [-k, k, Rgb::ZERO])
}

/// The colour adds to absorption and scattering.
pub(crate) fn dye_tint() -> (Medium, Ray) {
    let base = [Rgb::splat(0.1), Rgb::splat(0.3)];
    tinted(base, [Rgb::new(0.5, 0.0, 0.2), Rgb::new(0.4, 1.0, 0.1), Rgb::ZERO])
}

/// The colour shines, by itself and in smoke that it doesn't change.
pub(crate) fn glow_tint() -> (Medium, Ray) {
    tinted([Rgb::splat(0.2), Rgb::splat(0.3)], [Rgb::ZERO, Rgb::ZERO, Rgb::new(1.0, 2.0, 0.5)])
}

/// Coefficients are the colours; the density is their largest component.
pub(crate) fn relative_tint() -> (Medium, Ray) {
    let (index_from_world, ray) = placement();
    let largest = DenseGrid::from_fn(IVec3::new(-8, 0, -16), IVec3::new(56, 24, 24), |v| {
        color(v).into_iter().fold(0.0, f32::max)
    });
    let medium = with_grid(homogeneous(Rgb::ZERO, Rgb::ZERO), largest.to_bricks(), index_from_world);
    let grid = Arc::new(color_grid(color));
    let (sigma_a, sigma_s, glow) = (Rgb::splat(0.2), Rgb::new(1.0, 0.5, 0.8), Rgb::new(0.0, 1.0, 0.5));
    let tint = Tint { grid, index_from_world, is_relative: true, sigma_a, sigma_s, glow, most: 1.0 };
    (Medium { tint: Some(tint), ..medium }, ray)
}

//! Synthetic clouds and the points and rays that look at them.

use glam::{IVec3, Vec3A};
use half::f16;
use rayon::prelude::*;
use tyndall_math::random::{Pcg, hash_key};
use tyndall_math::{Ray, sampling};

/// 8^3 values, offset x << 6 | y << 3 | z, at a multiple of 8.
pub(crate) type Leaf = ([i32; 3], Vec<f32>);

/// A number in [0, 1) that depends on `v` only.
fn noise(v: IVec3, seed: u64) -> f32 {
    (hash_key(&[seed, v.x as u64, v.y as u64, v.z as u64]) >> 40) as f32 / (1u64 << 24) as f32
}

/// A ball of noise with holes of `edge` / 16 voxels; every value is a half float, so all layouts hold the same field.
pub(crate) fn cloud(edge: i32) -> Vec<Leaf> {
    let (centre, hole) = (edge as f32 * 0.5, edge / 16);
    let value = move |v: IVec3| {
        let r = (v.as_vec3a() - centre).length() / (centre * 0.94);
        let is_empty = r > 1.0 || noise(v / hole, 1) < 0.3;
        if is_empty { 0.0 } else { f16::from_f32((1.0 - r) * (0.5 + 0.5 * noise(v, 2))).to_f32() }
    };
    leaves(edge, value)
}

/// Density 1 +- a quarter of the way to `contrast` in smooth waves of 20 voxels: fog without holes.
pub(crate) fn fog(edge: i32, contrast: f32) -> Vec<Leaf> {
    leaves(edge, move |v| {
        let wave = (v.as_vec3a() * 0.3).to_array().map(f32::sin);
        1.0 + 0.25 * contrast * (wave[0] + wave[1] * wave[2])
    })
}

fn leaves(edge: i32, value: impl Fn(IVec3) -> f32 + Sync) -> Vec<Leaf> {
    let n = edge / 8;
    let leaf = |i: i32| {
        let origin = IVec3::new(i / (n * n), i / n % n, i % n) * 8;
        let at = |j: i32| value(origin + IVec3::new(j >> 6, j >> 3 & 7, j & 7));
        (origin.to_array(), (0..512).map(at).collect::<Vec<_>>())
    };
    let all = (0..n * n * n).into_par_iter().map(leaf);
    all.filter(|(_, values)| values.iter().any(|&value| value > 0.0)).collect()
}

/// Points anywhere in a box of `edge` voxels.
pub(crate) fn random_points(edge: i32, n: usize) -> Vec<Vec3A> {
    let mut rng = Pcg::new(&[6]);
    let mut next = || rng.next_f32() * (edge - 1) as f32;
    (0..n).map(|_| Vec3A::new(next(), next(), next())).collect()
}

/// Points along rays, in order, two voxels apart on average.
pub(crate) fn ray_points(edge: i32, n: usize) -> Vec<Vec3A> {
    let mut rng = Pcg::new(&[7]);
    let mut points = Vec::with_capacity(n);
    for ray in rays(edge, n) {
        let mut t = 0.0;
        while t < ray.t_max && points.len() < n {
            points.push(ray.at(t));
            t += 4.0 * rng.next_f32();
        }
    }
    points
}

/// `n` chords of the ball inside a box of `edge` voxels, in index coordinates.
pub(crate) fn rays(edge: i32, n: usize) -> impl Iterator<Item = Ray> {
    let mut rng = Pcg::new(&[2]);
    let centre = Vec3A::splat(edge as f32 * 0.5);
    std::iter::repeat_with(move || {
        let mut on_sphere = || sampling::uniform_sphere(glam::Vec2::new(rng.next_f32(), rng.next_f32()));
        let (a, b) = (centre + on_sphere() * centre, centre + on_sphere() * centre);
        Ray { origin: a, direction: (b - a).normalize_or(Vec3A::X), t_max: (b - a).length() }
    })
    .take(n)
}

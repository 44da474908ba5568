//! Look-ups and nanoseconds per ray through a cloud of 256^3 voxels, and per random fetch.
//!
//! The cloud is a sphere of noise with holes, at three optical depths across. Run with
//! `cargo bench -p tyndall-volume`.

use divan::{Bencher, black_box};
use glam::{Affine3A, IVec3, Vec3, Vec3A};
use std::sync::{Arc, LazyLock};
use tyndall_math::random::{Pcg, hash_key};
use tyndall_math::{Ray, Rgb, sampling};
use tyndall_volume::grid::DenseGrid;
use tyndall_volume::{
    BrickGrid, Emission, GridDensity, Medium, Phase, Span, WalkStats, sample_collision, transmittance,
};

fn main() {
    for tau in TAUS {
        let (mut walks, mut shadows) = (WalkStats::default(), WalkStats::default());
        let (media, rays, mut rng) = (media(tau), rays(), Pcg::new(&[1]));
        for ray in rays.iter() {
            sample_collision(&media, &SPANS, ray, Rgb::ONE, &mut rng, &mut walks);
            transmittance(&media, &SPANS, ray, &mut rng, &mut shadows);
        }
        let per_ray = |n: u64| n as f64 / rays.len() as f64;
        println!(
            "tau {tau:>5}: {:.2} look-ups a walk, {:.2} a shadow ray",
            per_ray(walks.lookups),
            per_ray(shadows.lookups)
        );
    }
    println!("{} MiB", CLOUD.memory_bytes() >> 20);
    divan::main();
}

/// Mean optical depth across.
const TAUS: [f32; 3] = [0.5, 5.0, 500.0];
const SPANS: [Span; 1] = [Span { t0: 0.0, t1: f64::INFINITY, medium: 0 }];

static CLOUD: LazyLock<Arc<BrickGrid>> = LazyLock::new(|| {
    let noise = |v: IVec3, seed: u64| {
        (hash_key(&[seed, v.x as u64, v.y as u64, v.z as u64]) >> 40) as f32 / (1u64 << 24) as f32
    };
    let dense = DenseGrid::from_fn(IVec3::ZERO, IVec3::splat(256), |v| {
        let r = (v.as_vec3() - 128.0).length() / 120.0;
        if r > 1.0 || noise(v >> 4i32, 1) < 0.3 { 0.0 } else { (1.0 - r) * (0.5 + 0.5 * noise(v, 2)) }
    });
    Arc::new(dense.to_bricks())
});

fn media(tau: f32) -> [Medium; 1] {
    let index_from_world = Affine3A::from_scale_rotation_translation(
        Vec3::splat(128.0),
        glam::Quat::from_rotation_y(0.3),
        Vec3::splat(128.0),
    );
    let density = Some(GridDensity { grid: CLOUD.clone(), index_from_world });
    let sigma_s = Rgb::splat(tau * 2.0);
    [Medium {
        sigma_a: Rgb::ZERO,
        sigma_s,
        emission: Emission::NONE,
        phase: Phase::henyey_greenstein(0.0).into(),
        density,
        tint: None,
    }]
}

/// Rays from a sphere of radius 2 to points inside the cloud.
fn rays() -> Vec<Ray> {
    let mut rng = Pcg::new(&[2]);
    let mut sphere = || sampling::uniform_sphere(glam::Vec2::new(rng.next_f32(), rng.next_f32()));
    (0..20_000)
        .map(|_| {
            let origin = sphere() * 2.0;
            Ray::new(origin, (sphere() * 0.7 - origin).normalize())
        })
        .collect()
}

#[divan::bench(args = TAUS)]
fn walk(bencher: Bencher<'_, '_>, tau: f32) {
    let (media, rays, mut rng, mut stats) = (media(tau), rays(), Pcg::new(&[3]), WalkStats::default());
    let mut i = 0;
    bencher.counter(divan::counter::ItemsCount::new(1000u32)).bench_local(|| {
        for _ in 0..1000 {
            i = (i + 1) % rays.len();
            black_box(sample_collision(&media, &SPANS, &rays[i], Rgb::ONE, &mut rng, &mut stats));
        }
    });
}

#[divan::bench(args = TAUS)]
fn walk_chromatic(bencher: Bencher<'_, '_>, tau: f32) {
    let (mut media, rays, mut rng, mut stats) = (media(tau), rays(), Pcg::new(&[3]), WalkStats::default());
    media[0].sigma_s *= Rgb::new(1.0, 0.7, 0.4);
    let mut i = 0;
    bencher.counter(divan::counter::ItemsCount::new(1000u32)).bench_local(|| {
        for _ in 0..1000 {
            i = (i + 1) % rays.len();
            black_box(sample_collision(&media, &SPANS, &rays[i], Rgb::ONE, &mut rng, &mut stats));
        }
    });
}

#[divan::bench(args = TAUS)]
fn shadow(bencher: Bencher<'_, '_>, tau: f32) {
    let (media, rays, mut rng, mut stats) = (media(tau), rays(), Pcg::new(&[4]), WalkStats::default());
    let mut i = 0;
    bencher.counter(divan::counter::ItemsCount::new(1000u32)).bench_local(|| {
        for _ in 0..1000 {
            i = (i + 1) % rays.len();
            black_box(transmittance(&media, &SPANS, &rays[i], &mut rng, &mut stats));
        }
    });
}

#[divan::bench]
fn homogeneous(bencher: Bencher<'_, '_>) {
    let media = [Medium { density: None, ..media(0.5)[0].clone() }];
    let (rays, mut rng, mut stats) = (rays(), Pcg::new(&[5]), WalkStats::default());
    let mut i = 0;
    bencher.counter(divan::counter::ItemsCount::new(1000u32)).bench_local(|| {
        for _ in 0..1000 {
            i = (i + 1) % rays.len();
            black_box(sample_collision(&media, &SPANS, &rays[i], Rgb::ONE, &mut rng, &mut stats));
        }
    });
}

#[divan::bench]
fn random_fetch(bencher: Bencher<'_, '_>) {
    let mut rng = Pcg::new(&[6]);
    let mut p = || Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 140.0 + 58.0;
    let points: Vec<_> = (0..65_536).map(|_| p()).collect();
    let mut i = 0;
    bencher.counter(divan::counter::ItemsCount::new(1000u32)).bench_local(|| {
        for _ in 0..1000 {
            i = (i + 1) % points.len();
            black_box(CLOUD.density(points[i]));
        }
    });
}

//! Building four million instances; then rays per second of one thread on a terrain of a million triangles and on
//! twenty quads, in CPU time, beside the binary tree of `obvhs`.
//!
//! `cargo run --release --example mrays -p tyndall-geometry`

use glam::{Affine3A, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use std::sync::Arc;
use std::time::Duration;
use tyndall_geometry::{Accel, Blas, Instance, SimdLevel};
use tyndall_math::{Ray, offset_ray_origin, random::Pcg};

/// CPU seconds of all threads of this process so far (Linux).
fn process_cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let schedstat = tasks.filter_map(|t| std::fs::read_to_string(t.path().join("schedstat")).ok());
    schedstat.filter_map(|s| s.split_whitespace().next()?.parse::<f64>().ok()).sum::<f64>() * 1e-9
}

/// CPU seconds of this thread so far (Linux).
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    stat.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

fn terrain(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let height = |x: f32, y: f32| {
        (0..7)
            .map(|o| {
                ((x * 2f32.powi(o) * 3.1).sin() * (y * 2f32.powi(o) * 2.7).cos()) * 0.12 / 1.8f32.powi(o)
            })
            .sum()
    };
    let point = |i: u32| {
        let (x, y) =
            ((i % (n + 1)) as f32 / n as f32 * 2.0 - 1.0, (i / (n + 1)) as f32 / n as f32 * 2.0 - 1.0);
        Vec3::new(x, y, height(x, y))
    };
    let mut indices = Vec::new();
    for i in (0..n * (n + 1)).filter(|i| i % (n + 1) < n) {
        indices.extend([[i, i + 1, i + n + 2], [i, i + n + 2, i + n + 1]]);
    }
    ((0..(n + 1) * (n + 1)).map(point).collect(), indices)
}

fn quads(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut rng = Pcg::new(&[1]);
    let mut cube = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
    let mut positions = Vec::new();
    for _ in 0..n {
        let (p, a, b) = (cube(), cube() * 0.4, cube() * 0.4);
        positions.extend([p, p + a, p + a + b, p + b]);
    }
    (positions, (0..n).flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]]).collect())
}

fn cosine(rng: &mut Pcg, n: Vec3A) -> Vec3A {
    loop {
        let v = Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
        if (1e-4..1.0).contains(&v.length_squared()) {
            return (n * 1.0001 + v.normalize()).normalize();
        }
    }
}

/// Best of three, in million rays per CPU second.
fn rate(rays: &[Ray], mut trace: impl FnMut(&Ray) -> bool) -> f64 {
    let once = |trace: &mut dyn FnMut(&Ray) -> bool| {
        let start = cpu_seconds();
        std::hint::black_box(rays.iter().filter(|r| trace(r)).count());
        rays.len() as f64 / (cpu_seconds() - start) * 1e-6
    };
    (0..3).map(|_| once(&mut trace)).fold(0.0, f64::max)
}

fn measure(name: &str, positions: &[Vec3], indices: &[[u32; 3]], eye: Vec3A) {
    let start = cpu_seconds();
    let blas = Arc::new(Blas::from_triangles(positions, indices));
    println!("{name}: {} triangles, {:.1} MB", indices.len(), blas.memory_bytes() as f64 * 1e-6);
    println!("  build {:.2} s (this thread's share)", cpu_seconds() - start);
    let accel =
        Accel::build(vec![Instance { blas, world_from_object: Affine3A::IDENTITY, motion: Vec::new() }]);
    let mut rng = Pcg::new(&[2]);
    let mut camera = Vec::new();
    for i in 0..512 * 512 {
        let (x, y) = ((i % 512) as f32 / 256.0 - 1.0, (i / 512) as f32 / 256.0 - 1.0);
        camera.push(Ray::new(eye, (Vec3A::new(x * 0.9, y * 0.9, 0.0) - eye).normalize()));
    }
    let (mut diffuse, mut shadow) = (Vec::new(), Vec::new());
    for ray in &camera {
        let Some(hit) = accel.intersect(ray, 0.0) else { continue };
        let p = accel.surface_point(ray, 0.0, &hit);
        let n = p.geometric_normal * -p.geometric_normal.dot(ray.direction).signum();
        let away = cosine(&mut rng, n);
        diffuse.push(Ray::new(offset_ray_origin(p.position, p.error, n, away), away));
        let light = Vec3A::new(rng.next_f32() - 0.5, rng.next_f32() - 0.5, 1.5) - p.position;
        shadow.push(Ray::new(offset_ray_origin(p.position, p.error, n, light), light).up_to(0.999));
    }
    for simd in [SimdLevel::detect(), SimdLevel::portable()] {
        let accel = accel.clone().with_simd(simd);
        let nearest = |rays: &[Ray]| rate(rays, |r| accel.intersect(r, 0.0).is_some());
        println!(
            "  {:9} camera {:5.2}  diffuse {:5.2}  shadow {:5.2} Mrays/s",
            simd.name(),
            nearest(&camera),
            nearest(&diffuse),
            rate(&shadow, |r| accel.occluded(r, 0.0))
        );
    }
    obvhs_alone(positions, indices, [&camera, &diffuse, &shadow]);
}

/// The tree and the traversal of `obvhs` as they come.
fn obvhs_alone(positions: &[Vec3], indices: &[[u32; 3]], [camera, diffuse, shadow]: [&[Ray]; 3]) {
    let corner = |i: u32| Vec3A::from(positions[i as usize]);
    let triangles: Vec<Triangle> =
        indices.iter().map(|t| Triangle { v0: corner(t[0]), v1: corner(t[1]), v2: corner(t[2]) }).collect();
    let bvh = build_bvh2_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
    let triangles: Vec<Triangle> = bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    let convert = |r: &Ray| obvhs::ray::Ray::new(r.origin, r.direction, 0.0, r.t_max);
    let nearest = |r: &Ray| {
        let mut hit = obvhs::ray::RayHit::none();
        bvh.ray_traverse(convert(r), &mut hit, |ray, id| triangles[id].intersect(ray))
    };
    let any = |r: &Ray| !bvh.ray_traverse_miss(convert(r), |ray, id| triangles[id].intersect(ray));
    let (a, b, c) = (rate(camera, nearest), rate(diffuse, nearest), rate(shadow, any));
    println!("  {:9} camera {a:5.2}  diffuse {b:5.2}  shadow {c:5.2} Mrays/s", "obvhs");
}

/// Four million spheres in a cube: time and memory of the top level.
fn instances() {
    let n = 4_000_000;
    let blas = Arc::new(Blas::unit_sphere());
    let mut rng = Pcg::new(&[3]);
    let mut place = || {
        let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let world_from_object =
            Affine3A::from_scale_rotation_translation(Vec3::splat(1e-3), glam::Quat::IDENTITY, at);
        Instance { blas: Arc::clone(&blas), world_from_object, motion: Vec::new() }
    };
    let list = (0..n).map(|_| place()).collect();
    let start = process_cpu_seconds();
    let accel = Accel::build(list);
    let bytes = accel.memory_bytes() as f64 / f64::from(n);
    println!(
        "{n} instances: build {:.1} CPU s of all threads, {bytes:.0} B each",
        process_cpu_seconds() - start
    );
}

fn main() {
    instances();
    let (positions, indices) = terrain(707);
    measure("terrain", &positions, &indices, Vec3A::new(0.3, -1.6, 1.2));
    let (positions, indices) = quads(20);
    measure("quads", &positions, &indices, Vec3A::new(0.0, 0.0, 3.0));
}

//! Closed meshes don't leak.

use crate::shapes::{cube, direction, icosphere, levels};
use glam::{Affine3A, DVec3, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::{Accel, Blas, Instance};
use tyndall_math::{Ray, random::Pcg};

fn scene(positions: &[Vec3], indices: &[[u32; 3]]) -> Accel {
    let blas = Arc::new(Blas::from_triangles(positions, indices));
    Accel::build(vec![Instance { blas, world_from_object: Affine3A::IDENTITY, motion: Vec::new() }])
}

/// A corner or a point on an edge of a random triangle.
fn target(rng: &mut Pcg, positions: &[Vec3], indices: &[[u32; 3]]) -> Vec3A {
    let triangle = indices[rng.next_u32() as usize % indices.len()];
    let [a, b, _] = triangle.map(|i| Vec3A::from(positions[i as usize]));
    match rng.next_u32() % 3 {
        0 => a,
        1 => (a + b) * 0.5,
        _ => a + (b - a) * rng.next_f32(),
    }
}

#[test]
fn rays_at_edges_and_vertices_of_a_closed_sphere_never_pass() {
    const RAYS: usize = 327_680;
    for scale in [1e-6, 1.0, 1e6] {
        for offset in [0.0, 10.0, 1e3, 1e5] {
            let center = DVec3::new(1.0, 0.7, -0.4) * offset * scale;
            let (positions, indices) = icosphere(5, scale, center);
            let accel = scene(&positions, &indices);
            let [portable, wide] = levels().map(|level| accel.clone().with_simd(level));
            let mut rng = Pcg::new(&[7]);
            let (mut leaks, mut differences) = (0, 0);
            for i in 0..RAYS {
                let target = target(&mut rng, &positions, &indices);
                // From inside in a random place, and from outside along the radius.
                let origin = if i % 2 == 0 {
                    center.as_vec3a() + cube(&mut rng) * (0.5 * scale as f32)
                } else {
                    center.as_vec3a() + (target - center.as_vec3a()) * 3.0
                };
                let ray = Ray::new(origin, target - origin);
                let (a, b) = (portable.intersect(&ray, 0.0), wide.intersect(&ray, 0.0));
                leaks += usize::from(b.is_none());
                differences += usize::from(a != b || wide.occluded(&ray, 0.0) != b.is_some());
            }
            assert_eq!((leaks, differences), (0, 0), "scale {scale}, offset {offset}");
        }
    }
}

#[test]
fn axis_aligned_rays_on_the_lines_of_a_grid_hit() {
    let n = 64u32;
    let points = (0..=n * (n + 2)).map(|i| Vec3::new((i % (n + 1)) as f32, (i / (n + 1)) as f32, 0.0));
    let positions: Vec<Vec3> = points.collect();
    let mut indices = Vec::new();
    for i in (0..n * (n + 1)).filter(|i| i % (n + 1) < n) {
        indices.extend([[i, i + 1, i + n + 2], [i, i + n + 2, i + n + 1]]);
    }
    let accel = scene(&positions, &indices);
    for level in levels() {
        let accel = accel.clone().with_simd(level);
        for p in &positions {
            for side in [1.0f32, -1.0] {
                let ray = Ray::new(Vec3A::from(*p) + Vec3A::Z * side, Vec3A::NEG_Z * side);
                assert!(accel.intersect(&ray, 0.0).is_some(), "{p} from {side}");
            }
        }
    }
}

#[test]
fn tiny_and_shrunken_rays_need_no_near_distance() {
    for scale in [1e-3f32, 1e-4, 1e-5, 1e-9] {
        let (positions, indices) = icosphere(3, f64::from(scale), DVec3::ZERO);
        let accel = scene(&positions, &indices);
        let mut rng = Pcg::new(&[3]);
        for _ in 0..5000 {
            let ray = Ray::new(cube(&mut rng) * (0.3 * scale), direction(&mut rng));
            assert!(accel.intersect(&ray, 0.0).is_some());
        }
    }
}

#[test]
fn every_line_leaves_a_closed_mesh_as_often_as_it_enters() {
    let (positions, indices) = icosphere(4, 1.0, DVec3::new(10.0, 0.0, 3.0));
    let accel = scene(&positions, &indices);
    let mut rng = Pcg::new(&[11]);
    let mut crossings = Vec::new();
    for i in 0..100_000 {
        let target = target(&mut rng, &positions, &indices);
        let inside = i % 2 == 0;
        let center = Vec3A::new(10.0, 0.0, 3.0);
        let origin = center + if inside { cube(&mut rng) * 0.5 } else { direction(&mut rng) * 4.0 };
        crossings.clear();
        accel.intersect_all(&Ray::new(origin, target - origin), 0.0, &mut crossings);
        let net: i32 = crossings.iter().map(|c| if c.entering { 1 } else { -1 }).sum();
        assert_eq!(net, if inside { -1 } else { 0 }, "{crossings:?}");
    }
}

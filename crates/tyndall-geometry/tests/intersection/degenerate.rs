//! Absurd input: finite answers, in time.

use crate::shapes::{direction, levels};
use glam::{Affine3A, Vec3, Vec3A};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tyndall_geometry::{Accel, Blas, Instance};
use tyndall_math::{Ray, random::Pcg};

fn alone(blas: Blas) -> Accel {
    Accel::build(vec![Instance {
        blas: Arc::new(blas),
        world_from_object: Affine3A::IDENTITY,
        motion: Vec::new(),
    }])
}

const TRIANGLE: [Vec3; 3] = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];

#[test]
fn rays_that_are_not_rays_hit_nothing_and_end() {
    let accel = alone(Blas::from_triangles(&TRIANGLE, &[[0, 1, 2]]));
    let (nan, inf) = (Vec3A::new(f32::NAN, 0.0, 1.0), Vec3A::new(0.0, f32::INFINITY, 0.0));
    let good = (Vec3A::Z, Vec3A::NEG_Z);
    let mut bad: Vec<Ray> =
        [(nan, good.1), (good.0, nan), (inf, good.1), (good.0, inf), (good.0, Vec3A::ZERO)]
            .map(|(o, d)| Ray::new(o, d))
            .to_vec();
    bad.extend([f32::NAN, -1.0, 0.5].map(|t| Ray::new(good.0, good.1).up_to(t)));
    for level in levels() {
        let accel = accel.clone().with_simd(level);
        for ray in &bad {
            let mut all = Vec::new();
            accel.intersect_all(ray, 0.0, &mut all);
            assert!(
                accel.intersect(ray, 0.0).is_none() && !accel.occluded(ray, 0.0) && all.is_empty(),
                "{ray:?}"
            );
        }
        assert!(accel.intersect(&Ray::new(good.0, good.1).up_to(1.0), 0.0).is_some(), "t_max is included");
        assert!(accel.intersect(&Ray::new(Vec3A::ZERO, good.1), 0.0).is_some(), "0 is included");
    }
}

#[test]
fn bad_triangles_are_left_out_and_keep_the_numbering() {
    let mut positions = TRIANGLE.to_vec();
    positions.extend([Vec3::NAN, Vec3::splat(f32::INFINITY), Vec3::new(0.0, -1.0, 0.0)]);
    let indices = [[0, 1, 3], [0, 1, 4], [0, 1, 99], [0, 0, 1], [0, 1, 5], [0, 1, 2]];
    let blas = Blas::from_triangles(&positions, &indices);
    assert_eq!((0..6).filter(|&i| blas.triangle(i).is_some()).collect::<Vec<_>>(), [5]);
    let hit = alone(blas).intersect(&Ray::new(Vec3A::Z, Vec3A::NEG_Z), 0.0);
    assert_eq!(hit.map(|h| h.primitive), Some(5));
    let empty = alone(Blas::from_triangles(&[], &[]));
    assert!(empty.intersect(&Ray::new(Vec3A::Z, Vec3A::NEG_Z), 0.0).is_none());
}

fn in_time<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = f();
    assert!(start.elapsed() < Duration::from_secs(20), "{what} took {:?}", start.elapsed());
    result
}

#[test]
fn crowds_build_quickly() {
    let ray = Ray::new(Vec3A::Z * 2.0, Vec3A::NEG_Z);
    let blas = in_time("1000 equal triangles", || Blas::from_triangles(&TRIANGLE, &[[0, 1, 2]; 1000]));
    let accel = alone(blas);
    assert_eq!(accel.intersect(&ray, 0.0).map(|h| (h.primitive, h.t)), Some((0, 2.0)));
    let mut all = Vec::new();
    accel.intersect_all(&ray, 0.0, &mut all);
    assert_eq!(all.len(), 1000);

    let blas = Arc::new(Blas::from_triangles(&TRIANGLE, &[[0, 1, 2]]));
    let place =
        |_| Instance { blas: Arc::clone(&blas), world_from_object: Affine3A::IDENTITY, motion: Vec::new() };
    let accel = in_time("100,000 instances at one place", || Accel::build((0..100_000).map(place).collect()));
    assert_eq!(accel.intersect(&ray, 0.0).map(|h| h.instance), Some(0));

    let nested = |i| Instance {
        blas: Arc::clone(&blas),
        world_from_object: Affine3A::from_scale(Vec3::splat(1.0 + i as f32 * 1e-5)),
        motion: Vec::new(),
    };
    let accel = in_time("100,000 nested instances", || Accel::build((0..100_000).map(nested).collect()));
    assert!(accel.intersect(&ray, 0.0).is_some_and(|h| (h.t - 2.0).abs() < 1e-6));

    let positions: Vec<Vec3> =
        (0..30_000).flat_map(|i| TRIANGLE.map(|p| p * (1.0 + i as f32 * 1e-4))).collect();
    let indices: Vec<[u32; 3]> = (0..30_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let blas = in_time("30,000 nested triangles", || Blas::from_triangles(&positions, &indices));
    assert!(alone(blas).intersect(&ray, 0.0).is_some_and(|h| (h.t - 2.0).abs() < 1e-6));
}

#[test]
fn sizes_over_forty_decades_in_one_scene() {
    let mut rng = Pcg::new(&[9]);
    let scales = (-18..=18).map(|e| 10f32.powi(e));
    let positions: Vec<Vec3> = scales.clone().flat_map(|s| TRIANGLE.map(|p| p * s - Vec3::Z * s)).collect();
    let indices: Vec<[u32; 3]> = (0..37).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let accel = alone(Blas::from_triangles(&positions, &indices));
    for level in levels() {
        let accel = accel.clone().with_simd(level);
        let hit =
            accel.intersect(&Ray::new(Vec3A::ZERO, Vec3A::NEG_Z), 0.0).expect("the smallest is nearest");
        assert_eq!(hit.primitive, 0);
        for _ in 0..1000 {
            let ray = Ray::new(direction(&mut rng), direction(&mut rng));
            assert!(accel.intersect(&ray, 0.0).is_none_or(|h| h.t.is_finite() && h.u.is_finite()));
        }
    }
}

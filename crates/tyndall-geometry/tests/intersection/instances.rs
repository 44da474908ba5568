//! Two levels against flattened geometry; mirrored, uneven and singular transforms.

use crate::brute_force::nearest;
use crate::shapes::{cube, direction, icosphere, levels, soup};
use glam::{Affine3A, DVec3, Mat3A, Quat, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::{Accel, Blas, Instance};
use tyndall_math::{Ray, random::Pcg};

fn random_transform(rng: &mut Pcg) -> Affine3A {
    let scale = Vec3::from(cube(rng)).signum() * (Vec3::splat(0.2) + Vec3::from(cube(rng)).abs());
    let rotation = Quat::from_axis_angle(Vec3::from(direction(rng)), rng.next_f32() * 6.0);
    Affine3A::from_scale_rotation_translation(scale, rotation, Vec3::from(cube(rng)) * 3.0)
}

#[test]
fn two_levels_agree_with_flattened_triangles() {
    let mut rng = Pcg::new(&[21]);
    let meshes = [soup(30, 1), soup(7, 2), icosphere(1, 0.4, DVec3::ZERO)];
    let blas: Vec<Arc<Blas>> = meshes.iter().map(|(p, i)| Arc::new(Blas::from_triangles(p, i))).collect();
    let (mut instances, mut positions, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    let mut first_triangle = Vec::new();
    for i in 0..40 {
        let world_from_object = random_transform(&mut rng);
        let (points, triangles) = &meshes[i % 3];
        let base = positions.len() as u32;
        first_triangle.push(indices.len());
        let exact = glam::DAffine3::from_mat3_translation(
            glam::Mat3::from(world_from_object.matrix3).as_dmat3(),
            Vec3::from(world_from_object.translation).as_dvec3(),
        );
        positions.extend(points.iter().map(|p| exact.transform_point3(p.as_dvec3())));
        indices.extend(triangles.iter().map(|t| t.map(|i| i + base)));
        instances.push(Instance { blas: Arc::clone(&blas[i % 3]), world_from_object, motion: Vec::new() });
    }
    let accel = Accel::build(instances);
    let (mut n_clear, mut crossings) = (0, Vec::new());
    for _ in 0..4000 {
        let ray = Ray::new(cube(&mut rng) * 5.0, direction(&mut rng) * 0.7);
        let [a, hit] = levels().map(|level| accel.clone().with_simd(level).intersect(&ray, 0.0));
        assert_eq!(a, hit);
        assert_eq!(accel.occluded(&ray, 0.0), hit.is_some());
        crossings.clear();
        accel.intersect_all(&ray, 0.0, &mut crossings);
        let first = crossings.iter().map(|c| c.t).reduce(f32::min);
        assert!(
            hit.is_none() && first.is_none() || first.unwrap_or(9e9) <= hit.map_or(9e9, |h| h.t * 1.00001)
        );
        let (expected, is_clear) = nearest(&positions, &indices, &ray);
        if !is_clear {
            continue;
        }
        n_clear += 1;
        let found = hit.map(|h| first_triangle[h.instance as usize] + h.primitive as usize);
        assert_eq!(found, expected.map(|(i, _)| i));
        if let (Some(hit), Some((_, t))) = (hit, expected) {
            assert!((f64::from(hit.t) - t).abs() < 1e-4 * (1.0 + t));
        }
    }
    assert!(n_clear > 1000);
}

#[test]
fn normals_are_outward_and_perpendicular_under_any_transform() {
    let mut rng = Pcg::new(&[4]);
    let (positions, indices) = icosphere(3, 1.0, DVec3::ZERO);
    for blas in [Blas::from_triangles(&positions, &indices), Blas::unit_sphere()].map(Arc::new) {
        for _ in 0..200 {
            let world_from_object = random_transform(&mut rng);
            let accel = Accel::build(vec![Instance {
                blas: Arc::clone(&blas),
                world_from_object,
                motion: Vec::new(),
            }]);
            let center = world_from_object.translation;
            let ray = Ray::new(center, direction(&mut rng));
            let hit = accel.intersect(&ray, 0.0).expect("from inside");
            let point = accel.surface_point(&ray, 0.0, &hit);
            assert!((point.geometric_normal.length() - 1.0).abs() < 1e-5);
            assert!(point.geometric_normal.dot(ray.direction) > 0.0, "outward, also when mirrored");
            assert!((point.position - ray.at(hit.t)).length() < 1e-4);
            let mut all = Vec::new();
            accel.intersect_all(&Ray::new(center - ray.direction * 10.0, ray.direction), 0.0, &mut all);
            assert_eq!(all.iter().map(|c| c.entering).collect::<Vec<_>>(), [true, false]);
            let object_tangent = point.object_normal.any_orthonormal_vector();
            let tangent = world_from_object.matrix3 * object_tangent;
            assert!(point.geometric_normal.dot(tangent.normalize()).abs() < 1e-4);
            let shading = accel.world_normal(0, 0.0, point.object_normal);
            assert!((shading - point.geometric_normal).length() < 1e-5);
        }
    }
}

#[test]
fn singular_transforms_are_skipped_and_listed() {
    let blas = Arc::new(Blas::unit_sphere());
    let flat = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
    let sheared = Affine3A { matrix3: Mat3A::from_cols(Vec3A::ONE, Vec3A::ONE * 0.3, Vec3A::Z), ..flat };
    let infinite = Affine3A::from_translation(Vec3::new(f32::INFINITY, 0.0, 0.0));
    let nan = Affine3A::from_scale(Vec3::splat(f32::NAN));
    let thin = Affine3A::from_scale(Vec3::new(1.0, 1.0, 1e-12));
    let place =
        |world_from_object| Instance { blas: Arc::clone(&blas), world_from_object, motion: Vec::new() };
    let accel = Accel::build([flat, sheared, infinite, nan, thin].map(place).to_vec());
    assert_eq!(accel.skipped().collect::<Vec<_>>(), [0, 1, 2, 3]);
    let hit = accel.intersect(&Ray::new(Vec3A::new(0.0, 0.0, 5.0), Vec3A::NEG_Z), 0.0).expect("the thin one");
    assert_eq!(hit.instance, 4);
    assert!((hit.t - 5.0).abs() < 1e-6);
    assert!(Accel::build(Vec::new()).intersect(&Ray::new(Vec3A::ZERO, Vec3A::Z), 0.0).is_none());
}

#[test]
fn equal_distances_go_to_the_lower_instance_and_primitive() {
    let quad = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let blas = Arc::new(Blas::from_triangles(&quad, &[[0, 1, 2]; 9]));
    let place =
        |_| Instance { blas: Arc::clone(&blas), world_from_object: Affine3A::IDENTITY, motion: Vec::new() };
    let accel = Accel::build((0..50).map(place).collect());
    let hit = accel.intersect(&Ray::new(Vec3A::new(0.1, 0.0, 2.0), Vec3A::NEG_Z), 0.0).expect("hit");
    assert_eq!((hit.instance, hit.primitive, hit.t), (0, 0, 2.0));
}

#[test]
fn a_million_instances_take_few_bytes_each() {
    let blas = Arc::new(Blas::unit_sphere());
    let n = 1_000_000;
    let place = |i: u32| {
        let at = Vec3::new((i % 1000) as f32, (i / 1000) as f32, 0.0) * 3.0;
        Instance {
            blas: Arc::clone(&blas),
            world_from_object: Affine3A::from_translation(at),
            motion: Vec::new(),
        }
    };
    let accel = Accel::build((0..n).map(place).collect());
    let bytes = accel.memory_bytes() / n as usize;
    assert!(bytes <= 200, "{bytes} bytes");
    let ray = Ray::new(Vec3A::new(300.0, 600.0, 9.0), Vec3A::NEG_Z);
    assert_eq!(accel.intersect(&ray, 0.0).map(|h| h.instance), Some(200 * 1000 + 100));
}

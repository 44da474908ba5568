//! Rays that leave a surface never meet it behind their origin.

use crate::shapes::{cube, direction, icosphere, levels};
use glam::{Affine3A, DVec3, Quat, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::{Accel, Blas, Instance};
use tyndall_math::{Ray, offset_ray_origin, random::Pcg};

/// Shoots from inside and outside onto a convex surface and away from the hit on either side. Outward rays must
/// escape, inward rays must hit.
fn check(accel: &Accel, center: Vec3A, radius: f32, seed: u64) {
    let mut rng = Pcg::new(&[seed]);
    let (mut hit_again, mut leaked, mut n) = (0, 0, 0);
    for i in 0..20_000 {
        let from_inside = i % 2 == 0;
        let origin = center + cube(&mut rng) * (radius * if from_inside { 0.3 } else { 5.0 });
        let toward = direction(&mut rng);
        let toward = if from_inside { toward } else { center + toward * (0.9 * radius) - origin };
        let ray = Ray::new(origin, toward);
        let Some(hit) = accel.intersect(&ray, 0.0) else { continue };
        n += 1;
        let point = accel.surface_point(&ray, 0.0, &hit);
        let mut away = direction(&mut rng);
        if i % 4 < 2 {
            // Grazing.
            away = (away - point.geometric_normal * away.dot(point.geometric_normal) * 0.999).normalize();
        }
        let start = offset_ray_origin(point.position, point.error, point.geometric_normal, away);
        let again = accel.intersect(&Ray::new(start, away), 0.0);
        if away.dot(point.geometric_normal) > 0.0 {
            hit_again += usize::from(again.is_some());
        } else {
            leaked += usize::from(again.is_none());
        }
        assert!((start - point.position).length() < 1e-3 * radius + 1e-5 * center.abs().max_element());
    }
    assert!(n > 10_000);
    assert_eq!((hit_again, leaked), (0, 0), "of {n}, radius {radius} at {center}");
}

#[test]
fn spawned_rays_stay_on_their_side_at_every_scale() {
    for scale in [1e-6, 1.0, 1e6] {
        for offset in [0.0, 10.0, 1e3] {
            let center = DVec3::new(1.0, -0.6, 0.3) * offset * scale;
            let (positions, indices) = icosphere(4, scale, center);
            let blas = Arc::new(Blas::from_triangles(&positions, &indices));
            let accel = Accel::build(vec![Instance {
                blas,
                world_from_object: Affine3A::IDENTITY,
                motion: Vec::new(),
            }]);
            for level in levels() {
                check(&accel.clone().with_simd(level), center.as_vec3a(), scale as f32, 1);
            }
        }
    }
}

#[test]
fn spawned_rays_stay_on_their_side_of_instances() {
    let (positions, indices) = icosphere(3, 1.0, DVec3::ZERO);
    let mesh = Arc::new(Blas::from_triangles(&positions, &indices));
    for blas in [mesh, Arc::new(Blas::unit_sphere())] {
        for scale in [1e-6f32, 1.0, 1e6] {
            for offset in [0.0f32, 10.0, 1e3] {
                let rotation = Quat::from_axis_angle(Vec3::new(0.6, 0.8, 0.0), 1.0);
                let center = Vec3::new(1.0, 0.4, -0.7) * offset * scale;
                let shape = Vec3::new(1.0, -0.7, 1.3) * scale;
                let world_from_object = Affine3A::from_scale_rotation_translation(shape, rotation, center);
                let accel = Accel::build(vec![Instance {
                    blas: Arc::clone(&blas),
                    world_from_object,
                    motion: Vec::new(),
                }]);
                check(&accel, center.into(), scale, 2);
            }
        }
    }
}

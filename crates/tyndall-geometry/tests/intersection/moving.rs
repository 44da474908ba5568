//! Instances that move: at every time what they are where they are then.

use crate::shapes::{cube, direction, icosphere, levels, soup};
use glam::{Affine3A, DVec3, Mat3A, Quat, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::{Accel, Blas, Instance, InstanceKey};
use tyndall_math::{Ray, offset_ray_origin, random::Pcg};

const TIMES: [f32; 3] = [0.0, 0.3, 1.0];

/// Places near each other: what is between them has an inverse.
fn random_keys(rng: &mut Pcg) -> Vec<InstanceKey> {
    let scale = Vec3::splat(0.5) + Vec3::from(cube(rng)).abs();
    let axis = Vec3::from(direction(rng));
    let at = Vec3::from(cube(rng)) * 3.0;
    let key = |time: f32, rng: &mut Pcg| {
        let rotation = Quat::from_axis_angle(axis, rng.next_f32());
        let place = at + Vec3::from(cube(rng));
        let world_from_object = Affine3A::from_scale_rotation_translation(scale, rotation, place);
        InstanceKey { time, world_from_object }
    };
    TIMES.iter().map(|&time| key(time, rng)).collect()
}

/// The lines between keys, in f64.
fn interpolated(keys: &[InstanceKey], time: f32) -> Affine3A {
    let next = keys.iter().position(|key| key.time >= time).unwrap_or(keys.len() - 1).max(1);
    let (a, b) = (&keys[next - 1], &keys[next]);
    let share = f64::from(time - a.time) / f64::from(b.time - a.time);
    let mix = |a: Vec3A, b: Vec3A| (a.as_dvec3() * (1.0 - share) + b.as_dvec3() * share).as_vec3a();
    let (m, n) = (a.world_from_object, b.world_from_object);
    Affine3A {
        matrix3: Mat3A::from_cols(
            mix(m.matrix3.x_axis, n.matrix3.x_axis),
            mix(m.matrix3.y_axis, n.matrix3.y_axis),
            mix(m.matrix3.z_axis, n.matrix3.z_axis),
        ),
        translation: mix(m.translation, n.translation),
    }
}

#[test]
fn moving_instances_are_hit_where_they_are_at_that_time() {
    let mut rng = Pcg::new(&[31]);
    let [(p, i), (q, j)] = [soup(30, 1), icosphere(1, 0.4, DVec3::ZERO)];
    let objects =
        [Blas::from_triangles(&p, &i), Blas::from_triangles(&q, &j), Blas::unit_sphere()].map(Arc::new);
    let keys: Vec<_> = (0..30).map(|_| random_keys(&mut rng)).collect();
    let object = |n: usize| Arc::clone(&objects[n % 3]);
    let moving = Accel::build(
        keys.iter()
            .enumerate()
            .map(|(n, keys)| Instance {
                blas: object(n),
                world_from_object: Affine3A::IDENTITY,
                // Every fifth stands still.
                motion: if n % 5 == 0 { Vec::new() } else { keys.clone() },
            })
            .collect(),
    );
    assert!(moving.moves());
    let mut n_hits = 0;
    for _ in 0..60 {
        let time = rng.next_f32();
        let place = |(n, keys): (usize, &Vec<InstanceKey>)| Instance {
            blas: object(n),
            world_from_object: if n % 5 == 0 { Affine3A::IDENTITY } else { interpolated(keys, time) },
            motion: Vec::new(),
        };
        let still = Accel::build(keys.iter().enumerate().map(place).collect());
        assert!(!still.moves());
        let (low, high) = still.bounds();
        let (all_low, all_high) = moving.bounds();
        assert!(all_low.cmple(low + 1e-5).all() && all_high.cmpge(high - 1e-5).all());
        for _ in 0..200 {
            let ray = Ray::new(cube(&mut rng) * 5.0, direction(&mut rng) * 0.7);
            let [a, hit] = levels().map(|level| moving.clone().with_simd(level).intersect(&ray, time));
            assert_eq!(a, hit);
            assert_eq!(moving.occluded(&ray, time), hit.is_some());
            let expected = still.intersect(&ray, 0.0);
            let (Some(found), Some(expected)) = (hit, expected) else {
                // Rounded transforms: a ray along an edge may pass on the other side.
                continue;
            };
            n_hits += 1;
            if (found.instance, found.primitive) != (expected.instance, expected.primitive) {
                continue;
            }
            assert!((found.t - expected.t).abs() < 1e-4 * (1.0 + expected.t), "{found:?} {expected:?}");
            let point = moving.surface_point(&ray, time, &found);
            let other = still.surface_point(&ray, 0.0, &expected);
            assert!((point.position - other.position).length() < 1e-4, "{point:?} {other:?}");
            assert!((point.geometric_normal - other.geometric_normal).length() < 1e-3);
            let normal = moving.world_normal(found.instance, time, point.object_normal);
            assert!((normal - point.geometric_normal).length() < 1e-6);
            let placed = moving.world_from_object(found.instance, time);
            assert!((placed.transform_point3a(point.object_position) - point.position).length() < 1e-5);
        }
    }
    assert!(n_hits > 1000, "{n_hits}");
}

#[test]
fn hits_and_misses_differ_from_those_of_still_twins_only_at_edges() {
    let mut rng = Pcg::new(&[32]);
    let (p, i) = icosphere(2, 1.0, DVec3::ZERO);
    let blas = Arc::new(Blas::from_triangles(&p, &i));
    let keys = random_keys(&mut rng);
    let alone = |motion, world_from_object| {
        Accel::build(vec![Instance { blas: Arc::clone(&blas), world_from_object, motion }])
    };
    let moving = alone(keys.clone(), Affine3A::IDENTITY);
    let n_different = (0..5000)
        .filter(|_| {
            let time = rng.next_f32();
            let ray = Ray::new(cube(&mut rng) * 5.0, direction(&mut rng));
            let still = alone(Vec::new(), interpolated(&keys, time));
            moving.intersect(&ray, time).is_some() != still.intersect(&ray, 0.0).is_some()
        })
        .count();
    assert!(n_different <= 2, "{n_different}");
}

#[test]
fn origins_moved_off_a_moving_surface_are_on_their_side() {
    let mut rng = Pcg::new(&[33]);
    let (p, i) = icosphere(2, 1.0, DVec3::ZERO);
    let motion = random_keys(&mut rng);
    let blas = Arc::new(Blas::from_triangles(&p, &i));
    let accel =
        Accel::build(vec![Instance { blas, world_from_object: Affine3A::IDENTITY, motion: motion.clone() }]);
    for _ in 0..5000 {
        let time = rng.next_f32();
        let inside = interpolated(&motion, time).translation;
        let ray = Ray::new(inside, direction(&mut rng));
        let hit = accel.intersect(&ray, time).expect("closed around its centre");
        let point = accel.surface_point(&ray, time, &hit);
        let origin = offset_ray_origin(point.position, point.error, point.geometric_normal, ray.direction);
        assert!(accel.intersect(&Ray::new(origin, ray.direction), time).is_none(), "convex: nothing outside");
        let back = offset_ray_origin(point.position, point.error, point.geometric_normal, -ray.direction);
        assert!(accel.occluded(&Ray::new(back, -ray.direction), time), "the other side");
    }
}

#[test]
fn what_has_no_space_of_its_own_at_a_time_is_not_there_then() {
    let (p, i) = icosphere(1, 1.0, DVec3::ZERO);
    let blas = Arc::new(Blas::from_triangles(&p, &i));
    let accel = |keys: &[(f32, f32)]| {
        let key = |&(time, scale): &(f32, f32)| InstanceKey {
            time,
            world_from_object: Affine3A::from_scale(Vec3::splat(scale)),
        };
        let motion = keys.iter().map(key).collect();
        Accel::build(vec![Instance {
            blas: Arc::clone(&blas),
            world_from_object: Affine3A::IDENTITY,
            motion,
        }])
    };
    let ray = Ray::new(Vec3A::new(0.01, 0.02, 5.0), Vec3A::NEG_Z);
    let turned_over = accel(&[(0.25, 1.0), (0.75, -1.0)]);
    for (time, is_there) in [(0.0, true), (0.25, true), (0.4, true), (0.5, false), (0.6, true), (1.0, true)] {
        assert_eq!(turned_over.intersect(&ray, time).is_some(), is_there, "at {time}");
    }
    let nowhere = accel(&[(0.0, 1.0), (1.0, f32::INFINITY)]);
    assert!(nowhere.intersect(&ray, 0.5).is_none());
    let single = accel(&[(0.5, 2.0)]);
    let t = [0.0, 0.5, 1.0].map(|time| single.intersect(&ray, time).map(|hit| hit.t));
    assert!(t[0] == t[1] && t[1] == t[2] && t[0].is_some_and(|t| (t - 3.0).abs() < 0.2), "{t:?}");
}

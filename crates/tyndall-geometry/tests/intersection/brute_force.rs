//! The tree against every triangle in turn, in f64.

use crate::shapes::{cube, direction, levels, soup};
use glam::{Affine3A, DVec3};
use proptest::prelude::*;
use std::sync::Arc;
use tyndall_geometry::{Accel, Blas, Instance};
use tyndall_math::{Ray, random::Pcg};

/// Distance (in ray parameters) to a triangle and how clearly the ray passes inside it, if it meets its plane.
fn moeller_trumbore([a, b, c]: [DVec3; 3], ray: &Ray) -> Option<(f64, f64)> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let u = (o - a).dot(p) / det;
    let q = (o - a).cross(e1);
    let v = d.dot(q) / det;
    Some((e2.dot(q) / det, u.min(v).min(1.0 - u - v)))
}

/// The nearest hit and whether all triangles before and at it are hit or missed clearly.
pub(crate) fn nearest(positions: &[DVec3], indices: &[[u32; 3]], ray: &Ray) -> (Option<(usize, f64)>, bool) {
    let mut best: Option<(usize, f64)> = None;
    let mut is_clear = true;
    for (i, t) in indices.iter().enumerate() {
        let Some((t, margin)) = moeller_trumbore(t.map(|i| positions[i as usize]), ray) else { continue };
        if !(0.0..=f64::from(ray.t_max)).contains(&t) {
            continue;
        }
        is_clear &= margin.abs() > 1e-4;
        if margin >= 0.0 && best.is_none_or(|(_, b)| t < b) {
            best = Some((i, t));
        }
    }
    (best, is_clear)
}

fn check(n: usize, seed: u64) {
    let (positions, indices) = soup(n, seed);
    let exact: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
    let blas = Arc::new(Blas::from_triangles(&positions, &indices));
    let accel =
        Accel::build(vec![Instance { blas, world_from_object: Affine3A::IDENTITY, motion: Vec::new() }]);
    let [portable, wide] = levels().map(|level| accel.clone().with_simd(level));
    let mut rng = Pcg::new(&[seed, 1]);
    let mut n_clear = 0;
    for i in 0..200 {
        let mut ray = Ray::new(cube(&mut rng) * 1.5, direction(&mut rng));
        if i % 3 == 0 {
            ray.t_max = rng.next_f32() * 2.0;
        }
        let hit = wide.intersect(&ray, 0.0);
        assert_eq!(hit, portable.intersect(&ray, 0.0), "kernels differ");
        assert_eq!(wide.occluded(&ray, 0.0), hit.is_some());
        assert_eq!(portable.occluded(&ray, 0.0), hit.is_some());
        let (expected, is_clear) = nearest(&exact, &indices, &ray);
        if is_clear {
            n_clear += 1;
            match (hit, expected) {
                (None, None) => {}
                (Some(h), Some((_, t))) => {
                    assert!((f64::from(h.t) - t).abs() < 1e-4 * (1.0 + t), "{h:?} instead of {expected:?}");
                }
                _ => panic!("{hit:?} instead of {expected:?}"),
            }
        }
    }
    assert!(n_clear > 20, "the test must say something");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn agrees_with_every_triangle_in_turn(n in 1usize..400, seed: u64) {
        check(n, seed);
    }
}

#[test]
fn agrees_on_a_larger_soup() {
    check(20_000, 5);
}

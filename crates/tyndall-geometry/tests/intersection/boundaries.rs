//! The parts of a ray inside closed boundaries.

use crate::shapes::{cube, direction, icosphere, levels};
use glam::{Affine3A, DAffine3, DQuat, DVec3, Vec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::{Blas, Boundaries, BoundaryShape, SpanScratch};
use tyndall_math::{Ray, random::Pcg};

fn spans(boundaries: &Boundaries, ray: &Ray) -> Vec<(u32, f32, f32)> {
    let mut out = Vec::new();
    boundaries.spans(ray, Vec3A::ZERO, &mut SpanScratch::default(), &mut |i, a, b| {
        assert!(0.0 <= a && a < b && b <= f64::from(ray.t_max), "{a} {b}");
        out.push((i, a as f32, b as f32));
    });
    out
}

fn boxed(scale: DVec3, center: DVec3) -> BoundaryShape {
    BoundaryShape::Box {
        world_from_box: DAffine3::from_scale_rotation_translation(scale, DQuat::IDENTITY, center),
    }
}

fn mesh(blas: &Arc<Blas>, center: Vec3) -> BoundaryShape {
    let world_from_object = Affine3A::from_translation(center);
    BoundaryShape::Mesh { blas: Arc::clone(blas), world_from_object }
}

fn sphere_mesh(flip: bool, drop: usize) -> Arc<Blas> {
    let (positions, mut indices) = icosphere(3, 1.0, DVec3::ZERO);
    indices.truncate(indices.len() - drop);
    if flip {
        indices.iter_mut().for_each(|t| t.swap(0, 1));
    }
    Arc::new(Blas::from_triangles(&positions, &indices))
}

#[test]
fn camera_on_a_face_inside_and_outside_of_a_box() {
    let one = Boundaries::build(vec![boxed(DVec3::ONE, DVec3::ZERO)]);
    let at = |z: f32| Ray::new(Vec3A::new(0.2, 0.1, z), Vec3A::NEG_Z);
    assert_eq!(spans(&one, &at(3.0)), [(0, 2.0, 4.0)]);
    assert_eq!(spans(&one, &at(1.0)), [(0, 0.0, 2.0)]);
    assert_eq!(spans(&one, &at(0.5)), [(0, 0.0, 1.5)]);
    assert_eq!(spans(&one, &at(-1.0)), []);
    assert_eq!(spans(&one, &at(-2.0)), []);
    assert_eq!(spans(&one, &at(3.0).up_to(3.0)), [(0, 2.0, 3.0)]);
    assert_eq!(spans(&one, &at(3.0).up_to(2.0)), []);
}

#[test]
fn a_ray_in_the_face_of_two_boxes_is_in_one_of_them() {
    let shapes = vec![boxed(DVec3::ONE, DVec3::X), boxed(DVec3::ONE, DVec3::NEG_X)];
    let both = Boundaries::build(shapes);
    let found = spans(&both, &Ray::new(Vec3A::Z * 3.0, Vec3A::NEG_Z));
    assert_eq!(found, [(0, 2.0, 4.0)]);
}

#[test]
fn thin_long_flat_and_coincident_boxes() {
    for distance in [0.5f32, 3.0, 1000.0] {
        let thin = Boundaries::build(vec![boxed(DVec3::new(1.0, 1.0, 0.5e-7), DVec3::ZERO)]);
        let found = spans(&thin, &Ray::new(Vec3A::Z * distance, Vec3A::NEG_Z));
        assert_eq!(found.len(), 1, "a thin slab is not lost");
        assert!(found[0].2 - found[0].1 <= 2.4e-7 * distance.max(1.0));
    }
    let flat = Boundaries::build(vec![boxed(DVec3::new(1.0, 1.0, 0.0), DVec3::ZERO)]);
    assert_eq!(spans(&flat, &Ray::new(Vec3A::Z, Vec3A::NEG_Z)), []);
    let long = Boundaries::build(vec![boxed(DVec3::new(1.0, 1.0, 1e6), DVec3::ZERO)]);
    assert_eq!(spans(&long, &Ray::new(Vec3A::X * 3.0, Vec3A::NEG_X)), [(0, 2.0, 4.0)]);
    assert_eq!(spans(&long, &Ray::new(Vec3A::ZERO, Vec3A::Z)), [(0, 0.0, 1e6)]);
    let coincident = Boundaries::build(vec![boxed(DVec3::ONE, DVec3::ZERO); 3]);
    assert_eq!(spans(&coincident, &Ray::new(Vec3A::ZERO, Vec3A::Z)).len(), 3);
}

#[test]
fn spheres_and_everything() {
    let sphere =
        |radius: f64| BoundaryShape::Sphere { world_from_sphere: DAffine3::from_scale(DVec3::splat(radius)) };
    let shapes = vec![sphere(1.0), BoundaryShape::Unbounded, sphere(2.0)];
    let found = spans(&Boundaries::build(shapes), &Ray::new(Vec3A::Z * 3.0, Vec3A::NEG_Z).up_to(4.5));
    assert_eq!(found, [(0, 2.0, 4.0), (1, 0.0, 4.5), (2, 1.0, 4.5)]);
}

#[test]
fn meshes_count_their_crossings_whichever_way_they_are_wound() {
    let ray = Ray::new(Vec3A::new(0.03, 0.02, 3.0), Vec3A::NEG_Z);
    for flip in [false, true] {
        let blas = sphere_mesh(flip, 0);
        let found = spans(&Boundaries::build(vec![mesh(&blas, Vec3::ZERO)]), &ray);
        assert_eq!(found.len(), 1);
        assert!((found[0].1 - 2.0).abs() < 0.02 && (found[0].2 - 4.0).abs() < 0.02, "{found:?}");
        let inside = Ray::new(Vec3A::new(0.03, 0.02, 0.0), Vec3A::NEG_Z);
        let found = spans(&Boundaries::build(vec![mesh(&blas, Vec3::ZERO)]), &inside);
        assert!(found.len() == 1 && found[0].1 == 0.0, "{found:?}");
        // The end of the ray doesn't change what is inside.
        let found = spans(&Boundaries::build(vec![mesh(&blas, Vec3::ZERO)]), &inside.up_to(0.25));
        assert_eq!(found, [(0, 0.0, 0.25)]);
    }
}

#[test]
fn a_mesh_with_a_hole_stays_in_its_box() {
    let boundaries = Boundaries::build(vec![mesh(&sphere_mesh(false, 200), Vec3::ZERO)]);
    let mut rng = Pcg::new(&[2]);
    for _ in 0..20_000 {
        let ray = Ray::new(cube(&mut rng) * 30.0, direction(&mut rng));
        for (_, a, b) in spans(&boundaries, &ray) {
            for t in [a, b] {
                assert!(ray.at(t).abs().max_element() < 1.0001);
            }
        }
    }
}

#[test]
fn a_mesh_agrees_with_the_sphere_it_resembles_and_with_both_kernels() {
    let mut rng = Pcg::new(&[5]);
    let blas = sphere_mesh(false, 0);
    let shapes = |center: Vec3| {
        let world_from_sphere = DAffine3::from_translation(center.as_dvec3());
        [mesh(&blas, center), BoundaryShape::Sphere { world_from_sphere }]
    };
    // Many, so that the tree is used; few, so that it isn't.
    let centers: Vec<Vec3> = (0..30).map(|_| Vec3::from(cube(&mut rng)) * 6.0).collect();
    let many = Boundaries::build(centers.iter().flat_map(|c| shapes(*c)).collect());
    let few: Vec<Boundaries> = centers.iter().map(|c| Boundaries::build(shapes(*c).to_vec())).collect();
    for _ in 0..2000 {
        let ray = Ray::new(cube(&mut rng) * 8.0, direction(&mut rng)).up_to(12.0);
        let found = spans(&many, &ray);
        let linear: Vec<_> = (0..)
            .zip(&few)
            .flat_map(|(k, b)| spans(b, &ray).into_iter().map(move |(i, s, t)| (2 * k + i, s, t)))
            .collect();
        assert_eq!(found, linear);
        assert_eq!(found, spans(&many.clone().with_simd(levels()[0]), &ray));
        let length = |i: u32| -> f32 { found.iter().filter(|s| s.0 == i).map(|s| s.2 - s.1).sum() };
        for k in 0..30 {
            assert!((length(2 * k) - length(2 * k + 1)).abs() < 0.35, "{found:?}");
        }
    }
}

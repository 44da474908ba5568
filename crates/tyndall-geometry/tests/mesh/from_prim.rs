//! Polygons, orientation, normals, subsets, and meshes that make no sense.

use crate::{area, cube, mesh, triangles};
use glam::Vec3;
use proptest::prelude::*;
use tyndall_scene::prim::{Interpolation, Mesh, Primvar, Subset};

fn normal_of(mesh: &tyndall_geometry::TriangleMesh, t: usize) -> Vec3 {
    let [a, b, c] = mesh.triangle(t);
    (b - a).cross(c - a).normalize()
}

#[test]
fn a_cube_is_closed_and_left_handed_turns_it() {
    let (right, messages) = triangles(&cube());
    assert!(messages.is_empty(), "{messages:?}");
    assert_eq!(right.len(), 12);
    assert!(right.is_closed());
    assert!((right.signed_volume() - 8.0).abs() < 1e-12);
    let (left, _) = triangles(&Mesh { left_handed: true, ..cube() });
    assert!(left.is_closed() && (left.signed_volume() + 8.0).abs() < 1e-12);
    let mut back = left.clone();
    back.flip();
    assert!((back.signed_volume() - 8.0).abs() < 1e-12);
    // Corners still name the face-vertex whose point they are.
    for mesh in [&right, &left, &back] {
        for (points, corners) in mesh.indices.iter().zip(&mesh.corner) {
            let of_corner = corners.map(|c| cube().face_vertex_indices[c as usize] as u32);
            assert_eq!(*points, of_corner);
        }
    }
}

#[test]
fn concave_polygons_keep_their_area_and_side() {
    let arrow = [[0.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.5, 0.0, 0.0], [2.0, 1.0, 0.0]];
    let arrow_area = 0.5;
    for start in 0..4 {
        let face: Vec<i32> = (0..4).map(|i| (i + start) % 4).collect();
        let (quad, _) = triangles(&mesh(&arrow, &[&face]));
        assert!((area(&quad) - arrow_area).abs() < 1e-6, "{}", area(&quad));
        assert!((0..2).all(|t| normal_of(&quad, t).z < 0.0) || (0..2).all(|t| normal_of(&quad, t).z > 0.0));
    }
    // A star, standing in each of the planes and seen from both sides.
    let star = |i: usize| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 10.0).sin_cos();
        let r = [1.0, 0.3][i % 2];
        [r * cos, r * sin]
    };
    let star_area = 10.0 * 0.5 * 0.3 * (std::f32::consts::TAU / 10.0).sin();
    for axis in 0..3 {
        for backwards in [false, true] {
            let mut points = [[0.0; 3]; 10];
            for (i, p) in points.iter_mut().enumerate() {
                let [x, y] = star(i);
                (p[(axis + 1) % 3], p[(axis + 2) % 3], p[axis]) = (x, y, 0.1 * (x * 3.0).sin());
            }
            let mut face: Vec<i32> = (0..10).collect();
            if backwards {
                face.reverse();
            }
            let (found, _) = triangles(&mesh(&points, &[&face]));
            assert_eq!(found.len(), 8);
            let seen: f32 = (0..8)
                .map(|t| found.triangle(t))
                .map(|[a, b, c]| (b - a).cross(c - a)[axis] * if backwards { -0.5 } else { 0.5 })
                .inspect(|a| assert!(*a > 0.0, "no triangle is turned over"))
                .sum();
            assert!((seen - star_area).abs() < 1e-4, "{seen} instead of {star_area}");
        }
    }
}

#[test]
fn faces_that_make_no_sense_are_dropped_with_one_message_each() {
    let mut bad = cube();
    bad.points.push([f32::NAN, 0.0, 0.0]);
    bad.face_vertex_counts.extend([2, 3, 3, 3, 3, -7, 4]);
    bad.face_vertex_indices.extend([0, 1, 0, 1, 99, 0, 1, -4, 0, 1, 8, 2, 3, 8, 0]);
    bad.hole_indices = vec![0, 999, -5];
    let (found, messages) = triangles(&bad);
    assert_eq!(found.len(), 10, "a cube without one side");
    assert!(!found.face.contains(&0));
    assert_eq!(messages.len(), 3, "{messages:?}");
    assert!(messages[0].contains("2 faces") && messages[0].contains("face 6"), "{messages:?}");
    assert!(messages[1].contains("3 faces") && messages[1].contains("face 7"), "{messages:?}");
    assert!(messages[2].contains("2 faces") && messages[2].contains("face 9"), "{messages:?}");
    assert!(found.positions.iter().all(|p| p.is_finite()));
}

#[test]
fn far_away_points_keep_their_precision() {
    let far = |p: &[f32; 3]| [p[0] * 0.25 + 1e6, p[1] * 0.25 - 3e6, p[2] * 0.25];
    let points: Vec<[f32; 3]> = cube().points.iter().map(far).collect();
    let (found, _) = triangles(&Mesh { points, ..cube() });
    assert!((found.center - glam::DVec3::new(1e6, -3e6, 0.0)).length() < 1e-9);
    assert!(found.positions.iter().all(|p| p.abs() == Vec3::splat(0.25)));
    assert!(found.is_closed());
}

#[test]
fn normals_of_every_interpolation_and_of_the_wrong_length() {
    let normal = Vec3::new(0.6, 0.0, 0.8);
    for (interpolation, n) in [
        (Interpolation::Constant, 1),
        (Interpolation::Uniform, 6),
        (Interpolation::Varying, 8),
        (Interpolation::Vertex, 8),
        (Interpolation::FaceVarying, 24),
    ] {
        let values = (0..n).flat_map(|_| (normal * 7.0).to_array()).collect();
        let authored = Primvar { interpolation, components: 3, values };
        let (found, messages) = triangles(&Mesh { normals: Some(authored.clone()), ..cube() });
        assert!(messages.is_empty());
        let normals = found.normals.expect("normals");
        assert!(normals.as_flattened().iter().all(|n| (*n - normal).length() < 1e-6));

        let zero = Primvar { values: vec![0.0; 3 * n], ..authored.clone() };
        let (found, _) = triangles(&Mesh { normals: Some(zero), ..cube() });
        let normals = found.normals.as_ref().expect("normals");
        assert!((0..12).all(|t| normals[t].iter().all(|n| (*n - normal_of(&found, t)).length() < 1e-6)));

        let short = Primvar { values: vec![1.0; 3 * n - 1], ..authored };
        let (found, messages) = triangles(&Mesh { normals: Some(short), ..cube() });
        assert!(found.normals.is_none() && messages.len() == 1, "{messages:?}");
    }
}

#[test]
fn subsets_name_their_faces() {
    let subset = |faces: Vec<i32>| Subset { faces, material: None };
    let subsets = vec![subset(vec![1, 2]), subset(vec![5, 77, -1])];
    let (found, messages) = triangles(&Mesh { subsets, ..cube() });
    let slots: Vec<u16> = found.face.iter().map(|f| [0, 1, 1, 0, 0, 2][*f as usize]).collect();
    assert_eq!(found.subset, slots);
    assert!(messages.len() == 1 && messages[0].contains('2'), "{messages:?}");
}

proptest! {
    #[test]
    fn any_numbers_give_triangles_without_a_panic(
        points in prop::collection::vec(prop::array::uniform3(prop_oneof![-2f32..2.0, Just(f32::NAN), Just(3e38)]), 0..12),
        counts in prop::collection::vec(-2i32..8, 0..10),
        indices in prop::collection::vec(-1i32..13, 0..40),
    ) {
        let mesh = Mesh { points, face_vertex_counts: counts, face_vertex_indices: indices, ..Mesh::default() };
        let (found, _) = triangles(&mesh);
        prop_assert!(found.indices.as_flattened().iter().all(|&i| (i as usize) < found.positions.len()));
        prop_assert!(found.positions.iter().all(|p| !p.is_nan()));
        prop_assert_eq!(found.len(), found.face.len());
        prop_assert_eq!(found.len(), found.subset.len());
    }
}

//! Subdivision surfaces against known limits and stencils.

use crate::{cube, mesh, triangles};
use glam::Vec3;
use tyndall_geometry::TriangleMesh;
use tyndall_scene::prim::{Interpolation, Mesh, Primvar, Subdivision, SubdivisionScheme};

fn subdivided(mesh: Mesh, scheme: SubdivisionScheme) -> Mesh {
    Mesh { subdivision: Subdivision { scheme, ..mesh.subdivision.clone() }, ..mesh }
}

/// A cube of twelve triangles.
fn triangle_cube() -> Mesh {
    let (flat, _) = triangles(&cube());
    let faces: Vec<Vec<i32>> = flat.indices.iter().map(|t| t.map(|i| i as i32).to_vec()).collect();
    mesh(&cube().points, &faces.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

/// A flat grid of n by n quads in the xy plane.
fn grid(n: i32) -> Mesh {
    let points: Vec<[f32; 3]> =
        (0..(n + 1) * (n + 1)).map(|i| [(i % (n + 1)) as f32, (i / (n + 1)) as f32, 0.0]).collect();
    let quad = |i: i32| vec![i, i + 1, i + n + 2, i + n + 1];
    let faces: Vec<Vec<i32>> = (0..n * (n + 1)).filter(|i| i % (n + 1) < n).map(quad).collect();
    mesh(&points, &faces.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

fn has_point(mesh: &TriangleMesh, p: Vec3) -> bool {
    mesh.indices.as_flattened().iter().any(|&i| (mesh.positions[i as usize] - p).length() < 1e-5)
}

#[test]
fn closed_meshes_stay_closed_and_become_round() {
    for (control, scheme, per_face) in [
        (cube(), SubdivisionScheme::CatmullClark, 32),
        (triangle_cube(), SubdivisionScheme::Loop, 16),
        (cube(), SubdivisionScheme::Bilinear, 32),
    ] {
        let n_faces = control.face_vertex_counts.len();
        for left_handed in [false, true] {
            let (found, messages) = triangles(&subdivided(Mesh { left_handed, ..control.clone() }, scheme));
            assert!(messages.is_empty(), "{messages:?}");
            assert_eq!(found.len(), per_face * n_faces);
            assert!(found.is_closed());
            assert!(found.face.iter().all(|&f| (f as usize) < n_faces));
            let volume = found.signed_volume() * if left_handed { -1.0 } else { 1.0 };
            assert!(if scheme == SubdivisionScheme::Bilinear {
                (volume - 8.0).abs() < 1e-6
            } else {
                (2.0..6.0).contains(&volume)
            });
            let normals = found.normals.as_ref().expect("smooth normals");
            assert!(normals.as_flattened().iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        }
    }
}

#[test]
fn the_first_points_of_a_cube_are_those_of_the_paper() {
    // Two steps from the corner (1, 1, 1). First: n = 3, faces' centres (1,0,0).., edges' ends (-1,1,1)..
    let first = Vec3::splat(1.0 / 3.0 + (1.0 / 3.0) / 3.0 + (1.0 / 3.0) / 3.0);
    let (found, _) = triangles(&subdivided(cube(), SubdivisionScheme::CatmullClark));
    // Second: edge point of the first step (0, 3/4, 3/4) and its like; face points (mean of corner, edges, face).
    let edge = |axis: usize| Vec3::from_array(std::array::from_fn(|i| if i == axis { 0.0 } else { 0.75 }));
    let face = |axis: usize| {
        let center = Vec3::from_array(std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 }));
        (first + center + edge((axis + 1) % 3) + edge((axis + 2) % 3)) / 4.0
    };
    let f = (face(0) + face(1) + face(2)) / 3.0;
    let e = (edge(0) + edge(1) + edge(2)) / 3.0;
    let second = (f + e + first) / 3.0;
    assert!(has_point(&found, second), "{second}");
}

#[test]
fn a_flat_grid_keeps_its_outline_and_a_sharp_cube_its_corners() {
    let (found, _) = triangles(&subdivided(grid(3), SubdivisionScheme::CatmullClark));
    assert_eq!(crate::area(&found), 9.0);
    for sharpness in [10.0, f32::INFINITY] {
        let mut sharp = subdivided(cube(), SubdivisionScheme::CatmullClark);
        // Every edge of the cube, as chains of two points.
        let edges: Vec<[i32; 2]> =
            (0..8).flat_map(|i: i32| [1, 2, 4].map(|bit| [i, i ^ bit])).filter(|[a, b]| a < b).collect();
        sharp.subdivision.crease_indices = edges.concat();
        sharp.subdivision.crease_lengths = vec![2; 12];
        sharp.subdivision.crease_sharpnesses = vec![sharpness; 12];
        let (found, messages) = triangles(&sharp);
        assert!(messages.is_empty(), "{messages:?}");
        assert!((found.signed_volume() - 8.0).abs() < 1e-5);
    }
}

#[test]
fn fractional_sharpness_lies_between() {
    let volume = |sharpness: f32| {
        let mut control = subdivided(cube(), SubdivisionScheme::CatmullClark);
        control.subdivision.crease_indices = vec![0, 1, 3, 2, 0];
        control.subdivision.crease_lengths = vec![5];
        control.subdivision.crease_sharpnesses = vec![sharpness; 4];
        control.subdivision.corner_indices = vec![7];
        control.subdivision.corner_sharpnesses = vec![sharpness];
        triangles(&control).0.signed_volume()
    };
    let volumes: Vec<f64> = [0.0, 0.5, 1.0, 1.5, 2.0].map(volume).to_vec();
    assert!(volumes.windows(2).all(|v| v[0] < v[1]), "{volumes:?}");
    assert_eq!(volume(2.0), volume(10.0), "two levels don't see more");
}

#[test]
fn primvars_follow_the_surface() {
    for (control, scheme) in
        [(cube(), SubdivisionScheme::CatmullClark), (triangle_cube(), SubdivisionScheme::Loop)]
    {
        let control = subdivided(control, scheme);
        let (found, _) = triangles(&control);
        let primvar = |interpolation, values| Primvar { interpolation, components: 3, values };
        let points = control.points.concat();
        let of_corners: Vec<f32> =
            control.face_vertex_indices.iter().flat_map(|&i| control.points[i as usize]).collect();
        // The points themselves as a vertex primvar are the surface.
        let vertex = found.refine(&primvar(Interpolation::Vertex, points.clone())).into_owned();
        // Linear ones are points of the control mesh.
        let varying = found.refine(&primvar(Interpolation::Varying, points)).into_owned();
        let corner = found.refine(&primvar(Interpolation::FaceVarying, of_corners)).into_owned();
        for t in 0..found.len() {
            let bary = [0.5, 0.2, 0.3];
            let [a, b, c] = found.triangle(t);
            let p = a * bary[0] + b * bary[1] + c * bary[2] + found.center.as_vec3();
            let at = |primvar: &Primvar| Vec3::from_slice(&found.primvar(primvar, t, bary)[..3]);
            assert!((at(&vertex) - p).length() < 1e-5);
            assert!((at(&varying) - at(&corner)).length() < 1e-5);
            assert!((at(&varying).abs().max_element() - 1.0).abs() < 1e-5, "on the control cube");
        }
        for n in [0, 2, 7] {
            let short = found.refine(&primvar(Interpolation::FaceVarying, vec![1.0; n])).into_owned();
            assert!(found.primvar(&short, 0, [0.3; 3])[0].is_finite());
        }
    }
}

#[test]
fn loop_of_quads_and_bad_creases_are_reported() {
    let (found, messages) = triangles(&subdivided(cube(), SubdivisionScheme::Loop));
    assert!(messages.len() == 1 && messages[0].contains("loop"), "{messages:?}");
    assert_eq!(found.len(), 6 * 32);
    let mut bad = subdivided(cube(), SubdivisionScheme::CatmullClark);
    bad.subdivision.crease_indices = vec![0, 99, 1];
    bad.subdivision.crease_lengths = vec![2, 5, -1];
    bad.subdivision.crease_sharpnesses = vec![1.0];
    bad.subdivision.corner_indices = vec![-1];
    let (found, messages) = triangles(&bad);
    assert!(messages.len() == 1 && messages[0].contains("creases"), "{messages:?}");
    assert!(found.is_closed());
}

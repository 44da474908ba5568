//! Implicit shapes.

use std::f64::consts::PI;
use tyndall_geometry::TriangleMesh;
use tyndall_scene::prim::ShapeKind;

#[test]
fn shapes_are_closed_outward_and_of_the_right_volume() {
    let (radius_top, radius_bottom, height) = (0.5, 1.5, 2.0);
    let frustum = PI * height / 3.0 * (0.25 + 0.75 + 2.25);
    let balls = 2.0 / 3.0 * PI * (0.125 + 3.375);
    let shapes = [
        (ShapeKind::Cube { size: 3.0 }, 27.0),
        (ShapeKind::Sphere { radius: 2.0 }, 4.0 / 3.0 * PI * 8.0),
        (ShapeKind::Cylinder { radius_top, radius_bottom, height }, frustum),
        (ShapeKind::Cone { radius: 2.0, height: 3.0 }, PI * 4.0),
        (ShapeKind::Capsule { radius_top, radius_bottom, height }, frustum + balls),
        (ShapeKind::Capsule { radius_top: 1.0, radius_bottom: 1.0, height: 0.0 }, 4.0 / 3.0 * PI),
    ];
    for (kind, volume) in shapes {
        let mesh = TriangleMesh::from_shape(&kind);
        assert!(mesh.is_closed(), "{kind:?}");
        assert!((mesh.signed_volume() / volume - 1.0).abs() < 1e-3, "{kind:?}: {}", mesh.signed_volume());
        for t in 0..mesh.len() {
            let [a, b, c] = mesh.triangle(t);
            let normal = (b - a).cross(c - a).normalize();
            for n in mesh.normals.iter().flat_map(|n| n[t]) {
                assert!((n.length() - 1.0).abs() < 1e-5);
                assert!(n.dot(normal) > 0.99, "{kind:?}: {n} beside {normal}");
            }
        }
    }
}

#[test]
fn the_plane_faces_up_and_absurd_sizes_do_not_panic() {
    let mesh = TriangleMesh::from_shape(&ShapeKind::Plane { width: 2.0, length: 6.0 });
    assert_eq!(crate::area(&mesh), 12.0);
    let [a, b, c] = mesh.triangle(0);
    assert!((b - a).cross(c - a).z > 0.0 && !mesh.is_closed());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
        for kind in [
            ShapeKind::Cube { size: bad },
            ShapeKind::Sphere { radius: bad },
            ShapeKind::Cone { radius: bad, height: bad },
            ShapeKind::Cylinder { radius_top: bad, radius_bottom: 1.0, height: bad },
            ShapeKind::Capsule { radius_top: bad, radius_bottom: 1.0, height: 1.0 },
            ShapeKind::Plane { width: bad, length: 1.0 },
        ] {
            let mesh = TriangleMesh::from_shape(&kind);
            assert!(mesh.positions.iter().all(|p| p.is_finite()));
        }
    }
}

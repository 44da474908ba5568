//! Prim data into triangles.

mod from_prim;
mod from_shape;
mod primvars;
mod subdivision;

use tyndall_geometry::TriangleMesh;
use tyndall_scene::Diagnostics;
use tyndall_scene::prim::Mesh;

/// A mesh of given faces.
fn mesh(points: &[[f32; 3]], faces: &[&[i32]]) -> Mesh {
    Mesh {
        points: points.to_vec(),
        face_vertex_counts: faces.iter().map(|f| f.len() as i32).collect(),
        face_vertex_indices: faces.concat(),
        ..Mesh::default()
    }
}

/// Triangles and messages of a mesh.
fn triangles(mesh: &Mesh) -> (TriangleMesh, Vec<String>) {
    let mut diagnostics = Diagnostics::default();
    let triangles = TriangleMesh::from_prim(&"/mesh".into(), mesh, &mut diagnostics);
    (triangles, diagnostics.as_slice().iter().map(ToString::to_string).collect())
}

/// The cube [-1, 1]^3 of six quads.
fn cube() -> Mesh {
    let point = |i: u32| [0, 1, 2].map(|bit| if i >> bit & 1 == 1 { 1.0 } else { -1.0 });
    let faces: [&[i32]; 6] =
        [&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]];
    mesh(&(0..8).map(point).collect::<Vec<_>>(), &faces)
}

/// Total area of the triangles.
fn area(mesh: &TriangleMesh) -> f32 {
    (0..mesh.len()).map(|t| mesh.triangle(t)).map(|[a, b, c]| (b - a).cross(c - a).length() * 0.5).sum()
}

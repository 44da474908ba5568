//! Shading normals.

use super::TriangleMesh;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use tyndall_scene::prim::{Interpolation, Mesh, Primvar};
use tyndall_scene::{Diagnostics, PrimPath};

/// Corner normals as authored; `None` (faceted) with a diagnostic if their number is wrong. Normals that are zero or
/// not finite are replaced by the triangle's.
pub(super) fn authored(
    path: &PrimPath,
    triangles: &TriangleMesh,
    mesh: &Mesh,
    normals: &Primvar,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<[Vec3; 3]>> {
    let needed = super::primvar::n_values(mesh, normals.interpolation) * 3;
    if normals.components != 3 || normals.values.len() < needed {
        let (found, interpolation) = (normals.values.len(), normals.interpolation);
        diagnostics.warn(
            path,
            format!("normals have {found} numbers where {interpolation:?} interpolation needs {needed}"),
            "the normals were ignored and the mesh is faceted",
        );
        return None;
    }
    let value = |i: u32| {
        let at = 3 * i as usize;
        normals.values.get(at..at + 3).map_or(Vec3::ZERO, Vec3::from_slice).try_normalize()
    };
    let corner_normals = |t: usize| {
        let ids = match normals.interpolation {
            Interpolation::Constant => [0; 3],
            Interpolation::Uniform => [triangles.face[t]; 3],
            Interpolation::Varying | Interpolation::Vertex => triangles.indices[t],
            Interpolation::FaceVarying => triangles.corner[t],
        };
        ids.map(|i| value(i).unwrap_or_else(|| face_normal(triangles, t)))
    };
    Some((0..triangles.len()).into_par_iter().map(corner_normals).collect())
}

/// Normals of points, each the mean of its triangles' weighted by their angle there (Max 1999 discusses the choice):
/// independent of how polygons were cut into triangles.
pub(super) fn smooth(triangles: &TriangleMesh) -> Vec<[Vec3; 3]> {
    let mut sum = vec![DVec3::ZERO; triangles.positions.len()];
    for t in 0..triangles.len() {
        let points = triangles.triangle(t).map(Vec3::as_dvec3);
        let normal = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or_zero();
        for i in 0..3 {
            let (to_next, to_last) = (points[(i + 1) % 3] - points[i], points[(i + 2) % 3] - points[i]);
            let angle = to_next.angle_between(to_last);
            if angle.is_finite() {
                sum[triangles.indices[t][i] as usize] += normal * angle;
            }
        }
    }
    let unit: Vec<Option<Vec3>> = sum.iter().map(|n| n.try_normalize().map(|n| n.as_vec3())).collect();
    let corner_normals = |t: usize| {
        triangles.indices[t].map(|i| unit[i as usize].unwrap_or_else(|| face_normal(triangles, t)))
    };
    (0..triangles.len()).into_par_iter().map(corner_normals).collect()
}

fn face_normal(triangles: &TriangleMesh, t: usize) -> Vec3 {
    let [a, b, c] = triangles.triangle(t).map(Vec3::as_dvec3);
    (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z).as_vec3()
}

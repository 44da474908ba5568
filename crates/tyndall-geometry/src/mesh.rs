//! From prim data to triangles.

mod cage;
mod closed;
mod normals;
mod polygon;
mod primvar;
mod shape;

pub(crate) use cage::{Cage, Face};

use crate::subdivision::{self, Refinement};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use tyndall_scene::prim::{Mesh, SubdivisionScheme};
use tyndall_scene::{Diagnostics, PrimPath};

/// Faces that one thread cuts into triangles at a time.
const FACES_AT_ONCE: usize = 1 << 14;

/// Triangles of a mesh or implicit shape, in object space about their own centre.
#[derive(Debug, Clone, Default)]
pub struct TriangleMesh {
    /// Points in object space *less `center`*. Numbered as the mesh's points (of the refined mesh, if subdivided);
    /// points no triangle uses may be anything finite.
    pub positions: Vec<Vec3>,
    /// Where the origin of `positions` is in object space. Subtracted in f64 before rounding, so that points far from
    /// the object's origin keep their precision; compose it into `world_from_object`.
    pub center: DVec3,
    /// Points of each triangle, counter-clockwise seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Face of the mesh each triangle is part of.
    pub face: Vec<u32>,
    /// Face-vertex of each triangle corner: what face-varying values are numbered by.
    pub corner: Vec<[u32; 3]>,
    /// Unit shading normals of each triangle's corners in object space; `None` if the mesh is faceted.
    pub normals: Option<Vec<[Vec3; 3]>>,
    /// Material of each triangle: 0 is the mesh's, i + 1 that of subset i.
    pub subset: Vec<u16>,
    /// How primvars follow subdivision.
    pub(crate) refinement: Option<Refinement>,
}

impl TriangleMesh {
    /// The triangles of a mesh prim. Never fails: faces that make no sense are dropped with one diagnostic of each
    /// kind, so an absurd mesh becomes an empty one.
    pub fn from_prim(path: &PrimPath, mesh: &Mesh, diagnostics: &mut Diagnostics) -> Self {
        let cage = Cage::from_prim(path, mesh, diagnostics);
        primvar::check(path, mesh, diagnostics);
        let subset_of_face = subsets(path, mesh, diagnostics);
        let refined = match mesh.subdivision.scheme {
            SubdivisionScheme::None => None,
            _ => subdivision::refine(path, &cage, &mesh.subdivision, diagnostics),
        };
        let (cage, refinement) = match refined {
            Some((cage, refinement)) => (cage, Some(refinement)),
            None => (cage, None),
        };
        let mut out = Self::triangulated(&cage, mesh.left_handed);
        out.normals = match (&refinement, &mesh.normals) {
            (Some(_), _) => Some(normals::smooth(&out)),
            (None, Some(normals)) => normals::authored(path, &out, mesh, normals, diagnostics),
            (None, None) => None,
        };
        out.subset = out.face.iter().map(|&f| subset_of_face.get(f as usize).copied().unwrap_or(0)).collect();
        out.refinement = refinement;
        out
    }

    fn triangulated(cage: &Cage, flip: bool) -> Self {
        let center = cage.center();
        let positions = cage.points.iter().map(|p| (*p - center).as_vec3()).collect();
        let cut: Vec<Self> = cage.faces.par_chunks(FACES_AT_ONCE).map(|f| Self::cut(cage, f, flip)).collect();
        let n_triangles = cut.iter().map(Self::len).sum();
        let mut out = Self {
            positions,
            center,
            indices: Vec::with_capacity(n_triangles),
            face: Vec::with_capacity(n_triangles),
            corner: Vec::with_capacity(n_triangles),
            ..Self::default()
        };
        for part in cut {
            out.indices.extend(part.indices);
            out.face.extend(part.face);
            out.corner.extend(part.corner);
        }
        out
    }

    /// The triangles of some faces of a cage, without points.
    fn cut(cage: &Cage, faces: &[Face], flip: bool) -> Self {
        let mut out = Self::default();
        let mut polygon = polygon::Triangulator::default();
        for face in faces {
            let corners = &cage.corners[face.range()];
            let points = corners.iter().map(|&p| cage.points[p as usize]);
            polygon.triangulate(points, |mut triangle| {
                if flip {
                    triangle.swap(1, 2);
                }
                let indices = triangle.map(|i| corners[i as usize]);
                if indices[0] == indices[1] || indices[1] == indices[2] || indices[2] == indices[0] {
                    return;
                }
                out.indices.push(indices);
                out.corner.push(triangle.map(|i| face.first_corner + i));
                out.face.push(face.source);
            });
        }
        out
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// Corners of a triangle, less `center`.
    pub fn triangle(&self, triangle: usize) -> [Vec3; 3] {
        self.indices[triangle].map(|i| self.positions[i as usize])
    }
}

/// Material slot of each face.
fn subsets(path: &PrimPath, mesh: &Mesh, diagnostics: &mut Diagnostics) -> Vec<u16> {
    let mut slot_of_face = vec![0u16; mesh.face_vertex_counts.len()];
    if mesh.subsets.is_empty() {
        return Vec::new();
    }
    let mut n_wrong = 0usize;
    for (slot, subset) in (1..=u16::MAX).zip(&mesh.subsets) {
        for &face in &subset.faces {
            match usize::try_from(face).ok().and_then(|f| slot_of_face.get_mut(f)) {
                Some(of_face) => *of_face = slot,
                None => n_wrong += 1,
            }
        }
    }
    if n_wrong > 0 {
        diagnostics.warn(
            path,
            format!("subsets name {n_wrong} faces that the mesh does not have"),
            "these were ignored; the subsets may belong to another version of the mesh",
        );
    }
    slot_of_face
}

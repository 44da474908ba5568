//! What a mesh encloses.

use super::TriangleMesh;
use crate::blas::signed_volume;
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

impl TriangleMesh {
    /// Whether every edge is shared by exactly two triangles that run along it in opposite directions. Points at the
    /// same position count as one. False for an empty mesh.
    pub fn is_closed(&self) -> bool {
        let mut id_of_position = FxHashMap::<[u32; 3], u32>::default();
        let ids: Vec<u32> = self
            .positions
            .iter()
            .map(|p| {
                let next = id_of_position.len() as u32;
                // Adding zero makes -0 and +0 one.
                *id_of_position.entry((*p + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert(next)
            })
            .collect();
        // Uses of each edge in ascending and descending direction.
        let mut uses = FxHashMap::<(u32, u32), [u32; 2]>::default();
        for triangle in &self.indices {
            let [a, b, c] = triangle.map(|i| ids[i as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                uses.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] += 1;
            }
        }
        !uses.is_empty() && uses.values().all(|u| *u == [1, 1])
    }

    /// Volume enclosed, in object units cubed; negative if the mesh is wound inside out. Only meaningful if closed.
    pub fn signed_volume(&self) -> f64 {
        let corners = |t: usize| self.triangle(t).map(Vec3::as_dvec3);
        (0..self.len()).map(|t| signed_volume(corners(t), DVec3::ZERO)).sum()
    }

    /// Turns the mesh inside out: winding, corners and shading normals.
    pub fn flip(&mut self) {
        self.indices.iter_mut().for_each(|t| t.swap(1, 2));
        self.corner.iter_mut().for_each(|t| t.swap(1, 2));
        for normals in self.normals.iter_mut().flatten() {
            normals.swap(1, 2);
            *normals = normals.map(|n| -n);
        }
    }
}

//! What outlives a commit because it is expensive to build.

use super::bake::{BakeSource, Baked};
use super::surface_mesh::SurfaceMesh;
use rustc_hash::FxHashMap;
use std::sync::Arc;
use tyndall_scene::prim::{FieldSource, Mesh, Shape};
use tyndall_scene::{FieldGrid, PrimPath};
use tyndall_volume::{BrickGrid, ColorGrid, GridReport};

/// Built content by prim, with what it was built from: an entry is used again only if that is equal, so the cache can
/// never make a picture stale. Entries that a build does not use are dropped at its end.
#[derive(Default)]
pub struct WorldCache {
    pub(super) meshes: Kept<PrimPath, MeshSource, SurfaceMesh>,
    pub(super) grids: Kept<PrimPath, GridSource, BuiltGrid>,
    pub(super) colors: Kept<PrimPath, GridSource, (Arc<ColorGrid>, GridReport)>,
    /// By the prim and its placement.
    pub(super) baked: Kept<(PrimPath, usize), BakeSource, Baked>,
}

/// A field as a density.
pub(super) struct BuiltGrid {
    pub(super) grid: Arc<BrickGrid>,
    pub(super) report: GridReport,
    /// Nothing but its values says that they are distances.
    pub(super) is_guess: bool,
}

/// What a surface is made from.
pub(super) enum MeshSource {
    Mesh(Arc<Mesh>),
    Shape(Arc<Shape>),
}

impl PartialEq for MeshSource {
    /// Equal content gives equal triangles: placement, bindings and visibility do not count.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b) || is_same_geometry(a, b),
            (Self::Shape(a), Self::Shape(b)) => a.kind == b.kind && a.primvars == b.primvars,
            _ => false,
        }
    }
}

fn is_same_geometry(a: &Mesh, b: &Mesh) -> bool {
    let faces = |m: &Mesh| m.subsets.iter().map(|s| s.faces.clone()).collect::<Vec<_>>();
    a.points == b.points
        && a.face_vertex_counts == b.face_vertex_counts
        && a.face_vertex_indices == b.face_vertex_indices
        && a.hole_indices == b.hole_indices
        && a.left_handed == b.left_handed
        && a.subdivision == b.subdivision
        && a.normals == b.normals
        && a.primvars == b.primvars
        && faces(a) == faces(b)
}

/// What a brick grid is made from: the decoded file (by identity; the loader decodes a changed file anew), or numbers.
pub(super) enum GridSource {
    File(Arc<FieldGrid>),
    Dense(FieldSource),
}

impl PartialEq for GridSource {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::File(a), Self::File(b)) => Arc::ptr_eq(a, b),
            (Self::Dense(a), Self::Dense(b)) => a == b,
            _ => false,
        }
    }
}

/// Entries by key that are kept while they are used.
pub(super) struct Kept<K, S, T> {
    entries: FxHashMap<K, Entry<S, T>>,
}

struct Entry<S, T> {
    source: S,
    built: Arc<T>,
    is_used: bool,
}

impl<K, S, T> Default for Kept<K, S, T> {
    fn default() -> Self {
        Self { entries: FxHashMap::default() }
    }
}

impl<K: std::hash::Hash + Eq, S: PartialEq, T> Kept<K, S, T> {
    /// What was built from `source` before, or now.
    pub(super) fn get_or_build(&mut self, key: K, source: S, build: impl FnOnce(&S) -> T) -> Arc<T> {
        if let Some(entry) = self.entries.get_mut(&key)
            && entry.source == source
        {
            entry.is_used = true;
            return Arc::clone(&entry.built);
        }
        let built = Arc::new(build(&source));
        self.entries.insert(key, Entry { source, built: Arc::clone(&built), is_used: true });
        built
    }

    /// Drops what was not asked for since the last call.
    pub(super) fn drop_unused(&mut self) {
        self.entries.retain(|_, entry| std::mem::take(&mut entry.is_used));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_content_is_built_once_and_unused_content_dropped() {
        let mut kept: Kept<&str, i32, i32> = Kept::default();
        let mut builds = 0;
        for source in [1, 1, 2, 2, 1] {
            kept.get_or_build("a", source, |s| {
                builds += 1;
                *s
            });
        }
        assert_eq!(builds, 3);
        kept.drop_unused();
        assert_eq!(kept.entries.len(), 1, "used before the first call");
        kept.drop_unused();
        assert!(kept.entries.is_empty());
    }

    #[test]
    fn moving_or_rebinding_a_mesh_keeps_its_triangles() {
        let mesh = Mesh { points: vec![[0.0; 3]], ..Default::default() };
        let moved = Mesh {
            world_from_object: glam::DAffine3::from_translation(glam::DVec3::ONE),
            material: Some("/m".into()),
            visible: false,
            ..mesh.clone()
        };
        let deformed = Mesh { points: vec![[1.0; 3]], ..mesh.clone() };
        let source = |m: &Mesh| MeshSource::Mesh(Arc::new(m.clone()));
        assert!(source(&mesh) == source(&moved));
        assert!(source(&mesh) != source(&deformed));
    }
}

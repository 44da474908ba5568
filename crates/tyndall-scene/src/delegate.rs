//! The render delegate's state: what front ends talk to.

use crate::prim::Prim;
use crate::{Diagnostic, Diagnostics, DirtyBits, PrimPath};
use std::collections::BTreeMap;
use std::sync::Arc;

/// An immutable shot. Prims are in path order, so everything derived from it is independent of the order of syncs.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    prims: BTreeMap<PrimPath, Prim>,
    /// What changed since the commit before, by path; removed prims are listed with [`DirtyBits::ALL`].
    changes: BTreeMap<PrimPath, DirtyBits>,
    diagnostics: Diagnostics,
}

impl Scene {
    /// The prim at `path`.
    pub fn get(&self, path: &PrimPath) -> Option<&Prim> {
        self.prims.get(path)
    }

    /// All prims in path order.
    pub fn prims(&self) -> impl Iterator<Item = (&PrimPath, &Prim)> {
        self.prims.iter()
    }

    /// What changed since the commit before.
    pub fn changes(&self) -> &BTreeMap<PrimPath, DirtyBits> {
        &self.changes
    }

    /// What front ends reported while they filled the delegate.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }
}

/// Receives prims from a front end and hands out immutable scenes (Hydra's `HdRenderDelegate`, reduced to its data).
#[derive(Debug, Default)]
pub struct RenderDelegate {
    prims: BTreeMap<PrimPath, Prim>,
    changes: BTreeMap<PrimPath, DirtyBits>,
    /// Messages by the prim they are about, so that a new sync of the prim forgets the old ones.
    diagnostics: BTreeMap<String, Vec<Diagnostic>>,
}

impl RenderDelegate {
    /// An empty delegate.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the prim at `path`; `dirty` says what differs from the last sync. Messages about the prim are forgotten:
    /// the front end reports those that still hold.
    pub fn sync(&mut self, path: PrimPath, prim: Prim, dirty: DirtyBits) {
        let is_new_or_other_kind = self.prims.get(&path).is_none_or(|old| old.kind() != prim.kind());
        let dirty = if is_new_or_other_kind { DirtyBits::ALL } else { dirty };
        self.diagnostics.remove(path.as_str());
        *self.changes.entry(path.clone()).or_default() |= dirty;
        self.prims.insert(path, prim);
    }

    /// Removes the prim at `path`; returns whether there was one.
    pub fn remove(&mut self, path: &PrimPath) -> bool {
        self.diagnostics.remove(path.as_str());
        let existed = self.prims.remove(path).is_some();
        if existed {
            self.changes.insert(path.clone(), DirtyBits::ALL);
        }
        existed
    }

    /// Adds a message of the front end.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        let of_prim = self.diagnostics.entry(diagnostic.path.clone()).or_default();
        if !of_prim.contains(&diagnostic) {
            of_prim.push(diagnostic);
        }
    }

    /// The shot as it is now. Shares all prims with the delegate: nothing is copied.
    pub fn commit(&mut self) -> Arc<Scene> {
        let mut diagnostics = Diagnostics::default();
        self.diagnostics.values().flatten().for_each(|d| diagnostics.push(d.clone()));
        Arc::new(Scene { prims: self.prims.clone(), changes: std::mem::take(&mut self.changes), diagnostics })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Severity;
    use crate::prim::{Camera, Mesh};

    fn camera() -> Prim {
        Prim::Camera(Arc::new(Camera::default()))
    }

    #[test]
    fn changes_accumulate_until_the_commit() {
        let mut delegate = RenderDelegate::new();
        delegate.sync("/cam".into(), camera(), DirtyBits::NONE);
        let first = delegate.commit();
        assert_eq!(first.changes()[&"/cam".into()], DirtyBits::ALL, "a first sync is all new");
        delegate.sync("/cam".into(), camera(), DirtyBits::CAMERA);
        delegate.sync("/cam".into(), camera(), DirtyBits::TRANSFORM);
        let second = delegate.commit();
        assert_eq!(second.changes()[&"/cam".into()], DirtyBits::CAMERA | DirtyBits::TRANSFORM);
        assert!(delegate.commit().changes().is_empty());
    }

    #[test]
    fn a_prim_that_changes_kind_is_all_new_and_removal_is_a_change() {
        let mut delegate = RenderDelegate::new();
        delegate.sync("/a".into(), camera(), DirtyBits::ALL);
        delegate.commit();
        delegate.sync("/a".into(), Prim::Mesh(Arc::default()), DirtyBits::NONE);
        assert_eq!(delegate.commit().changes()[&"/a".into()], DirtyBits::ALL);
        assert!(delegate.remove(&"/a".into()));
        assert!(!delegate.remove(&"/a".into()));
        let scene = delegate.commit();
        assert!(scene.get(&"/a".into()).is_none());
        assert_eq!(scene.changes().len(), 1);
    }

    #[test]
    fn a_new_sync_forgets_the_messages_of_the_prim() {
        let mut delegate = RenderDelegate::new();
        let message = |path: &str| Diagnostic {
            severity: Severity::Warning,
            path: path.into(),
            what: "x".into(),
            action: String::new(),
        };
        delegate.report(message("/a"));
        delegate.report(message("/b"));
        delegate.sync("/a".into(), Prim::Mesh(Arc::new(Mesh::default())), DirtyBits::ALL);
        let scene = delegate.commit();
        assert_eq!(scene.diagnostics().as_slice(), [message("/b")]);
    }
}

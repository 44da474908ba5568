//! Materials by path, compiled once.

use super::context::BuildContext;
use rustc_hash::FxHashMap;
use tyndall_scene::PrimPath;
use tyndall_scene::prim::Prim;
use tyndall_shading::CompiledMaterial;

/// Compiled materials of a world in the making.
#[derive(Default)]
pub(super) struct Materials {
    compiled: Vec<CompiledMaterial>,
    index_of: FxHashMap<Option<PrimPath>, usize>,
}

impl Materials {
    /// The material that `user` is bound to; a grey default, with a message, if there is none at `path`.
    pub(super) fn bound(
        &mut self,
        path: Option<&PrimPath>,
        user: &PrimPath,
        context: &mut BuildContext,
    ) -> usize {
        let material = path.and_then(|path| match context.scene.get(path) {
            Some(Prim::Material(material)) => Some((path, material)),
            _ => {
                let what = format!("the bound material <{path}> does not exist");
                context.diagnostics.warn(user, what, "a grey default is used; check the binding");
                None
            }
        });
        let key = material.map(|(path, _)| path.clone());
        if let Some(index) = self.index_of.get(&key) {
            return *index;
        }
        let compiled = match material {
            Some((path, material)) if material.surface.is_some() || material.volume.is_some() => {
                CompiledMaterial::compile(path, material, context.assets, &mut context.diagnostics)
            }
            Some((path, _)) => {
                let action = "a grey default is used; connect a surface or a volume";
                context.diagnostics.warn(path, "the material has neither a surface nor a volume", action);
                CompiledMaterial::fallback()
            }
            None => CompiledMaterial::fallback(),
        };
        self.compiled.push(compiled);
        self.index_of.insert(key, self.compiled.len() - 1);
        self.compiled.len() - 1
    }

    /// The compiled material at an index.
    pub(super) fn get(&self, index: usize) -> &CompiledMaterial {
        &self.compiled[index]
    }

    /// The materials and their paths; the default has none.
    pub(super) fn finish(self) -> (Vec<CompiledMaterial>, Vec<Option<PrimPath>>) {
        let mut paths = vec![None; self.compiled.len()];
        self.index_of.into_iter().for_each(|(path, index)| paths[index] = path);
        (self.compiled, paths)
    }
}

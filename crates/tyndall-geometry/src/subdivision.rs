//! Subdivision surfaces.

use crate::mesh::Cage;
use tyndall_scene::prim::{Primvar, Subdivision};
use tyndall_scene::{Diagnostics, PrimPath};

/// placeholder
#[derive(Debug, Clone)]
pub(crate) struct Refinement;

impl Refinement {
    pub(crate) fn apply(&self, primvar: &Primvar) -> Primvar {
        primvar.clone()
    }
}

pub(crate) fn refine(
    _path: &PrimPath,
    _cage: &Cage,
    _subdivision: &Subdivision,
    _diagnostics: &mut Diagnostics,
) -> Option<(Cage, Refinement)> {
    None
}

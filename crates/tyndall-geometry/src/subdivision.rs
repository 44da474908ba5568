//! Subdivision surfaces: uniform refinement of the control mesh, two levels.
//!
//! Catmull, Clark 1978 and Loop 1987, with the creases and corners of DeRose, Kass, Truong 1998 (sharpness falls by one
//! a level; the fraction blends) and the boundary rule `edgeAndCorner`: boundary edges are infinitely sharp, and so are
//! corners of a single face. Every refined point is a fixed mean of control points, a *stencil*; primvars follow the
//! same stencils (`vertex`) or linear ones (`varying`, `faceVarying`).

mod catmull_clark;
mod edges;
mod loop_scheme;
mod stencil;

pub(crate) use stencil::Refinement;

use crate::mesh::Cage;
use edges::Sharpness;
use stencil::Level;
use tyndall_scene::prim::{Subdivision, SubdivisionScheme};
use tyndall_scene::{Diagnostics, PrimPath};

/// Refinements of the control mesh: each divides faces by four.
const LEVELS: usize = 2;

/// Control faces above which one level is enough, and none: a bound on memory.
const MAX_FACES: [usize; 2] = [2_000_000, 8_000_000];

/// The mesh after subdivision; `None` if it stays as it is.
pub(crate) fn refine(
    path: &PrimPath,
    cage: &Cage,
    subdivision: &Subdivision,
    diagnostics: &mut Diagnostics,
) -> Option<(Cage, Refinement)> {
    let scheme = scheme(path, cage, subdivision.scheme, diagnostics)?;
    let n_levels = LEVELS - MAX_FACES.iter().filter(|&&max| cage.faces.len() > max).count();
    if n_levels < LEVELS {
        let n = cage.faces.len();
        diagnostics.warn(
            path,
            format!("{n} faces are too many to subdivide {LEVELS} times"),
            "subdivided less",
        );
    }
    let mut sharpness = Sharpness::from_prim(path, cage, subdivision, diagnostics);
    let mut levels: Vec<Level> = Vec::new();
    let mut current = cage.clone();
    for _ in 0..n_levels {
        let level = match scheme {
            SubdivisionScheme::Loop => loop_scheme::level(&current, &mut sharpness),
            other => catmull_clark::level(&current, &mut sharpness, other == SubdivisionScheme::Bilinear),
        };
        current = level.refined(&current);
        levels.push(level);
    }
    Some((current, Refinement::new(levels)))
}

fn scheme(
    path: &PrimPath,
    cage: &Cage,
    scheme: SubdivisionScheme,
    diagnostics: &mut Diagnostics,
) -> Option<SubdivisionScheme> {
    if cage.faces.is_empty() || scheme == SubdivisionScheme::None {
        return None;
    }
    if scheme == SubdivisionScheme::Loop && cage.faces.iter().any(|f| f.n_corners != 3) {
        diagnostics.warn(
            path,
            "subdivisionScheme is loop but some faces are not triangles",
            "subdivided by catmullClark instead",
        );
        return Some(SubdivisionScheme::CatmullClark);
    }
    Some(scheme)
}

//! Refined values as fixed means of coarser ones.

use crate::mesh::{Cage, Face};
use glam::DVec3;
use tyndall_scene::prim::{Interpolation, Primvar};

/// Sparse rows of weights: row i of the finer level is the sum of weight * value of the coarser.
#[derive(Debug, Clone, Default)]
pub(super) struct Stencils {
    /// End of each row in the other two.
    end: Vec<u32>,
    source: Vec<u32>,
    weight: Vec<f32>,
}

impl Stencils {
    /// Appends a row; weights of the same source may come in parts.
    pub(super) fn push(&mut self, row: impl IntoIterator<Item = (u32, f64)>) {
        let start = self.source.len();
        for (source, weight) in row {
            match self.source[start..].iter().position(|&s| s == source) {
                Some(at) => self.weight[start + at] += weight as f32,
                None => {
                    self.source.push(source);
                    self.weight.push(weight as f32);
                }
            }
        }
        self.end.push(self.source.len() as u32);
    }

    /// Appends the mean of the sources.
    pub(super) fn push_mean(&mut self, sources: impl ExactSizeIterator<Item = u32>) {
        let weight = 1.0 / sources.len() as f64;
        self.push(sources.map(|s| (s, weight)));
    }

    fn rows(&self) -> impl Iterator<Item = impl Iterator<Item = (u32, f32)> + '_> + '_ {
        let starts = std::iter::once(0).chain(self.end.iter().copied());
        starts.zip(&self.end).map(|(start, &end)| {
            let range = start as usize..end as usize;
            self.source[range.clone()].iter().copied().zip(self.weight[range].iter().copied())
        })
    }

    fn points(&self, coarse: &[DVec3]) -> Vec<DVec3> {
        self.rows().map(|row| row.map(|(s, w)| coarse[s as usize] * f64::from(w)).sum()).collect()
    }

    /// Missing coarse values count as zero.
    fn values(&self, coarse: &[f32], components: usize) -> Vec<f32> {
        let mut fine = Vec::with_capacity(self.end.len().saturating_mul(components.min(4)));
        for row in self.rows() {
            let start = fine.len();
            fine.resize(start + components, 0.0);
            for (source, weight) in row {
                let at = source as usize * components;
                let values = coarse.get(at..at + components).unwrap_or(&[]);
                fine[start..].iter_mut().zip(values).for_each(|(f, v)| *f += weight * v);
            }
        }
        fine
    }
}

/// One refinement step.
#[derive(Debug, Clone, Default)]
pub(super) struct Level {
    /// Points and `vertex` primvars.
    pub(super) smooth: Stencils,
    /// `varying` primvars, numbered as the points.
    pub(super) linear: Stencils,
    /// `faceVarying` primvars.
    pub(super) corner: Stencils,
    /// The finer faces' points.
    pub(super) corners: Vec<u32>,
    pub(super) faces: Vec<Face>,
}

impl Level {
    /// Adds a face of the finer mesh: its points, and each corner's coarse face-vertices with weights.
    pub(super) fn push_face<const N: usize>(
        &mut self,
        source: u32,
        points: [u32; N],
        corners: [&[(u32, f64)]; N],
    ) {
        let first_corner = self.corners.len() as u32;
        self.faces.push(Face { source, first_corner, n_corners: N as u32 });
        self.corners.extend(points);
        corners.into_iter().for_each(|row| self.corner.push(row.iter().copied()));
    }

    pub(super) fn refined(&self, coarse: &Cage) -> Cage {
        let points = self.smooth.points(&coarse.points);
        Cage { points, corners: self.corners.clone(), faces: self.faces.clone() }
    }
}

/// All steps from the control mesh to the finest.
#[derive(Debug, Clone)]
pub(crate) struct Refinement {
    levels: Vec<Level>,
}

impl Refinement {
    pub(super) fn new(mut levels: Vec<Level>) -> Self {
        // Only the stencils are needed from here on.
        levels.iter_mut().for_each(|l| (l.corners, l.faces) = Default::default());
        Self { levels }
    }

    /// Values for the finest mesh. `constant` and `uniform` ones stay: faces keep their number.
    pub(crate) fn apply(&self, primvar: &Primvar) -> Primvar {
        let mut fine = primvar.clone();
        if !(1..=4).contains(&primvar.components) {
            return fine;
        }
        for level in &self.levels {
            let stencils = match primvar.interpolation {
                Interpolation::Constant | Interpolation::Uniform => return fine,
                Interpolation::Varying => &level.linear,
                Interpolation::Vertex => &level.smooth,
                Interpolation::FaceVarying => &level.corner,
            };
            fine.values = stencils.values(&fine.values, primvar.components);
        }
        fine
    }
}

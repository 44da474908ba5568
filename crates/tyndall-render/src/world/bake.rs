//! Procedural media as grids: a program sampled over a box, once, when the world is built.
//!
//! # Why a grid, and not the program in the walk
//!
//! A walk needs bounds of the density that hold everywhere. Interval arithmetic on octaves of noise gives bounds several
//! times too large, sampled maxima give wrong ones; and an octave costs about as much as a look-up in a grid, of which
//! walks make many at every point. So the medium is trilinear between samples. How many there are follows from the
//! program itself (`BakeSource::cells_along`): along each axis cells are halved until interpolation is wrong by less than
//! [`TOLERANCE`] of the mean, or the setting `proceduralResolution` is reached.

mod layers;

#[cfg(test)]
mod tests;

pub(super) use layers::Layer;

use glam::{DAffine3, DVec3, Vec3A};
use layers::{Proposal, Voxels};
use rayon::prelude::*;
use std::sync::Arc;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;
use tyndall_shading::{PointCoefficients, ShadingContext, Space, VolumeProgram};
use tyndall_volume::{BrickGrid, ColorGrid};

/// Mean absolute error of interpolation along one axis, over the mean. Errors have both signs: means are off by far less.
const TOLERANCE: f64 = 0.04;
/// Points at which a program is tried.
const PROBES: u32 = 1024;
/// Fewest cells along an axis.
const LEAST_CELLS: u32 = 8;
/// Most voxels of a box: 64 MiB of numbers.
const MOST_VOXELS: f64 = (1u64 << 24) as f64;
/// A field of the volume that a program reads.
#[derive(Clone, PartialEq)]
pub(super) struct FieldSampler {
    pub(super) voxels: FieldVoxels,
    pub(super) index_from_object: DAffine3,
}

/// The values of a field.
#[derive(Clone)]
pub(super) enum FieldVoxels {
    Numbers(Arc<BrickGrid>),
    Colors(Arc<ColorGrid>),
}

impl PartialEq for FieldVoxels {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Numbers(a), Self::Numbers(b)) => Arc::ptr_eq(a, b),
            (Self::Colors(a), Self::Colors(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// What is sampled, and where.
#[derive(Clone, PartialEq)]
pub(super) struct BakeSource {
    pub(super) program: Arc<VolumeProgram>,
    /// The object's bounding box, which is sampled.
    pub(super) min: DVec3,
    pub(super) max: DVec3,
    /// Identity if the program does not read it.
    pub(super) world_from_object: DAffine3,
    /// Of each field that the program reads; `None` if the volume has none of that name.
    pub(super) fields: Vec<Option<FieldSampler>>,
    /// Fewest cells along each axis, at least 1.
    pub(super) least_cells: [u32; 3],
    /// Most cells along an axis.
    pub(super) resolution: u32,
}

/// A medium in grids, to be added up.
pub(super) struct Baked {
    pub(super) layers: Vec<Layer>,
    pub(super) object_from_index: DAffine3,
    /// Estimated error of interpolation, over the mean.
    pub(super) error: f64,
}

type Outputs = [Rgb; 3];

fn outputs(found: PointCoefficients) -> Outputs {
    [found.sigma_a, found.sigma_s, found.emission]
}

/// A point of the object.
struct Point<'a> {
    source: &'a BakeSource,
    position: DVec3,
}

impl ShadingContext for Point<'_> {
    fn primvar(&self, _: usize) -> Option<[f32; 4]> {
        None
    }

    fn position(&self, space: Space) -> Vec3A {
        let source = self.source;
        let position = match space {
            Space::Object => self.position,
            Space::World => source.world_from_object.transform_point3(self.position),
            Space::Box => {
                let size = source.max - source.min;
                let share = (self.position - source.min) / size;
                DVec3::select(size.cmpgt(DVec3::ZERO), share, DVec3::ZERO)
            }
        };
        position.as_vec3a()
    }

    fn field(&self, slot: usize) -> Option<[f32; 4]> {
        let FieldSampler { voxels, index_from_object } = self.source.fields.get(slot)?.as_ref()?;
        let p_index = index_from_object.transform_point3(self.position).as_vec3a();
        Some(match voxels {
            FieldVoxels::Numbers(grid) => [grid.density(p_index); 4],
            FieldVoxels::Colors(grid) => {
                let [r, g, b] = grid.color(p_index).to_array();
                [r, g, b, 1.0]
            }
        })
    }
}

impl BakeSource {
    fn at(&self, position: DVec3) -> Outputs {
        outputs(self.program.evaluate(&Point { source: self, position }))
    }

    fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The mean over the box, for media that cannot be sampled.
    pub(super) fn mean(&self) -> PointCoefficients {
        let probes = self.probes();
        let mean = |output: usize| probes.iter().map(|(_, found)| found[output]).sum::<Rgb>() / PROBES as f32;
        PointCoefficients { sigma_a: mean(0), sigma_s: mean(1), emission: mean(2) }
    }

    /// Random points of the box, always the same, and what is there.
    fn probes(&self) -> Vec<(DVec3, Outputs)> {
        let mut rng = Pcg::new(&[0]);
        let mut number = || f64::from(rng.next_f32());
        let points: Vec<_> =
            (0..PROBES).map(|_| self.min + self.size() * DVec3::new(number(), number(), number())).collect();
        points.into_par_iter().map(|point| (point, self.at(point))).collect()
    }

    /// Samples the program.
    pub(super) fn bake(&self) -> Baked {
        let probes = self.probes();
        let (cells, error) = self.cells(&probes);
        let steps = DVec3::from_array(std::array::from_fn(|axis| self.size()[axis] / f64::from(cells[axis])));
        let object_from_index = DAffine3::from_translation(self.min) * DAffine3::from_scale(steps);
        let voxels = Voxels { source: self, object_from_index, cells };
        let values: Vec<Outputs> = probes.iter().map(|(_, found)| *found).collect();
        let layers = voxels
            .layers(&Proposal::of(&values))
            .or_else(|| voxels.layers(&Proposal::cautious()))
            .unwrap_or_default();
        Baked { layers, object_from_index, error }
    }

    /// Cells along each axis, and the largest error of interpolation along one.
    fn cells(&self, probes: &[(DVec3, Outputs)]) -> ([u32; 3], f64) {
        let found: Vec<_> = (0..3).map(|axis| self.cells_along(axis, probes)).collect();
        let cells: [u32; 3] = std::array::from_fn(|axis| found[axis].0);
        let voxels: f64 = cells.iter().map(|&n| f64::from(n)).product();
        let error = found.iter().map(|(_, error)| *error).fold(0.0, f64::max);
        if voxels <= MOST_VOXELS {
            return (cells, error);
        }
        let factor = (MOST_VOXELS / voxels).cbrt();
        let fewer = cells.map(|n| ((f64::from(n) * factor) as u32).max(LEAST_CELLS));
        (fewer, error / factor)
    }

    /// The fewest cells along an axis between which interpolation is good enough, and its error.
    fn cells_along(&self, axis: usize, probes: &[(DVec3, Outputs)]) -> (u32, f64) {
        let size = self.size()[axis];
        if size <= 0.0 {
            return (1, 0.0);
        }
        let mut cells = self.least_cells[axis];
        while cells < LEAST_CELLS {
            cells *= 2;
        }
        loop {
            let error = self.interpolation_error(axis, size / f64::from(cells), probes);
            // Halved, so that the voxels of a field stay where they are.
            if error <= TOLERANCE || 2 * cells > self.resolution {
                return (cells, error);
            }
            cells *= 2;
        }
    }

    /// Mean absolute error of interpolation between points `step` apart, over the mean: of extinction or emission,
    /// whichever is worse.
    fn interpolation_error(&self, axis: usize, step: f64, probes: &[(DVec3, Outputs)]) -> f64 {
        let along = DVec3::AXES[axis] * step;
        let differences: Vec<[f64; 4]> = probes
            .par_iter()
            .map(|(point, found)| {
                let t = ((point[axis] - self.min[axis]) / step).fract();
                let (a, b) = (self.at(*point - along * t), self.at(*point + along * (1.0 - t)));
                let wrong = |output: usize| {
                    let between = a[output] + (b[output] - a[output]) * t as f32;
                    f64::from((between - found[output]).abs().element_sum())
                };
                let whole = |output: usize| f64::from(found[output].element_sum());
                [wrong(0) + wrong(1), whole(0) + whole(1), wrong(2), whole(2)]
            })
            .collect();
        let sum = |i: usize| differences.iter().map(|d| d[i]).sum::<f64>();
        let share = |wrong: f64, whole: f64| if whole > 0.0 { wrong / whole } else { 0.0 };
        share(sum(0), sum(1)).max(share(sum(2), sum(3)))
    }
}

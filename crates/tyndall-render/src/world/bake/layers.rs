//! Sampled coefficients in as few grids as they need.
//!
//! Coefficients that are everywhere in the same proportion, such as those of a density times a colour, are one grid of
//! numbers. Others are grids of colours. Which it is, samples at random points propose; a voxel that contradicts makes
//! the proposal wrong, and the box is sampled again without it.

use super::{BakeSource, Outputs};
use glam::{DAffine3, IVec3};
use rayon::prelude::*;
use std::sync::Arc;
use tyndall_math::Rgb;
use tyndall_volume::{BrickGrid, ColorGrid, SparseVoxels};

/// Proportions that differ by less come from rounding.
const SAME: f32 = 1e-4;

/// A part of a medium.
pub(in crate::world) struct Layer {
    /// Absorption, scattering and emission where the density is 1; or, with colours, which of these they are.
    pub(in crate::world) ratio: [Rgb; 3],
    pub(in crate::world) density: Arc<BrickGrid>,
    pub(in crate::world) colors: Option<Arc<ColorGrid>>,
}

/// A group of outputs in one grid.
#[derive(Debug, Clone, Copy)]
enum Grouping {
    /// Everywhere in this proportion; the largest of all is 1.
    Proportional { members: [bool; 3], ratio: [Rgb; 3] },
    /// One output with colours.
    Colors(usize),
}

/// How the outputs are grouped.
pub(super) struct Proposal(Vec<Grouping>);

impl Proposal {
    /// What is always right.
    pub(super) fn cautious() -> Self {
        Self((0..3).map(Grouping::Colors).collect())
    }

    /// As few grids as the values allow.
    pub(super) fn of(values: &[Outputs]) -> Self {
        const ALL: [bool; 3] = [true; 3];
        const EXTINCTION: [bool; 3] = [true, true, false];
        let proportional = |members: [bool; 3]| Grouping::proportional(members, values);
        if let Some(all) = proportional(ALL) {
            return Self(vec![all]);
        }
        let alone = |output: usize| {
            let members = std::array::from_fn(|i| i == output);
            proportional(members).unwrap_or(Grouping::Colors(output))
        };
        let mut groups = match proportional(EXTINCTION) {
            Some(extinction) => vec![extinction],
            None => vec![alone(0), alone(1)],
        };
        groups.push(alone(2));
        Self(groups)
    }
}

impl Grouping {
    fn proportional(members: [bool; 3], values: &[Outputs]) -> Option<Self> {
        let most = values.iter().max_by(|a, b| largest(members, a).total_cmp(&largest(members, b)))?;
        let density = largest(members, most);
        let ratio = std::array::from_fn(|i| match members[i] && density > 0.0 {
            true => most[i] / density,
            false => Rgb::ZERO,
        });
        let group = Self::Proportional { members, ratio };
        values.iter().all(|found| group.holds(found)).then_some(group)
    }

    /// Whether the values of a voxel fit.
    fn holds(&self, found: &Outputs) -> bool {
        let Self::Proportional { members, ratio } = self else { return true };
        let density = largest(*members, found);
        let fits = |i: usize| (found[i] - ratio[i] * density).abs().max_element() <= SAME * density;
        (0..3).all(|i| !members[i] || fits(i))
    }

    /// What is kept of the values of a leaf.
    fn kept(&self, found: &[Outputs]) -> Values {
        match self {
            Self::Proportional { members, .. } => {
                Values::Numbers(found.iter().map(|found| largest(*members, found)).collect())
            }
            Self::Colors(output) => {
                Values::Colors(found.iter().map(|found| found[*output].to_array()).collect())
            }
        }
    }
}

/// The largest component of some of the outputs.
fn largest(members: [bool; 3], found: &Outputs) -> f32 {
    (0..3).filter(|&i| members[i]).map(|i| found[i].max_element()).fold(0.0, f32::max)
}

/// The voxels of a box.
pub(super) struct Voxels<'a> {
    pub(super) source: &'a BakeSource,
    pub(super) object_from_index: DAffine3,
    pub(super) cells: [u32; 3],
}

/// A leaf of 8^3 voxels.
struct Leaf {
    origin: [i32; 3],
    /// One list for each group.
    values: Vec<Values>,
}

/// The voxels of a leaf.
enum Values {
    Numbers(Vec<f32>),
    Colors(Vec<[f32; 3]>),
}

impl Voxels<'_> {
    /// The grids of a proposal; `None` if a voxel contradicts it.
    pub(super) fn layers(&self, proposal: &Proposal) -> Option<Vec<Layer>> {
        let groups = &proposal.0;
        let leaves_along = self.cells.map(|n| (n + 1).div_ceil(8));
        let [_, ny, nz] = leaves_along;
        let n_leaves: u32 = leaves_along.iter().product();
        let leaves: Option<Vec<Leaf>> = (0..n_leaves)
            .into_par_iter()
            .map(|i| self.leaf([i / (ny * nz), i / nz % ny, i % nz].map(|c| 8 * c as i32), groups))
            .collect();
        let leaves = leaves?;
        let layers = groups.iter().enumerate().map(|(i, group)| layer(group, i, &leaves));
        Some(layers.filter(|layer| !layer.density.is_empty()).collect())
    }

    /// Voxels beyond the box are 0.
    fn leaf(&self, origin: [i32; 3], groups: &[Grouping]) -> Option<Leaf> {
        let last = IVec3::from(self.cells.map(|n| n as i32));
        let values: Vec<Outputs> = (0..512)
            .map(|i| IVec3::from(origin) + IVec3::new(i >> 6, i >> 3 & 7, i & 7))
            .map(|voxel| match voxel.cmple(last).all() {
                true => self.source.at(self.object_from_index.transform_point3(voxel.as_dvec3())),
                false => [Rgb::ZERO; 3],
            })
            .collect();
        let fits = values.iter().all(|found| groups.iter().all(|group| group.holds(found)));
        fits.then(|| Leaf { origin, values: groups.iter().map(|group| group.kept(&values)).collect() })
    }
}

fn layer(group: &Grouping, index: usize, leaves: &[Leaf]) -> Layer {
    let numbers = || {
        leaves.iter().filter_map(|leaf| match &leaf.values[index] {
            Values::Numbers(values) => Some((leaf.origin, values.as_slice())),
            Values::Colors(_) => None,
        })
    };
    let colors = || {
        leaves.iter().filter_map(|leaf| match &leaf.values[index] {
            Values::Numbers(_) => None,
            Values::Colors(values) => Some((leaf.origin, values.as_slice())),
        })
    };
    match group {
        Grouping::Proportional { ratio, .. } => {
            let (density, _) = BrickGrid::build(&voxels(numbers().collect()));
            Layer { ratio: *ratio, density: Arc::new(density), colors: None }
        }
        Grouping::Colors(output) => {
            let brightest = |values: &[[f32; 3]]| values.iter().map(|[r, g, b]| r.max(*g).max(*b)).collect();
            let bright: Vec<(_, Vec<f32>)> =
                colors().map(|(origin, values)| (origin, brightest(values))).collect();
            let bright = bright.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
            let (density, _) = BrickGrid::build(&voxels(bright));
            let (colors, _) = ColorGrid::build(&voxels(colors().collect()));
            let ratio = std::array::from_fn(|i| if i == *output { Rgb::ONE } else { Rgb::ZERO });
            Layer { ratio, density: Arc::new(density), colors: Some(Arc::new(colors)) }
        }
    }
}

fn voxels<T: Default>(leaves: Vec<([i32; 3], &[T])>) -> SparseVoxels<'_, T> {
    SparseVoxels { leaves, tiles: Vec::new(), background: T::default() }
}

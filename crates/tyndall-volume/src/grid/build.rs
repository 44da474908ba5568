//! From leaves and tiles to bricks with bounds.

use super::list::VoxelLists;
use super::pool::{Pool, is_half_exact};
use super::report::Reading;
use super::{
    BRICK_EDGE, BRICK_VOXELS, Brick, BrickGrid, FlatTable, GridReport, MAX_COORDINATE, SparseVoxels, Table,
    TreeTable, offset,
};
use glam::IVec3;
use rayon::prelude::*;

/// A box of this many bricks may always be a flat table (16 bytes each).
const FLAT_ALWAYS: i128 = 1 << 16;
/// A larger one if at least one brick in this many is active.
const FLAT_FILL: i128 = 16;
/// Bricks, 256 MiB of them as f32, from which on values that half floats hold exactly are stored as such.
const HALF_FROM: usize = 1 << 17;

/// A cube of voxels: a leaf or a tile.
pub(super) struct Source {
    pub(super) lo: IVec3,
    pub(super) edge: i32,
    pub(super) brick: Brick,
    /// Indexed by a set of axes: extrema over the voxels whose coordinate is the lowest along those axes.
    /// They are what the cells below this source along those axes interpolate to.
    pub(super) extrema: [Extrema; 8],
    /// Lowest and highest non-zero voxel.
    support: [IVec3; 2],
}

/// Smallest and largest of some values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extrema {
    pub(super) min: f32,
    pub(super) max: f32,
}

impl Extrema {
    pub(super) const ZERO: Self = Self { min: 0.0, max: 0.0 };
    const NOTHING: Self = Self { min: f32::INFINITY, max: 0.0 };

    pub(super) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

/// The unit step of a set of axes, bit 2 = x, bit 1 = y, bit 0 = z.
pub(super) fn axes(set: usize) -> IVec3 {
    IVec3::new(set as i32 >> 2, set as i32 >> 1 & 1, set as i32 & 1)
}

/// The values of a leaf.
pub(super) type Values<T> = [T; BRICK_VOXELS];

impl BrickGrid {
    /// Builds the grid. Values that are no densities read as 0 and are counted, see [`GridReport`].
    pub fn build(voxels: &SparseVoxels<'_>) -> (Self, GridReport) {
        Self::build_as(voxels, Reading::Density)
    }

    /// Builds the interior of a level set (signed distance, negative inside): density is 1 inside and 0 outside, and
    /// falls from one to the other over one voxel, linearly across the surface. Tiles and inactive voxels must be
    /// given where they are inside. `voxel_size` is in the unit of the distances.
    pub fn build_interior(voxels: &SparseVoxels<'_>, voxel_size: f32) -> (Self, GridReport) {
        let per_voxel = voxel_size.recip();
        // Without a usable size the surface is a step.
        let per_voxel = if per_voxel > 0.0 && per_voxel.is_finite() { per_voxel } else { f32::MAX };
        Self::build_as(voxels, Reading::Interior { per_voxel })
    }

    fn build_as(voxels: &SparseVoxels<'_>, reading: Reading) -> (Self, GridReport) {
        // Leaves are read twice, so that none is ever held in a copy of its own next to the pool.
        let scans: Vec<_> = voxels
            .leaves
            .par_iter()
            .filter_map(|&(origin, values)| scan_leaf(origin, values, reading))
            .collect();
        let mut report = GridReport {
            nonzero_background: GridReport::default().read(reading, voxels.background) != 0.0
                || (reading == Reading::Density && voxels.background != 0.0),
            dropped_count: (voxels.leaves.len() - scans.len()) as u64,
            ..Default::default()
        };
        let (mut sources, mut stored) = (Vec::with_capacity(scans.len()), Vec::new());
        let mut is_half = true;
        for Scan { source, values, is_half: is_leaf_half, report: found } in scans {
            report = report.merge(found);
            if source.extrema[0].max > 0.0 {
                if let Some(values) = values {
                    stored.push((sources.len(), values));
                    is_half &= is_leaf_half;
                }
                sources.push(source);
            }
        }
        for &(origin, edge, value) in &voxels.tiles {
            let value = report.read(reading, value);
            add_tile(origin, edge, Brick::uniform(value), value, &mut sources, &mut report);
        }
        report.brick_count = stored.len() as u64;
        report.is_sparse = is_mostly_empty(&sources);
        let pool = place_values(&stored, reading, is_half, report.is_sparse, &mut sources);
        let max = sources.iter().fold(0f32, |m, source| m.max(source.extrema[0].max));
        let (table, cells) = build_table(&sources);
        (Self { table, pool, cells, max }, report)
    }
}

/// What a parallel scan finds in a leaf.
struct Scan<'a> {
    source: Source,
    /// The leaf, if its values differ.
    values: Option<&'a Values<f32>>,
    /// Half floats hold its values exactly.
    is_half: bool,
    report: GridReport,
}

/// Measures a leaf; `None` if it is malformed.
fn scan_leaf(origin: [i32; 3], values: &[f32], reading: Reading) -> Option<Scan<'_>> {
    let (lo, values) = well_formed(origin, values)?;
    let mut report = GridReport::default();
    let clean = values.map(|value| report.read(reading, value));
    let source = Source::of_leaf(lo, &clean);
    let is_uniform = clean.iter().all(|&value| value == clean[0]);
    let is_half = clean.iter().all(|&value| is_half_exact(value));
    Some(Scan { source, values: (!is_uniform).then_some(values), is_half, report })
}

/// A leaf's place and values, if they can be used.
pub(super) fn well_formed<T>(origin: [i32; 3], values: &[T]) -> Option<(IVec3, &Values<T>)> {
    let lo = IVec3::from_array(origin);
    let values = values.try_into().ok()?;
    is_placed(lo, BRICK_EDGE).then_some((lo, values))
}

/// Stores leaves and tells their sources, of which the indices are given, where. Under a tree, leaves with few voxels
/// become lists.
fn place_values(
    stored: &[(usize, &Values<f32>)],
    reading: Reading,
    is_half: bool,
    is_sparse: bool,
    sources: &mut [Source],
) -> Pool {
    let (mut lists, mut whole) = (VoxelLists::default(), Vec::with_capacity(stored.len()));
    // Counted by the scan.
    let clean = |values: &Values<f32>| values.map(|value| GridReport::default().read(reading, value));
    for &(source, values) in stored {
        let listed = if is_sparse { lists.add(&clean(values)) } else { None };
        sources[source].brick = listed.unwrap_or_else(|| {
            whole.push(values);
            Brick { data: whole.len() as u32 - 1, value: 0.0 }
        });
    }
    lists.shrink();
    let is_half = is_half && whole.len() >= HALF_FROM;
    Pool::fill(&whole, is_half, lists, |values, brick| *brick = clean(values))
}

impl Source {
    /// The source of a leaf of clean values, as if uniform: its brick has the first value.
    pub(super) fn of_leaf(lo: IVec3, clean: &Values<f32>) -> Self {
        let first = clean[0];
        let is_uniform = clean.iter().all(|&value| value == first);
        let extrema = if is_uniform { [Extrema { min: first, max: first }; 8] } else { extrema_of(clean) };
        let support = if is_uniform { [lo, lo + 7] } else { support_of(lo, clean) };
        Self { lo, edge: BRICK_EDGE, brick: Brick::uniform(first), extrema, support }
    }
}

/// Adds a tile of clean `value`, cut into pieces of node size that all are `brick`.
pub(super) fn add_tile(
    origin: [i32; 3],
    edge: u32,
    brick: Brick,
    value: f32,
    sources: &mut Vec<Source>,
    report: &mut GridReport,
) {
    let (lo, edge) = (IVec3::from_array(origin), i32::try_from(edge).unwrap_or(0));
    let fits = |piece: i32| edge % piece == 0 && (lo % piece) == IVec3::ZERO;
    let Some(piece) = [4096, 128, 8].into_iter().find(|&p| edge > 0 && fits(p)) else {
        report.dropped_count += 1;
        return;
    };
    let n = edge / piece;
    if !is_placed(lo, edge) || i128::from(n).pow(3) > 1 << 20 {
        report.dropped_count += 1;
        return;
    }
    let n_pieces = if value > 0.0 { n * n * n } else { 0 };
    for i in 0..n_pieces {
        let lo = lo + IVec3::new(i / (n * n), i / n % n, i % n) * piece;
        sources.push(Source {
            lo,
            edge: piece,
            brick,
            extrema: [Extrema { min: value, max: value }; 8],
            support: [lo, lo + (piece - 1)],
        });
    }
}

/// Aligned to bricks and inside the coordinates we compute with.
fn is_placed(lo: IVec3, edge: i32) -> bool {
    (lo & 7i32) == IVec3::ZERO
        && lo.cmpge(IVec3::splat(-MAX_COORDINATE)).all()
        && lo.cmple(IVec3::splat(MAX_COORDINATE.saturating_sub(edge))).all()
}

fn extrema_of(values: &[f32]) -> [Extrema; 8] {
    let mut extrema = [Extrema::NOTHING; 8];
    for (i, &value) in values.iter().enumerate() {
        let lowest =
            usize::from(i >> 6 == 0) << 2 | usize::from(i >> 3 & 7 == 0) << 1 | usize::from(i & 7 == 0);
        let here = Extrema { min: value, max: value };
        let touched = extrema.iter_mut().enumerate().filter(|(set, _)| set & lowest == *set);
        touched.for_each(|(_, of_set)| *of_set = of_set.union(here));
    }
    extrema
}

fn support_of(lo: IVec3, values: &[f32]) -> [IVec3; 2] {
    let (mut first, mut last) = (IVec3::splat(7), IVec3::ZERO);
    for (i, _) in values.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        let local = IVec3::new(i as i32 >> 6, i as i32 >> 3 & 7, i as i32 & 7);
        debug_assert_eq!(offset(local), i);
        (first, last) = (first.min(local), last.max(local));
    }
    [lo + first, lo + last]
}

/// The table of non-zero `sources`, and the first and last cell that they reach.
pub(super) fn build_table(sources: &[Source]) -> (Table, Option<[IVec3; 2]>) {
    let cells = active_cells(sources);
    let table = match cells {
        None => Table::Flat(FlatTable::default()),
        Some(_) if is_mostly_empty(sources) => Table::Tree(TreeTable::build(sources)),
        Some([lo, hi]) => Table::Flat(FlatTable::build(sources, lo >> 3i32, hi >> 3i32)),
    };
    (table, cells)
}

fn active_cells(sources: &[Source]) -> Option<[IVec3; 2]> {
    let support = sources.iter().map(|s| s.support).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    support.map(|[lo, hi]| [lo - 1, hi])
}

/// Whether the box around `sources` has too few of them for a flat table.
fn is_mostly_empty(sources: &[Source]) -> bool {
    let Some([lo, hi]) = active_cells(sources) else { return false };
    let size = (hi >> 3i32).as_i64vec3() - (lo >> 3i32).as_i64vec3() + 1;
    let volume = i128::from(size.x) * i128::from(size.y) * i128::from(size.z);
    let active: i128 = sources.iter().map(|s| i128::from(s.edge / BRICK_EDGE).pow(3)).sum();
    volume > FLAT_ALWAYS && (volume > FLAT_FILL * active || volume > 1 << 28)
}

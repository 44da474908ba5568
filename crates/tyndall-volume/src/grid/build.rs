//! From leaves and tiles to bricks with bounds.

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

/// One leaf's values made fit: what a parallel scan returns.
struct Scan {
    values: Option<Box<[f32]>>,
    source: Source,
    report: GridReport,
}

impl BrickGrid {
    /// Builds the grid. Values that are no densities read as 0 and are counted, see [`GridReport`].
    pub fn build(voxels: &SparseVoxels<'_>) -> (Self, GridReport) {
        let scans: Vec<Scan> =
            voxels.leaves.par_iter().filter_map(|leaf| scan_leaf(leaf.0, leaf.1)).collect();
        let mut report = GridReport { nonzero_background: voxels.background != 0.0, ..Default::default() };
        report.dropped_count = (voxels.leaves.len() - scans.len()) as u64;

        // Give every brick with values of its own a place in the pool.
        let n_bricks = scans.iter().filter(|scan| scan.values.is_some()).count();
        let mut pool = Vec::with_capacity(n_bricks * BRICK_VOXELS);
        let mut sources = Vec::with_capacity(scans.len() + voxels.tiles.len());
        for mut scan in scans {
            report = report.merge(scan.report);
            if let Some(values) = scan.values {
                scan.source.brick.data = (pool.len() / BRICK_VOXELS) as u32;
                pool.extend_from_slice(&values);
            }
            sources.push(scan.source);
        }
        for &(origin, edge, value) in &voxels.tiles {
            add_tile(origin, edge, value, &mut sources, &mut report);
        }
        sources.retain(|source| source.extrema[0].max > 0.0);
        report.brick_count = n_bricks as u64;

        let max = sources.iter().fold(0f32, |m, source| m.max(source.extrema[0].max));
        let support = sources.iter().map(|s| s.support).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let cells = support.map(|[lo, hi]| [lo - 1, hi]);
        let table = build_table(&sources, cells);
        report.is_sparse = matches!(table, Table::Tree(_));
        (Self { table, pool, cells, max }, report)
    }
}

/// Cleans and measures a leaf; `None` if it is malformed.
fn scan_leaf(origin: [i32; 3], values: &[f32]) -> Option<Scan> {
    let lo = IVec3::from_array(origin);
    if values.len() != BRICK_VOXELS || !is_placed(lo, BRICK_EDGE) {
        return None;
    }
    let mut report = GridReport::default();
    let clean: Box<[f32]> = values.iter().map(|&value| report.clean(value)).collect();
    let first = clean[0];
    let is_uniform = clean.iter().all(|&value| value == first);
    let extrema = if is_uniform { [Extrema { min: first, max: first }; 8] } else { extrema_of(&clean) };
    let support = if is_uniform { [lo, lo + 7] } else { support_of(lo, &clean) };
    let source = Source { lo, edge: BRICK_EDGE, brick: Brick::uniform(first), extrema, support };
    Some(Scan { values: (!is_uniform).then_some(clean), source, report })
}

/// Adds a tile, cut into pieces of node size.
fn add_tile(origin: [i32; 3], edge: u32, value: f32, sources: &mut Vec<Source>, report: &mut GridReport) {
    let (lo, edge) = (IVec3::from_array(origin), i32::try_from(edge).unwrap_or(0));
    let value = report.clean(value);
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
    for i in 0..n * n * n {
        let lo = lo + IVec3::new(i / (n * n), i / n % n, i % n) * piece;
        sources.push(Source {
            lo,
            edge: piece,
            brick: Brick::uniform(value),
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

fn build_table(sources: &[Source], cells: Option<[IVec3; 2]>) -> Table {
    let Some([lo, hi]) = cells else { return Table::Flat(FlatTable::default()) };
    let (lo, hi) = (lo >> 3i32, hi >> 3i32);
    let size = hi.as_i64vec3() - lo.as_i64vec3() + 1;
    let volume = i128::from(size.x) * i128::from(size.y) * i128::from(size.z);
    let active: i128 = sources.iter().map(|s| i128::from(s.edge / BRICK_EDGE).pow(3)).sum();
    if volume <= FLAT_ALWAYS || (volume <= FLAT_FILL * active && volume <= 1 << 28) {
        Table::Flat(FlatTable::build(sources, lo, hi))
    } else {
        Table::Tree(TreeTable::build(sources))
    }
}

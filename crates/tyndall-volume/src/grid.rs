//! Sparse density grids made of 8^3 bricks.
//!
//! Voxel centres sit at integer index coordinates, density is trilinear in between and 0 outside the active voxels.
//! The *cell* of brick b are the points p with floor(p / 8) = b; its interpolation footprint is the voxels 8b to 8b + 8
//! along each axis. Every cell carries the maximum (the majorant of null-collision methods) and minimum over its
//! footprint, so bounds hold exactly at cell faces too.
//!
//! The top level is a flat table over the bounding box in bricks: the fastest of the layouts measured (hash map of
//! leaves, 5-4-3 tree, flat table with and without apron). If the box is mostly empty the same interface is served by
//! hash maps on levels of growing node size. Either way a ray crosses empty space in cubes much larger than a brick:
//! empty entries of the table know how many cells around them are empty too, empty coarse nodes are skipped whole.
//! Over a flat table lie the bounds of cubes of 4^3, 16^3, ... bricks: a ray crosses those at once where looser bounds
//! cost next to nothing, see [`crate::majorant`].
//!
//! # Why bricks are 8^3 f32, read exactly
//!
//! `benches/grids.rs` looks up a ball of noise with holes in twins of these layouts, in turns. Medians of the ratios
//! to the present layout (below 1 is faster), at random points / along rays:
//!
//! | layout | bytes a brick | 128^3 | 256^3 | 512^3 |
//! |---|---|---|---|---|
//! | f32, 8^3 | 2048 | 1 / 1 | 1 / 1 | 1 / 1 |
//! | f32, 9^3 (upper apron) | 2916 | 0.70 / 0.76 | 0.77 / 0.71 | 0.74 / 0.72 |
//! | f32, 10^3 (both aprons) | 4000 | 0.75 / 0.78 | 0.74 / 0.73 | 0.79 / 0.69 |
//! | f16, 8^3 | 1024 | 0.96 / 1.07 | 1.13 / 1.09 | 1.08 / 1.02 |
//! | f16, 9^3 | 1458 | 0.91 / 0.99 | 1.05 / 1.13 | 0.87 / 0.96 |
//! | f32, 8^3, one-tap stochastic | 2048 | 0.57 / 0.64 | 0.50 / 0.55 | 0.47 / 0.48 |
//! | f16, 8^3, one-tap stochastic | 1024 | 0.61 / 0.60 | 0.55 / 0.54 | 0.42 / 0.48 |
//!
//! A second run on a busier machine: 9^3 0.83 to 1.01, f16 0.82 to 1.07, one tap 0.46 to 0.60.
//!
//! - An apron saves up to 30 % of a look-up but needs at least 1.42 times the memory, and a brick of its own below
//!   every surface: 3.7 to 4.9 KB per active brick of this cloud. More than 1.3 times the decoded bricks is too much
//!   for what walks gain: they make 0.06 to 4 look-ups, next to some 30 steps between cells.
//! - Half floats save memory, not time, see below.
//! - One tap (reading a single corner, chosen with its trilinear weight) halves a look-up and is unbiased, as
//!   estimators are linear in each density. It adds variance to shadow rays and needs a random number in every
//!   look-up; it would save a few per cent of a walk. Not done.
//!
//! A build holds at most 1.11 times the decoded active bricks of the 512^3 cloud beyond its input, the result 1.02.
//!
//! # Large grids of half floats
//!
//! Grids of 2^17 bricks and more, 256 MiB as f32, whose values are all exact as half floats (those of files saved so) are
//! stored as such: 2.03 bytes a voxel of a full grid, 2.4 at the peak of its build. `benches/grids.rs` compares the same
//! cloud stored both ways, at optical depth 5; time as the ratio to f32, medians of two runs on a busy machine:
//!
//! | voxels | f32, MiB | half, MiB | random points | along rays | walk | shadow ray |
//! |---|---|---|---|---|---|---|
//! | 64^3 | 0.7 | 0.3 | 1.02, 1.00 | 1.24, 1.27 | 0.99, 0.93 | 1.01, 0.92 |
//! | 128^3 | 3.3 | 1.7 | 0.90, 0.98 | 0.87, 1.26 | 1.00, 0.92 | 0.96, 1.03 |
//! | 256^3 | 23 | 12 | 1.04, 1.19 | 0.93, 0.91 | 0.94, 0.94 | 1.02, 1.21 |
//! | 512^3 | 173 | 88 | 1.03, 0.84 | 1.11, 1.53 | 1.02, 0.99 | 1.03, 0.92 |
//! | 768^3 | 571 | 292 | 1.00 | 1.02 | 1.11 | 1.02 |
//!
//! Look-ups along rays, which find most of their bricks in the cache, pay for decoding; walks and shadow rays neither win
//! nor lose more than the noise. So there is no gain but memory, and where there is little of that to gain all is f32.
//!
//! # Scattered voxels
//!
//! 1,000 active voxels in two clusters 10^9 voxels apart cost less than 64 KiB. Scattered one to a brick they cost 75 KB:
//! under the tree, and only there, bricks of at most 16 voxels are lists, and nodes with few bricks list those. A voxel on
//! the lowest corner of its brick reaches the cells of eight bricks, each with a bound of its own: 1,000 of those cost
//! 290 KB. That there are lists and half floats costs grids without them 0.4 % of the instructions of walks and 0.5 % of
//! those of shadow rays (callgrind, the cloud of `benches/tracking.rs`).

mod build;
mod color;
mod dense;
mod flat;
mod list;
mod pool;
mod pyramid;
mod report;
mod tree;

pub use color::ColorGrid;
pub use dense::DenseGrid;
pub use report::{GridReport, SparseVoxels};

pub(crate) use pyramid::level_between;

use flat::FlatTable;
use glam::{IVec3, Vec3A};
use pool::Pool;
use tree::TreeTable;

/// Edge of a brick in voxels.
pub const BRICK_EDGE: i32 = 8;
/// Voxels of a brick.
pub const BRICK_VOXELS: usize = 512;
/// Densities above this are cut: products with coefficients stay finite.
pub const MAX_DENSITY: f32 = 1e15;
/// Index coordinates lie in ±2^30, so that cells never overflow.
pub const MAX_COORDINATE: i32 = 1 << 30;

/// Bounds are widened by the rounding of a trilinear interpolation (7 lerps).
const ROUNDING: f32 = 1.0 + 8.0 * f32::EPSILON;

/// The values of a brick: a position in the pool, one value for all, or a list of those that are not 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Brick {
    /// Index of the brick in the pool, below [`Brick::FIRST_LIST`]; that plus where a list begins; or
    /// [`Brick::UNIFORM`].
    data: u32,
    /// The value of all voxels of a uniform brick.
    value: f32,
}

impl Brick {
    const FIRST_LIST: u32 = 1 << 31;
    const UNIFORM: u32 = u32::MAX;
    pub(crate) const EMPTY: Self = Self::uniform(0.0);

    const fn uniform(value: f32) -> Self {
        Self { data: Self::UNIFORM, value }
    }
}

/// A cube of cells with bounds on the density inside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GridCell {
    /// Its lowest corner, in index coordinates.
    pub(crate) lo: IVec3,
    /// Its edge in voxels; 1, 8 or more.
    pub(crate) edge: i32,
    /// Upper bound of the density at every point of the closed cube.
    pub(crate) max: f32,
    /// Lower bound of the same.
    pub(crate) min: f32,
    /// The brick around it, where one brick holds the whole cube.
    brick: Option<Brick>,
}

impl GridCell {
    /// Whether the cell of `voxel` lies in this cube.
    #[inline]
    pub(crate) fn contains(&self, voxel: IVec3) -> bool {
        let local = voxel - self.lo;
        local.cmpge(IVec3::ZERO).all() && local.cmplt(IVec3::splat(self.edge)).all()
    }
}

#[derive(Debug)]
enum Table {
    Flat(FlatTable),
    Tree(TreeTable),
}

impl Table {
    #[inline]
    fn brick(&self, brick: IVec3) -> Brick {
        match self {
            Self::Flat(table) => table.brick(brick),
            Self::Tree(table) => table.brick(brick),
        }
    }

    fn memory_bytes(&self) -> usize {
        match self {
            Self::Flat(table) => table.memory_bytes(),
            Self::Tree(table) => table.memory_bytes(),
        }
    }
}

/// A sparse scalar field; immutable after [`BrickGrid::build`].
#[derive(Debug)]
pub struct BrickGrid {
    table: Table,
    pool: Pool,
    /// Lowest and highest cell with non-zero density, inclusive; `None` if there is none.
    cells: Option<[IVec3; 2]>,
    max: f32,
}

impl BrickGrid {
    /// Whether density is zero everywhere.
    pub fn is_empty(&self) -> bool {
        self.cells.is_none()
    }

    /// The smallest box, in index coordinates, outside which density is zero: the non-zero voxels dilated by one.
    pub fn bounds(&self) -> Option<[Vec3A; 2]> {
        self.cells.map(|[lo, hi]| [lo.as_vec3a(), (hi + IVec3::ONE).as_vec3a()])
    }

    /// Largest density.
    pub fn max_density(&self) -> f32 {
        self.max
    }

    /// Heap memory in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.table.memory_bytes() + self.pool.memory_bytes()
    }

    /// The same field without the bounds of cubes of bricks: rays visit every brick. For comparisons; it is slower.
    pub fn without_coarse_levels(mut self) -> Self {
        if let Table::Flat(table) = &mut self.table {
            table.remove_pyramid();
        }
        self
    }

    /// Trilinear density at `p_index` (voxel centres at integers); 0 outside and for NaN.
    pub fn density(&self, p_index: Vec3A) -> f32 {
        let Some([lo, hi]) = self.bounds() else { return 0.0 };
        if !(p_index.cmpge(lo).all() && p_index.cmple(hi).all()) {
            return 0.0;
        }
        let voxel = p_index.floor().as_ivec3();
        let brick = self.brick(voxel >> 3i32);
        self.trilinear(brick, voxel, p_index - voxel.as_vec3a())
    }

    /// Bounds of density over the brick cell (or larger cube) around the cell of `voxel`.
    pub fn bounds_around(&self, voxel: IVec3) -> [f32; 2] {
        let cell = self.cell(voxel);
        [cell.min, cell.max]
    }

    /// First and last cell that may be non-zero.
    #[inline]
    pub(crate) fn active_cells(&self) -> Option<[IVec3; 2]> {
        self.cells
    }

    /// Cells are bricks, or empty.
    #[inline]
    pub(crate) fn is_flat(&self) -> bool {
        matches!(self.table, Table::Flat(_))
    }

    /// The highest level that [`Self::coarse_cell`] takes, if the bounds of the first add at most `slack`, density times
    /// voxels, to those of the bricks across a typical cell that is not empty; else 0.
    #[inline]
    pub(crate) fn top_level(&self, slack: f32) -> usize {
        match &self.table {
            Table::Flat(table) => table.pyramid().top(slack),
            Table::Tree(_) => 0,
        }
    }

    /// The cell of `level`, 1 to [`Self::top_level`], around the cell of `voxel`: 4^`level` bricks wide. Also how much
    /// further its bounds lie apart than those of its bricks, on average.
    #[inline]
    pub(crate) fn coarse_cell(&self, level: usize, voxel: IVec3) -> (GridCell, f32) {
        match &self.table {
            Table::Flat(table) => table.pyramid().cell(level, voxel),
            Table::Tree(table) => (table.cell(voxel), 0.0),
        }
    }

    /// The largest known cube around the cell of `voxel` with its bounds.
    #[inline]
    pub(crate) fn cell(&self, voxel: IVec3) -> GridCell {
        match &self.table {
            Table::Flat(table) => table.cell(voxel),
            Table::Tree(table) => table.cell(voxel),
        }
    }

    /// The cell of one voxel inside `parent`, bounded by its eight corners.
    pub(crate) fn voxel_cell(&self, voxel: IVec3, parent: &GridCell) -> GridCell {
        let brick = parent.brick.unwrap_or_else(|| self.brick(voxel >> 3i32));
        let corners = self.corners(brick, voxel);
        let max = corners.iter().fold(0f32, |m, &c| m.max(c)) * ROUNDING;
        let min = corners.iter().fold(f32::INFINITY, |m, &c| m.min(c)) * (2.0 - ROUNDING);
        GridCell { lo: voxel, edge: 1, max, min, brick: Some(brick) }
    }

    /// Density at `p_index`, which is moved into `cell` if rounding put it outside: the cell's bounds hold.
    #[inline]
    pub(crate) fn density_in(&self, cell: &GridCell, p_index: Vec3A) -> f32 {
        let lo = cell.lo.as_vec3a();
        let p = p_index.clamp(lo, lo + cell.edge as f32);
        let voxel = p.floor().as_ivec3().min(cell.lo + (cell.edge - 1)).max(cell.lo);
        let brick = match cell.brick {
            Some(brick) => brick,
            None => self.brick(voxel >> 3i32),
        };
        self.trilinear(brick, voxel, (p - voxel.as_vec3a()).clamp(Vec3A::ZERO, Vec3A::ONE))
    }

    #[inline]
    fn brick(&self, brick: IVec3) -> Brick {
        self.table.brick(brick)
    }

    /// Interpolates between the eight voxels at `voxel` + {0, 1}^3; `brick` holds the lowest.
    #[inline]
    fn trilinear(&self, brick: Brick, voxel: IVec3, f: Vec3A) -> f32 {
        let c = self.corners(brick, voxel);
        let lerp = |a: f32, b: f32, f: f32| a + (b - a) * f;
        let z = [lerp(c[0], c[1], f.z), lerp(c[2], c[3], f.z), lerp(c[4], c[5], f.z), lerp(c[6], c[7], f.z)];
        lerp(lerp(z[0], z[1], f.y), lerp(z[2], z[3], f.y), f.x)
    }

    /// The eight voxels at `voxel` + {0, 1}^3, corner index x << 2 | y << 1 | z.
    #[inline]
    fn corners(&self, brick: Brick, voxel: IVec3) -> [f32; 8] {
        let local = voxel & 7i32;
        if local.max_element() == 7 {
            return self.corners_across(brick, voxel);
        }
        self.pool.corners(brick, offset(local))
    }

    /// [`BrickGrid::corners`] where they belong to two, four or eight bricks.
    #[cold]
    #[inline(never)]
    fn corners_across(&self, brick: Brick, voxel: IVec3) -> [f32; 8] {
        let Some(values) = self.pool.only_full() else { return self.rare_corners_across(brick, voxel) };
        self.gather(brick, voxel, |brick, offset| match brick.data {
            Brick::UNIFORM => brick.value,
            data => values[data as usize * BRICK_VOXELS + offset],
        })
    }

    /// The same with half floats or lists. Apart, as eight more branches would cost the common case registers.
    #[inline(never)]
    fn rare_corners_across(&self, brick: Brick, voxel: IVec3) -> [f32; 8] {
        self.gather(brick, voxel, |brick, offset| self.pool.voxel(brick, offset))
    }

    /// The corners at `voxel`, which is in `brick`, each read by `read` from a brick and an offset in it.
    #[inline(always)]
    fn gather(&self, brick: Brick, voxel: IVec3, read: impl Fn(Brick, usize) -> f32) -> [f32; 8] {
        let own = voxel >> 3i32;
        std::array::from_fn(|corner| {
            let v = voxel + IVec3::new(corner as i32 >> 2, corner as i32 >> 1 & 1, corner as i32 & 1);
            read(if v >> 3i32 == own { brick } else { self.brick(v >> 3i32) }, offset(v & 7i32))
        })
    }
}

/// Position of a voxel in its brick.
#[inline]
fn offset(local: IVec3) -> usize {
    (local.x << 6 | local.y << 3 | local.z) as usize
}

#[cfg(test)]
mod tests;

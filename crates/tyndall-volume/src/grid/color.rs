//! Colours on the bricks of a grid, for emission and scattering.

use super::build::{Source, add_tile, build_table, well_formed};
use super::{BRICK_EDGE, BRICK_VOXELS, Brick, GridReport, SparseVoxels, Table, offset};
use glam::{IVec3, Vec3A};
use rustc_hash::FxHashMap;
use tyndall_math::Rgb;

/// A sparse field of colours; immutable after [`ColorGrid::build`]. Components are non-negative and finite, and keep
/// the unit of their file.
#[derive(Debug)]
pub struct ColorGrid {
    table: Table,
    /// Bricks of 512 colours, offset x << 6 | y << 3 | z. Equal uniform bricks share one.
    pool: Vec<[f32; 3]>,
    /// Lowest and highest cell that is not black, inclusive; `None` if there is none.
    cells: Option<[IVec3; 2]>,
    max: f32,
}

impl ColorGrid {
    /// Builds the grid, e.g. from the leaves and tiles of a `tyndall_vdb::Grid<[f32; 3]>`. Components that are
    /// negative or not finite read as 0 and are counted.
    pub fn build(voxels: &SparseVoxels<'_, [f32; 3]>) -> (Self, GridReport) {
        let mut report =
            GridReport { nonzero_background: voxels.background != [0.0; 3], ..Default::default() };
        let (mut sources, mut pool) = (Vec::new(), Pool::default());
        for &(origin, values) in &voxels.leaves {
            let Some((lo, values)) = well_formed(origin, values) else {
                report.dropped_count += 1;
                continue;
            };
            let clean = values.map(|color| color.map(|component| report.clean(component)));
            let mut source = Source::of_leaf(lo, &clean.map(largest));
            if source.extrema[0].max > 0.0 {
                source.brick = pool.place(&clean);
                sources.push(source);
            }
        }
        report.brick_count = pool.colors.len() as u64 / BRICK_VOXELS as u64;
        for &(origin, edge, color) in &voxels.tiles {
            let color = color.map(|component| report.clean(component));
            let brick = pool.place_uniform(color);
            add_tile(origin, edge, brick, largest(color), &mut sources, &mut report);
        }
        pool.colors.shrink_to_fit();
        let max = sources.iter().fold(0f32, |m, source| m.max(source.extrema[0].max));
        let (table, cells) = build_table(&sources);
        report.is_sparse = matches!(table, Table::Tree(_));
        (Self { table, pool: pool.colors, cells, max }, report)
    }

    /// Whether all is black.
    pub fn is_empty(&self) -> bool {
        self.cells.is_none()
    }

    /// Largest component.
    pub fn max_component(&self) -> f32 {
        self.max
    }

    /// Trilinear colour at `p_index` (voxel centres at integers); black outside and for NaN.
    pub fn color(&self, p_index: Vec3A) -> Rgb {
        let Some([lo, hi]) = self.cells else { return Rgb::ZERO };
        let (lo, hi) = (lo.as_vec3a(), (hi + IVec3::ONE).as_vec3a());
        if !(p_index.cmpge(lo).all() && p_index.cmple(hi).all()) {
            return Rgb::ZERO;
        }
        let voxel = p_index.floor().as_ivec3();
        let f = p_index - voxel.as_vec3a();
        let c = self.corners(voxel);
        let lerp = |a: Rgb, b: Rgb, f: f32| a + (b - a) * f;
        let z = [lerp(c[0], c[1], f.z), lerp(c[2], c[3], f.z), lerp(c[4], c[5], f.z), lerp(c[6], c[7], f.z)];
        lerp(lerp(z[0], z[1], f.y), lerp(z[2], z[3], f.y), f.x)
    }

    /// Heap memory in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.table.memory_bytes() + self.pool.capacity() * size_of::<[f32; 3]>()
    }

    /// The eight voxels at `voxel` + {0, 1}^3, corner index x << 2 | y << 1 | z.
    fn corners(&self, voxel: IVec3) -> [Rgb; 8] {
        let own = voxel >> 3i32;
        let brick = self.table.brick(own);
        std::array::from_fn(|corner| {
            let v = voxel + IVec3::new(corner as i32 >> 2, corner as i32 >> 1 & 1, corner as i32 & 1);
            let brick = if v >> 3i32 == own { brick } else { self.table.brick(v >> 3i32) };
            match brick.data {
                Brick::UNIFORM => Rgb::ZERO,
                data => {
                    Rgb::from_array(self.pool[data as usize * BRICK_VOXELS + offset(v & (BRICK_EDGE - 1))])
                }
            }
        })
    }
}

/// Bounds and emptiness go by the largest component.
fn largest(color: [f32; 3]) -> f32 {
    color[0].max(color[1]).max(color[2])
}

/// Bricks being collected.
#[derive(Default)]
struct Pool {
    colors: Vec<[f32; 3]>,
    /// Where the uniform brick of a colour (its bits) is.
    uniform: FxHashMap<[u32; 3], Brick>,
}

impl Pool {
    fn place(&mut self, colors: &[[f32; 3]; BRICK_VOXELS]) -> Brick {
        if colors.iter().all(|color| *color == colors[0]) {
            return self.place_uniform(colors[0]);
        }
        self.push(colors)
    }

    /// Black is no brick.
    fn place_uniform(&mut self, color: [f32; 3]) -> Brick {
        if largest(color) <= 0.0 {
            return Brick::EMPTY;
        }
        let key = color.map(f32::to_bits);
        if let Some(&brick) = self.uniform.get(&key) {
            return brick;
        }
        let brick = self.push(&[color; BRICK_VOXELS]);
        self.uniform.insert(key, brick);
        brick
    }

    fn push(&mut self, colors: &[[f32; 3]; BRICK_VOXELS]) -> Brick {
        let data = (self.colors.len() / BRICK_VOXELS) as u32;
        self.colors.extend_from_slice(colors);
        Brick { data, value: 0.0 }
    }
}

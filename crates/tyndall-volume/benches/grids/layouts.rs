//! Table 1: how voxels are stored and interpolated.

use crate::scenes::{Leaf, cloud, random_points, ray_points};
use crate::{median, time};
use glam::{IVec3, Vec3A};
use half::f16;
use tyndall_volume::{BrickGrid, SparseVoxels};

const N_POINTS: usize = 1 << 18;
const TURNS: usize = 21;

/// A stored voxel.
trait Stored: Copy + Default {
    fn of(value: f32) -> Self;
    fn get(self) -> f32;
}

impl Stored for f32 {
    fn of(value: f32) -> Self {
        value
    }
    #[inline]
    fn get(self) -> f32 {
        self
    }
}

/// The bits of a non-negative finite half float.
#[derive(Clone, Copy, Default)]
struct Half(u16);

impl Stored for Half {
    fn of(value: f32) -> Self {
        Self(f16::from_f32(value).to_bits())
    }
    /// Rebiases the exponent; subnormals are made normal by adding and subtracting 2^-14.
    #[inline]
    fn get(self) -> f32 {
        let bits = u32::from(self.0) << 13;
        let normal = f32::from_bits(bits + (112 << 23));
        let subnormal = f32::from_bits(bits + (113 << 23)) - f32::from_bits(113 << 23);
        if bits < 1 << 23 { subnormal } else { normal }
    }
}

/// The entry of the table: as large as that of `BrickGrid`.
#[derive(Clone, Copy)]
struct Entry {
    data: u32,
    value: f32,
    _bounds: [f32; 2],
}

/// A flat table of bricks of `EDGE`^3 stored voxels, of which 8^3 are their own.
struct Bricks<T, const EDGE: usize> {
    size: i32,
    entries: Vec<Entry>,
    pool: Vec<T>,
}

impl<T: Stored, const EDGE: usize> Bricks<T, EDGE> {
    const VOXELS: usize = EDGE * EDGE * EDGE;

    fn build(edge: i32, leaves: &[Leaf]) -> Self {
        let size = edge / 8 + 1;
        let empty = Entry { data: u32::MAX, value: 0.0, _bounds: [0.0; 2] };
        let mut bricks = Self { size, entries: vec![empty; (size * size * size) as usize], pool: Vec::new() };
        let mut owner = vec![usize::MAX; bricks.entries.len()];
        for (i, (origin, _)) in leaves.iter().enumerate() {
            owner[bricks.index(IVec3::from_array(*origin) >> 3i32)] = i;
        }
        let voxel = |v: IVec3| match owner.get(bricks.index(v >> 3i32)) {
            Some(&i) if i < leaves.len() => {
                leaves[i].1[((v.x & 7) << 6 | (v.y & 7) << 3 | (v.z & 7)) as usize]
            }
            _ => 0.0,
        };
        let mut pool = Vec::with_capacity(bricks.entries.len() * Self::VOXELS);
        let mut places = Vec::new();
        // Cells below a leaf interpolate towards it: with an apron those bricks are stored too.
        let reach = if EDGE > 8 { 1 } else { 0 };
        for brick in 0..size * size * size {
            let at = IVec3::new(brick / (size * size), brick / size % size, brick % size);
            let is_near = |i: i32| owner.get(bricks.index(at + (IVec3::new(i >> 2, i >> 1, i) & 1i32)));
            let is_stored = (0..1 + 7 * reach).any(|i| is_near(i).is_some_and(|&i| i != usize::MAX));
            if !is_stored {
                continue;
            }
            places.push((brick as usize, (pool.len() / Self::VOXELS) as u32));
            for i in 0..Self::VOXELS {
                let local =
                    IVec3::new((i / (EDGE * EDGE)) as i32, (i / EDGE % EDGE) as i32, (i % EDGE) as i32);
                pool.push(T::of(voxel(at * 8 + local)));
            }
        }
        pool.shrink_to_fit();
        bricks.pool = pool;
        for (brick, data) in places {
            bricks.entries[brick].data = data;
        }
        bricks
    }

    #[inline]
    fn index(&self, brick: IVec3) -> usize {
        if brick.max_element() >= self.size {
            return usize::MAX;
        }
        ((brick.x * self.size + brick.y) * self.size + brick.z) as usize
    }

    #[inline]
    fn entry(&self, brick: IVec3) -> Entry {
        let i = brick.as_uvec3();
        if i.cmpge(glam::UVec3::splat(self.size as u32)).any() {
            return Entry { data: u32::MAX, value: 0.0, _bounds: [0.0; 2] };
        }
        self.entries[(i.x as usize * self.size as usize + i.y as usize) * self.size as usize + i.z as usize]
    }

    #[inline]
    fn fetch(&self, entry: Entry, local: IVec3) -> f32 {
        if entry.data == u32::MAX {
            return entry.value;
        }
        let at = (local.x as usize * EDGE + local.y as usize) * EDGE + local.z as usize;
        self.pool[entry.data as usize * Self::VOXELS + at].get()
    }

    #[inline]
    fn exact(&self, p: Vec3A) -> f32 {
        let voxel = p.floor().as_ivec3();
        let c = self.corners(voxel);
        let f = p - voxel.as_vec3a();
        let lerp = |a: f32, b: f32, f: f32| a + (b - a) * f;
        let z = [lerp(c[0], c[1], f.z), lerp(c[2], c[3], f.z), lerp(c[4], c[5], f.z), lerp(c[6], c[7], f.z)];
        lerp(lerp(z[0], z[1], f.y), lerp(z[2], z[3], f.y), f.x)
    }

    #[inline]
    fn corners(&self, voxel: IVec3) -> [f32; 8] {
        let (entry, local) = (self.entry(voxel >> 3i32), voxel & 7i32);
        if EDGE == 8 && local.max_element() == 7 {
            return self.corners_across(voxel);
        }
        if entry.data == u32::MAX {
            return [entry.value; 8];
        }
        let at = (local.x as usize * EDGE + local.y as usize) * EDGE + local.z as usize;
        let base = entry.data as usize * Self::VOXELS + at;
        let v = &self.pool[base..base + EDGE * EDGE + EDGE + 2];
        let (x, y) = (EDGE * EDGE, EDGE);
        [v[0], v[1], v[y], v[y + 1], v[x], v[x + 1], v[x + y], v[x + y + 1]].map(T::get)
    }

    #[cold]
    #[inline(never)]
    fn corners_across(&self, voxel: IVec3) -> [f32; 8] {
        std::array::from_fn(|i| {
            let v = voxel + IVec3::new(i as i32 >> 2, i as i32 >> 1 & 1, i as i32 & 1);
            self.fetch(self.entry(v >> 3i32), v & 7i32)
        })
    }

    /// One of the eight corners, chosen with its trilinear weight.
    #[inline]
    fn one_tap(&self, p: Vec3A, state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let bits = *state >> 1;
        let u = Vec3A::new((bits >> 42) as f32, (bits >> 21 & 0x1f_ffff) as f32, (bits & 0x1f_ffff) as f32);
        let voxel = (p + u * (1.0 / (1 << 21) as f32)).floor().as_ivec3();
        self.fetch(self.entry(voxel >> 3i32), voxel & 7i32)
    }

    fn sum_exact(&self, points: &[Vec3A]) -> f32 {
        points.iter().map(|&p| self.exact(p)).sum()
    }

    fn sum_one_tap(&self, points: &[Vec3A]) -> f32 {
        let mut state = 1;
        points.iter().map(|&p| self.one_tap(p, &mut state)).sum()
    }

    fn bytes(&self) -> usize {
        self.pool.len() * size_of::<T>()
    }
}

pub(crate) fn print_table() {
    println!("| voxels | layout | bytes per active brick | random | along rays |");
    println!("|---|---|---|---|---|");
    for edge in [128, 256, 512] {
        measure(edge);
    }
}

fn measure(edge: i32) {
    let leaves = cloud(edge);
    let borrowed = leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
    let crate_grid = BrickGrid::build(&SparseVoxels { leaves: borrowed, ..Default::default() }).0;
    let (f32_8, f32_9) = (Bricks::<f32, 8>::build(edge, &leaves), Bricks::<f32, 9>::build(edge, &leaves));
    let f32_10 = Bricks::<f32, 10>::build(edge, &leaves);
    let (f16_8, f16_9) = (Bricks::<Half, 8>::build(edge, &leaves), Bricks::<Half, 9>::build(edge, &leaves));
    type Variant<'a> = (&'a str, usize, Box<dyn Fn(&[Vec3A]) -> f32 + 'a>);
    let variants: Vec<Variant<'_>> = vec![
        ("f32, 8^3, exact", f32_8.bytes(), Box::new(|p| f32_8.sum_exact(p))),
        ("f32, 9^3, exact", f32_9.bytes(), Box::new(|p| f32_9.sum_exact(p))),
        ("f32, 10^3, exact", f32_10.bytes(), Box::new(|p| f32_10.sum_exact(p))),
        ("f16, 8^3, exact", f16_8.bytes(), Box::new(|p| f16_8.sum_exact(p))),
        ("f16, 9^3, exact", f16_9.bytes(), Box::new(|p| f16_9.sum_exact(p))),
        ("f32, 8^3, one tap", f32_8.bytes(), Box::new(|p| f32_8.sum_one_tap(p))),
        ("f16, 8^3, one tap", f16_8.bytes(), Box::new(|p| f16_8.sum_one_tap(p))),
        (
            "`BrickGrid`",
            crate_grid.memory_bytes(),
            Box::new(|p| p.iter().map(|&p| crate_grid.density(p)).sum()),
        ),
    ];
    let point_sets = [random_points(edge, N_POINTS), ray_points(edge, N_POINTS)];
    let ratios = point_sets.each_ref().map(|points| medians_of_ratios(&variants, points));
    for (i, (name, bytes, _)) in variants.iter().enumerate() {
        let [random, along] = ratios.each_ref().map(|r| &r[i]);
        println!(
            "| {edge}^3 | {name} | {} | {:.2} ({:.0} ns) | {:.2} ({:.0} ns) |",
            bytes / leaves.len().max(1),
            random.0,
            random.1,
            along.0,
            along.1
        );
    }

    /// Ratio to the first variant and nanoseconds a look-up, per variant.
    fn medians_of_ratios(variants: &[Variant<'_>], points: &[Vec3A]) -> Vec<(f64, f64)> {
        let mut times = vec![Vec::new(); variants.len()];
        for _ in 0..TURNS {
            for (times, (_, _, sum)) in times.iter_mut().zip(variants) {
                times.push(time(points.len(), || sum(points)));
            }
        }
        let ratios = |of: &[f64]| median(of.iter().zip(&times[0]).map(|(a, b)| a / b).collect());
        times.iter().map(|of| (ratios(of), median(of.clone()))).collect()
    }
}

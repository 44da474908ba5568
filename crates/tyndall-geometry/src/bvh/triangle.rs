//! The leaf test of Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1), four at a time.
//!
//! Symbols are the paper's: the ray is sheared and permuted onto +z; U, V, W are the scaled edge functions. Two
//! triangles that share an edge compute the same value for it but for the sign, so no ray passes between them.

use glam::Vec3;
use tyndall_math::Ray;

/// Triangles of a block.
pub(crate) const LANES: usize = 4;

/// Four triangles, coordinate by coordinate.
#[derive(Debug, Clone)]
#[repr(C, align(16))]
pub(crate) struct Block {
    /// Rows `3 * corner + axis`. Absent triangles are NaN: they fail every comparison.
    pub(crate) rows: [[f32; LANES]; 9],
    /// Index of each triangle in its mesh.
    pub(crate) primitive: [u32; LANES],
}

impl Block {
    pub(crate) fn empty() -> Self {
        Self { rows: [[f32::NAN; LANES]; 9], primitive: [u32::MAX; LANES] }
    }

    pub(crate) fn set(&mut self, lane: usize, corners: [Vec3; 3], primitive: u32) {
        for (corner, p) in corners.iter().enumerate() {
            for axis in 0..3 {
                self.rows[3 * corner + axis][lane] = p[axis];
            }
        }
        self.primitive[lane] = primitive;
    }

    pub(crate) fn corners(&self, lane: usize) -> [Vec3; 3] {
        std::array::from_fn(|corner| {
            Vec3::from_array(std::array::from_fn(|axis| self.rows[3 * corner + axis][lane]))
        })
    }
}

/// A ray prepared for triangle tests (the paper's section 3.1).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shear {
    /// Axes `kx, ky, kz`: z is the largest direction component, winding preserved.
    pub(crate) axes: [usize; 3],
    /// Origin, permuted.
    pub(crate) origin: [f32; 3],
    /// Shear constants `Sx, Sy, Sz`.
    pub(crate) scale: [f32; 3],
}

impl Shear {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Self {
        // Of four numbers each: three would be stored in two pieces, and a load across both waits for them.
        let [d, o, m] = [ray.direction, ray.origin, ray.direction.abs()].map(|v| v.extend(0.0).to_array());
        let kz = if m[0] > m[1] && m[0] > m[2] { 0 } else { 2 - usize::from(m[1] > m[2]) };
        let (mut kx, mut ky) = (NEXT_AXIS[kz], NEXT_AXIS[kz + 1]);
        if d[kz] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let per_z = 1.0 / d[kz];
        Self {
            axes: [kx, ky, kz],
            origin: [o[kx], o[ky], o[kz]],
            scale: [d[kx] / d[kz], d[ky] / d[kz], per_z],
        }
    }
}

/// The axis after each, cyclically, and the one after that.
const NEXT_AXIS: [usize; 4] = [1, 2, 0, 1];

/// What a ray found in a block. `u`, `v`, `w`, `det` are the unnormalised edge functions and their sum.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockHits {
    /// One bit a triangle; the other fields are only meaningful for set bits.
    pub(crate) mask: u32,
    pub(crate) t: [f32; LANES],
    pub(crate) u: [f32; LANES],
    pub(crate) v: [f32; LANES],
    pub(crate) w: [f32; LANES],
    /// Positive where the ray meets the front (counter-clockwise) side.
    pub(crate) det: [f32; LANES],
}

impl BlockHits {
    pub(crate) const NONE: Self = Self {
        mask: 0,
        t: [0.0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
        w: [0.0; LANES],
        det: [0.0; LANES],
    };
}

/// Sheared corners of one triangle of a block: `[[x, y]; 3]`.
#[inline(always)]
pub(crate) fn sheared(block: &Block, ray: &Shear, lane: usize) -> [[f32; 2]; 3] {
    let [kx, ky, kz] = ray.axes;
    std::array::from_fn(|corner| {
        let row = |axis: usize| block.rows[3 * corner + axis][lane];
        let z = row(kz) - ray.origin[2];
        [(row(kx) - ray.origin[0]) - ray.scale[0] * z, (row(ky) - ray.origin[1]) - ray.scale[1] * z]
    })
}

/// The edge functions where one is exactly zero in f32: products of two f32 are exact in f64.
#[cold]
#[inline(never)]
pub(crate) fn exact_edges([a, b, c]: [[f32; 2]; 3]) -> [f32; 3] {
    let edge = |p: [f32; 2], q: [f32; 2]| {
        (f64::from(q[0]) * f64::from(p[1]) - f64::from(q[1]) * f64::from(p[0])) as f32
    };
    [edge(b, c), edge(c, a), edge(a, b)]
}

/// For counting crossings, a ray exactly through an edge or corner must cross exactly one of the triangles around it.
/// Decides as if the ray were moved by an infinitesimal (e, e^2) in the sheared plane (Edelsbrunner, Muecke 1990,
/// "Simulation of Simplicity"): then closed meshes have as many exits as entries, always.
///
/// Returns the side (true: entering) or `None` if the moved ray passes beside the triangle.
#[cold]
#[inline(never)]
pub(crate) fn crossing_sides(block: &Block, ray: &Shear, lane: usize) -> Option<bool> {
    let [a, b, c] = sheared(block, ray, lane);
    let side = |p: [f32; 2], q: [f32; 2]| {
        let exact = f64::from(q[0]) * f64::from(p[1]) - f64::from(q[1]) * f64::from(p[0]);
        [exact, f64::from(q[1]) - f64::from(p[1]), f64::from(p[0]) - f64::from(q[0])]
            .into_iter()
            .find(|&x| x != 0.0)
            .map(|x| x > 0.0)
    };
    match (side(b, c)?, side(c, a)?, side(a, b)?) {
        (true, true, true) => Some(true),
        (false, false, false) => Some(false),
        _ => None,
    }
}

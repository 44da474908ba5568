//! The kernel for x86 CPUs with AVX2: eight boxes or four triangles an instruction.
//!
//! The only file with `unsafe`. Triangle arithmetic is the portable kernel's, operation by operation and without
//! fused multiply-adds, so both give the same bits; a test compares them. Elsewhere than on x86-64 the kernel exists
//! as a type without values.
#![allow(
    unsafe_code,
    reason = "vector loads, and calls of functions compiled for a CPU detected at run time"
)]

use super::kernel::{BOX_SLACK, BoxRay, Kernel, KernelTask};
use super::node::{Node, WIDTH};
use super::triangle::{Block, BlockHits, LANES, Shear, exact_edges};

/// Proof that the CPU has AVX2, BMI1 and BMI2: only [`Avx2::detect`] makes one.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(());

/// A kernel this CPU doesn't have.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Debug, Clone, Copy)]
pub(crate) enum Avx2 {}

impl Avx2 {
    #[cfg(target_arch = "x86_64")]
    pub(crate) fn detect() -> Option<Self> {
        let detected = std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("bmi2");
        detected.then_some(Self(()))
    }

    #[cfg(not(target_arch = "x86_64"))]
    pub(crate) fn detect() -> Option<Self> {
        None
    }
}

/// Runs `task`, compiled for AVX2.
#[inline]
pub(crate) fn run<T: KernelTask>(kernel: Avx2, task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    {
        // SAFETY: the existence of `kernel` proves that the CPU has AVX2, BMI1 and BMI2.
        unsafe { run_avx2(kernel, task) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    match kernel {}
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2")]
fn run_avx2<T: KernelTask>(kernel: Avx2, task: T) -> T::Output {
    task.run(kernel)
}

#[cfg(not(target_arch = "x86_64"))]
impl Kernel for Avx2 {
    fn boxes(self, _: &Node, _: &BoxRay, _: f32, _: &mut [f32; WIDTH]) -> u32 {
        match self {}
    }

    fn triangles(self, _: &Block, _: &Shear, _: f32) -> BlockHits {
        match self {}
    }
}

#[cfg(target_arch = "x86_64")]
impl Kernel for Avx2 {
    #[inline(always)]
    fn boxes(self, node: &Node, ray: &BoxRay, t_max: f32, entry: &mut [f32; WIDTH]) -> u32 {
        // SAFETY: `self` proves that the CPU has AVX2.
        unsafe { boxes(node, ray, t_max, entry) }
    }

    #[inline(always)]
    fn triangles(self, block: &Block, ray: &Shear, t_max: f32) -> BlockHits {
        // SAFETY: `self` proves that the CPU has AVX2.
        unsafe { triangles(block, ray, t_max) }
    }
}

#[cfg(target_arch = "x86_64")]
use x86::{boxes, triangles};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::*;
    use std::arch::x86_64::*;

    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn load8(values: &[f32; WIDTH]) -> __m256 {
        // SAFETY: the reference covers the eight values read; unaligned loads are allowed.
        unsafe { _mm256_loadu_ps(values.as_ptr()) }
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn load4(values: &[f32; LANES]) -> __m128 {
        // SAFETY: the reference covers the four values read; unaligned loads are allowed.
        unsafe { _mm_loadu_ps(values.as_ptr()) }
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn store4(values: __m128) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        // SAFETY: `out` has room for the four values written; unaligned stores are allowed.
        unsafe { _mm_storeu_ps(out.as_mut_ptr(), values) };
        out
    }

    /// The planes of `axis` the ray meets first and last, as ray parameters.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn slab(node: &Node, ray: &BoxRay, axis: usize) -> (__m256, __m256) {
        let near_row = ray.near_row[axis];
        debug_assert!(near_row < 6);
        // SAFETY: `BoxRay::new` makes `near_row` 2 * axis or 2 * axis + 1, so both rows are below 6.
        let (low, high) =
            unsafe { (node.bounds.get_unchecked(near_row), node.bounds.get_unchecked(near_row ^ 1)) };
        let o = _mm256_set1_ps(ray.origin[axis]);
        let to_near = _mm256_set1_ps(ray.near_inverse[axis]);
        let to_far = _mm256_set1_ps(ray.far_inverse[axis]);
        (
            _mm256_mul_ps(_mm256_sub_ps(load8(low), o), to_near),
            _mm256_mul_ps(_mm256_sub_ps(load8(high), o), to_far),
        )
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    pub(super) fn boxes(node: &Node, ray: &BoxRay, t_max: f32, entry: &mut [f32; WIDTH]) -> u32 {
        let (near_x, far_x) = slab(node, ray, 0);
        let (near_y, far_y) = slab(node, ray, 1);
        let (near_z, far_z) = slab(node, ray, 2);
        let near = _mm256_max_ps(_mm256_max_ps(near_x, near_y), _mm256_max_ps(near_z, _mm256_setzero_ps()));
        let t_max = _mm256_set1_ps(t_max * (1.0 + BOX_SLACK));
        let far = _mm256_min_ps(_mm256_min_ps(far_x, far_y), _mm256_min_ps(far_z, t_max));
        // SAFETY: `entry` has room for the eight values written; unaligned stores are allowed.
        unsafe { _mm256_storeu_ps(entry.as_mut_ptr(), near) };
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32
    }

    /// `q * p' - q' * p`: the edge function of two sheared corners, each product rounded by itself.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn edge(p: [__m128; 3], q: [__m128; 3]) -> __m128 {
        _mm_sub_ps(_mm_mul_ps(q[0], p[1]), _mm_mul_ps(q[1], p[0]))
    }

    /// A corner of the four triangles in sheared space.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn corner(block: &Block, ray: &Shear, corner: usize) -> [__m128; 3] {
        let relative = |i: usize| {
            debug_assert!(ray.axes[i] < 3 && corner < 3);
            // SAFETY: axes are below 3 by construction of `Shear` and `corner` is below 3, so the row is below 9.
            let row = unsafe { block.rows.get_unchecked(3 * corner + ray.axes[i]) };
            _mm_sub_ps(load4(row), _mm_set1_ps(ray.origin[i]))
        };
        let z = relative(2);
        let x = _mm_sub_ps(relative(0), _mm_mul_ps(_mm_set1_ps(ray.scale[0]), z));
        let y = _mm_sub_ps(relative(1), _mm_mul_ps(_mm_set1_ps(ray.scale[1]), z));
        [x, y, z]
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    pub(super) fn triangles(block: &Block, ray: &Shear, t_max: f32) -> BlockHits {
        let (a, b, c) = (corner(block, ray, 0), corner(block, ray, 1), corner(block, ray, 2));
        let (mut u, mut v, mut w) = (edge(b, c), edge(c, a), edge(a, b));
        let zero = _mm_setzero_ps();
        let (least, most) = (_mm_min_ps(_mm_min_ps(u, v), w), _mm_max_ps(_mm_max_ps(u, v), w));
        // All on one side, or on an edge. Absent lanes are NaN and on neither.
        let mut inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
        if _mm_movemask_ps(inside) == 0 {
            return BlockHits::NONE;
        }
        // A zero that decides; one between two signs doesn't.
        let on_edge = _mm_or_ps(_mm_cmpeq_ps(least, zero), _mm_cmpeq_ps(most, zero));
        let zeros = _mm_movemask_ps(on_edge) as u32;
        if zeros != 0 {
            [u, v, w] = exact_lanes(zeros, [a, b, c], [u, v, w]);
            let (least, most) = (_mm_min_ps(_mm_min_ps(u, v), w), _mm_max_ps(_mm_max_ps(u, v), w));
            inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
        }
        let det = _mm_add_ps(_mm_add_ps(u, v), w);
        let depth = |p: [__m128; 3]| _mm_mul_ps(_mm_set1_ps(ray.scale[2]), p[2]);
        let sum =
            _mm_add_ps(_mm_add_ps(_mm_mul_ps(u, depth(a)), _mm_mul_ps(v, depth(b))), _mm_mul_ps(w, depth(c)));
        let t = _mm_div_ps(sum, det);
        let in_range = _mm_and_ps(_mm_cmpge_ps(t, zero), _mm_cmple_ps(t, _mm_set1_ps(t_max)));
        let hit = _mm_and_ps(_mm_and_ps(inside, in_range), _mm_cmpneq_ps(det, zero));
        let mask = _mm_movemask_ps(hit) as u32;
        if mask == 0 {
            return BlockHits::NONE;
        }
        BlockHits { mask, t: store4(t), u: store4(u), v: store4(v), w: store4(w), det: store4(det) }
    }

    /// Replaces the edge functions of the lanes in `zeros` by exact ones.
    #[cold]
    #[inline(never)]
    #[target_feature(enable = "avx2,bmi1,bmi2")]
    fn exact_lanes(zeros: u32, corners: [[__m128; 3]; 3], edges: [__m128; 3]) -> [__m128; 3] {
        let corners = corners.map(|p| [store4(p[0]), store4(p[1])]);
        let mut edges = edges.map(|e| store4(e));
        for lane in (0..LANES).filter(|lane| zeros >> lane & 1 == 1) {
            let exact = exact_edges(corners.map(|p| [p[0][lane], p[1][lane]]));
            for i in 0..3 {
                edges[i][lane] = exact[i];
            }
        }
        [load4(&edges[0]), load4(&edges[1]), load4(&edges[2])]
    }
}

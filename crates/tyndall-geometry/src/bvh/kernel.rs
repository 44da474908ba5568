//! What differs between CPUs: testing eight boxes and four triangles. One generic traversal uses either kernel.

use super::kernel_avx2::{self, Avx2};
use super::kernel_portable::Portable;
use super::node::{Node, WIDTH};
use super::triangle::{Block, BlockHits, Shear};
use glam::Vec3A;
use tyndall_math::Ray;

/// Room for rounding in the box test: entry distances shrink and exits grow by this much, relatively.
///
/// The slab test alone needs 2 gamma(3), 3.6e-7 (Ize 2013, "Robust BVH Ray Traversal"). The rest covers the rounding
/// of the triangle's distance, so that no triangle is culled whose computed hit is the nearest: the result is then
/// a property of the triangles, not of the tree.
pub(crate) const BOX_SLACK: f32 = 1e-6;

/// Smallest direction component that is inverted; smaller ones are taken as this with their sign.
const TINY_DIRECTION: f32 = 1e-36;

/// A ray prepared for box tests.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoxRay {
    pub(crate) origin: [f32; 3],
    /// One over the direction, with [`BOX_SLACK`] for the planes the ray meets first and for those it meets last.
    pub(crate) near_inverse: [f32; 3],
    pub(crate) far_inverse: [f32; 3],
    /// Row of [`Node::bounds`] which the ray meets first on each axis; the other of the axis is `row ^ 1`.
    pub(crate) near_row: [usize; 3],
}

impl BoxRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Self {
        let invert = |d: f32| 1.0 / if d.abs() < TINY_DIRECTION { TINY_DIRECTION.copysign(d) } else { d };
        let d = ray.direction;
        let inverse = Vec3A::new(invert(d.x), invert(d.y), invert(d.z));
        Self {
            origin: ray.origin.to_array(),
            near_inverse: (inverse * (1.0 - BOX_SLACK)).to_array(),
            far_inverse: (inverse * (1.0 + BOX_SLACK)).to_array(),
            near_row: std::array::from_fn(|axis| 2 * axis + usize::from(d[axis].is_sign_negative())),
        }
    }
}

/// Whether the ray can hit anything: finite, with a direction and an interval.
#[inline(always)]
pub(crate) fn is_traceable(ray: &Ray) -> bool {
    ray.origin.is_finite() && ray.direction.is_finite() && ray.direction != Vec3A::ZERO && ray.t_max >= 0.0
}

/// Instructions of one CPU level.
pub(crate) trait Kernel: Copy {
    /// Which children the ray enters no later than `t_max` (a bit each), and where, conservatively early.
    fn boxes(self, node: &Node, ray: &BoxRay, t_max: f32, entry: &mut [f32; WIDTH]) -> u32;

    /// Which triangles of the block the ray hits in `[0, t_max]`.
    fn triangles(self, block: &Block, ray: &Shear, t_max: f32) -> BlockHits;
}

/// Something to do with either kernel. Implementations must be `#[inline(always)]` down to the kernel's functions,
/// because a function that isn't inlined is compiled for the baseline CPU.
pub(crate) trait KernelTask {
    type Output;
    fn run<K: Kernel>(self, kernel: K) -> Self::Output;
}

/// Runs a task with the kernel of `level`.
#[inline]
pub(crate) fn run<T: KernelTask>(level: SimdLevel, task: T) -> T::Output {
    match level.0 {
        Level::Portable => task.run(Portable),
        Level::Avx2(kernel) => kernel_avx2::run(kernel, task),
    }
}

/// Instructions used to trace rays. Every level gives the same hits, bit for bit.
#[derive(Debug, Clone, Copy)]
pub struct SimdLevel(Level);

#[derive(Debug, Clone, Copy)]
enum Level {
    Portable,
    Avx2(Avx2),
}

impl SimdLevel {
    /// The best level of this CPU.
    pub fn detect() -> Self {
        Self(Avx2::detect().map_or(Level::Portable, Level::Avx2))
    }

    /// Baseline instructions only.
    pub fn portable() -> Self {
        Self(Level::Portable)
    }

    /// Lower-case name: `portable` or `avx2`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Level::Portable => "portable",
            Level::Avx2(_) => "avx2",
        }
    }
}

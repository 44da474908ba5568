//! The kernel every CPU can run, and the meaning of the wide one.

use super::kernel::{BOX_SLACK, BoxRay, Kernel};
use super::node::{Node, WIDTH};
use super::triangle::{Block, BlockHits, LANES, Shear, exact_edges, sheared};

#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

impl Kernel for Portable {
    #[inline(always)]
    fn boxes(self, node: &Node, ray: &BoxRay, t_max: f32, entry: &mut [f32; WIDTH]) -> u32 {
        let mut near = [0f32; WIDTH];
        let mut far = [t_max * (1.0 + BOX_SLACK); WIDTH];
        for axis in 0..3 {
            let near_row = ray.near_row[axis];
            let (low, high) = (&node.bounds[near_row], &node.bounds[near_row ^ 1]);
            let (o, to_near, to_far) = (ray.origin[axis], ray.near_inverse[axis], ray.far_inverse[axis]);
            for i in 0..WIDTH {
                near[i] = near[i].max((low[i] - o) * to_near);
                far[i] = far[i].min((high[i] - o) * to_far);
            }
        }
        *entry = near;
        (0..WIDTH).fold(0, |mask, i| mask | u32::from(near[i] <= far[i]) << i)
    }

    #[inline(always)]
    fn triangles(self, block: &Block, ray: &Shear, t_max: f32) -> BlockHits {
        let mut hits = BlockHits::NONE;
        for lane in 0..LANES {
            triangle(block, ray, t_max, lane, &mut hits);
        }
        hits
    }
}

#[inline(always)]
fn triangle(block: &Block, ray: &Shear, t_max: f32, lane: usize, hits: &mut BlockHits) {
    let [a, b, c] = sheared(block, ray, lane);
    let mut u = c[0] * b[1] - c[1] * b[0];
    let mut v = a[0] * c[1] - a[1] * c[0];
    let mut w = b[0] * a[1] - b[1] * a[0];
    if u == 0.0 || v == 0.0 || w == 0.0 {
        [u, v, w] = exact_edges([a, b, c]);
    }
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return;
    }
    let det = u + v + w;
    if det == 0.0 {
        return;
    }
    let z = |corner: usize| ray.scale[2] * (block.rows[3 * corner + ray.axes[2]][lane] - ray.origin[2]);
    let t = (u * z(0) + v * z(1) + w * z(2)) / det;
    if t >= 0.0 && t <= t_max {
        hits.mask |= 1 << lane;
        hits.t[lane] = t;
        (hits.u[lane], hits.v[lane], hits.w[lane], hits.det[lane]) = (u, v, w, det);
    }
}

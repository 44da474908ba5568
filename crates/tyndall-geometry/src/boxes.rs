//! Many boxes, for things that know their own intersection: light bodies, for example.

use crate::bvh::{
    Bounds, BoxRay, Kernel, KernelTask, Leaves, SimdLevel, Visit, WideBvh, build, is_traceable, run, walk,
};
use glam::Vec3A;
use std::ops::Range;
use tyndall_math::Ray;

/// A tree over axis-aligned boxes; their numbers are their indices at building.
#[derive(Debug, Clone)]
pub struct BoxTree {
    bvh: WideBvh,
    /// Boxes without a finite extent, always met.
    unbounded: Vec<u32>,
    simd: SimdLevel,
}

impl BoxTree {
    /// A tree over boxes given by their smallest and largest corners. Boxes that are not finite are met by every ray,
    /// inverted ones by none.
    pub fn build(boxes: impl IntoIterator<Item = (Vec3A, Vec3A)>) -> Self {
        let mut boxes: Vec<Bounds> = boxes.into_iter().map(|(min, max)| Bounds { min, max }).collect();
        let mut unbounded = Vec::new();
        for (index, bounds) in (0..).zip(&mut boxes).filter(|(_, bounds)| !bounds.is_finite()) {
            unbounded.push(index);
            *bounds = Bounds::EMPTY;
        }
        let bvh = build(&boxes, Leaves { max_primitives: 1, primitives_per_item: 1 });
        Self { bvh, unbounded, simd: SimdLevel::detect() }
    }

    /// Uses other instructions. Results don't change; for tests and comparisons.
    pub fn with_simd(self, simd: SimdLevel) -> Self {
        Self { simd, ..self }
    }

    /// Calls `visit` with the number of every box that the ray may meet, roughly from near to far. It returns how far
    /// along the ray further boxes matter, at most as far as before; a negative number ends the walk. Boxes are tested
    /// conservatively: a few are visited that the ray misses by rounding. A ray that is not finite or has no direction
    /// meets none.
    #[inline]
    pub fn for_each_met(&self, ray: &Ray, mut visit: impl FnMut(usize) -> f32) {
        if !is_traceable(ray) {
            return;
        }
        let mut t_max = ray.t_max;
        for &index in &self.unbounded {
            t_max = visit(index as usize);
            if t_max < 0.0 {
                return;
            }
        }
        run(self.simd, MetTask { bvh: &self.bvh, ray, t_max, visit: &mut visit });
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        self.bvh.memory_bytes() + size_of_val(self.unbounded.as_slice())
    }
}

struct MetTask<'a, F> {
    bvh: &'a WideBvh,
    ray: &'a Ray,
    t_max: f32,
    visit: &'a mut F,
}

impl<F: FnMut(usize) -> f32> KernelTask for MetTask<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) {
        let (nodes, ray) = (&self.bvh.nodes, BoxRay::new(self.ray));
        walk(kernel, nodes, &ray, &mut self);
    }
}

impl<F: FnMut(usize) -> f32> Visit for MetTask<'_, F> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, items: Range<usize>) -> bool {
        for &index in &self.bvh.order[items] {
            self.t_max = (self.visit)(index as usize);
            if self.t_max < 0.0 {
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_math::random::Pcg;

    fn vector(rng: &mut Pcg) -> Vec3A {
        Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0
    }

    /// Slab test in f64.
    fn meets((min, max): (Vec3A, Vec3A), ray: &Ray) -> bool {
        let (o, inverse) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().recip());
        let (a, b) = ((min.as_dvec3() - o) * inverse, (max.as_dvec3() - o) * inverse);
        let near = a.min(b).max_element().max(0.0);
        near <= a.max(b).min_element().min(f64::from(ray.t_max))
    }

    #[test]
    fn no_box_that_is_met_is_left_out() {
        let mut rng = Pcg::new(&[1]);
        let mut boxes: Vec<(Vec3A, Vec3A)> = (0..500)
            .map(|i| {
                let (center, half) = (vector(&mut rng), vector(&mut rng).abs() * 0.1);
                // Some without thickness, some equal.
                let half = if i % 4 == 0 { half * Vec3A::new(1.0, 0.0, 1.0) } else { half };
                if i % 10 == 0 { (Vec3A::ZERO, Vec3A::splat(0.2)) } else { (center - half, center + half) }
            })
            .collect();
        boxes.push((Vec3A::splat(f32::NEG_INFINITY), Vec3A::splat(f32::INFINITY)));
        boxes.push((Vec3A::ONE, Vec3A::NEG_ONE));
        for simd in [SimdLevel::detect(), SimdLevel::portable()] {
            let tree = BoxTree::build(boxes.iter().copied()).with_simd(simd);
            let mut n_visited = 0;
            for _ in 0..300 {
                let ray = Ray::new(vector(&mut rng) * 2.0, vector(&mut rng)).up_to(3.0 * rng.next_f32());
                let mut visited = vec![false; boxes.len()];
                tree.for_each_met(&ray, |index| {
                    assert!(!std::mem::replace(&mut visited[index], true), "visited twice");
                    ray.t_max
                });
                for (index, _) in boxes[..500].iter().enumerate().filter(|(_, b)| meets(**b, &ray)) {
                    assert!(visited[index]);
                }
                assert!(visited[500] && !visited[501]);
                n_visited += visited.iter().filter(|v| **v).count();
            }
            assert!(n_visited < 300 * 100, "{n_visited} visits are hardly fewer than all");
        }
    }

    #[test]
    fn the_walk_ends_when_told() {
        let tree = BoxTree::build((0..100).map(|i| (Vec3A::splat(i as f32), Vec3A::splat(i as f32 + 0.5))));
        let ray = Ray::new(Vec3A::splat(-1.0), Vec3A::ONE);
        let mut seen = Vec::new();
        tree.for_each_met(&ray, |index| {
            seen.push(index);
            if seen.len() == 3 { -1.0 } else { f32::INFINITY }
        });
        assert_eq!(seen, [0, 1, 2]);
        let mut n_near = 0;
        tree.for_each_met(&ray, |_| {
            n_near += 1;
            10.0
        });
        assert!(n_near < 20, "{n_near}");
        tree.for_each_met(&Ray::new(Vec3A::NAN, Vec3A::X), |_| panic!("nothing to meet"));
        BoxTree::build([]).for_each_met(&ray, |_| panic!("nothing there"));
    }
}

//! Bottom level: what one object is made of.

use crate::accel::Crossing;
use crate::bvh::{
    Block, Bounds, BoxRay, Kernel, LANES, Leaves, Shear, Visit, WideBvh, build, crossing_sides, walk,
};
use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use std::ops::Range;
use tyndall_math::Ray;

mod sphere;

pub(crate) use sphere::roots_f64 as sphere_roots;

/// A triangle mesh with its tree, or the unit sphere, in object space. Shared by all instances of it.
#[derive(Debug, Clone)]
pub struct Blas {
    shape: BlasShape,
    bounds: Bounds,
}

#[derive(Debug, Clone)]
enum BlasShape {
    Triangles(Triangles),
    UnitSphere,
}

#[derive(Debug, Clone)]
struct Triangles {
    bvh: WideBvh,
    blocks: Vec<Block>,
    /// Where each triangle is stored: block * LANES + lane, or `u32::MAX` if it was left out.
    slot: Vec<u32>,
}

/// A hit inside one object; unlike [`crate::Hit`] without an instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocalHit {
    pub(crate) t: f32,
    pub(crate) primitive: u32,
    pub(crate) u: f32,
    pub(crate) v: f32,
}

impl LocalHit {
    /// Nothing, up to `t_max`.
    pub(crate) fn none(t_max: f32) -> Self {
        Self { t: t_max, primitive: u32::MAX, u: 0.0, v: 0.0 }
    }

    pub(crate) fn is_some(&self) -> bool {
        self.primitive != u32::MAX
    }
}

impl Blas {
    /// The mesh of `indices` into `positions` (object space). Triangles with an index out of range, a coordinate that
    /// is not finite or three collinear corners are left out; the others keep their index as primitive number.
    pub fn from_triangles(positions: &[Vec3], indices: &[[u32; 3]]) -> Self {
        let corners = |triangle: usize| {
            let corner = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
            indices[triangle].map(corner)
        };
        let bounds_of = |triangle: usize| {
            let corners = corners(triangle);
            if is_degenerate(corners) { Bounds::EMPTY } else { Bounds::of_points(corners.map(Vec3A::from)) }
        };
        let boxes: Vec<Bounds> = (0..indices.len()).into_par_iter().map(bounds_of).collect();
        let bounds = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(b));
        let bvh = build(&boxes, Leaves { max_primitives: 2 * LANES, primitives_per_item: LANES });
        let is_used = |primitive: u32| primitive != u32::MAX;
        let block = |primitives: &[u32]| {
            let mut block = Block::empty();
            for (lane, &primitive) in primitives.iter().enumerate().filter(|(_, p)| is_used(**p)) {
                block.set(lane, corners(primitive as usize), primitive);
            }
            block
        };
        let blocks = bvh.order.par_chunks_exact(LANES).map(block).collect();
        let mut slot = vec![u32::MAX; indices.len()];
        for (at, &primitive) in bvh.order.iter().enumerate().filter(|(_, p)| is_used(**p)) {
            slot[primitive as usize] = at as u32;
        }
        // The blocks replace it.
        let bvh = WideBvh { order: Vec::new(), ..bvh };
        Self { shape: BlasShape::Triangles(Triangles { bvh, blocks, slot }), bounds }
    }

    /// The sphere of radius 1 around the origin; one primitive, number 0.
    pub fn unit_sphere() -> Self {
        let bounds = Bounds { min: Vec3A::NEG_ONE, max: Vec3A::ONE };
        Self { shape: BlasShape::UnitSphere, bounds }
    }

    /// Least and greatest coordinates in object space; inverted infinities if there is nothing to hit.
    pub fn bounds(&self) -> (Vec3A, Vec3A) {
        (self.bounds.min, self.bounds.max)
    }

    pub(crate) fn object_bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        match &self.shape {
            BlasShape::Triangles(Triangles { bvh, blocks, slot }) => {
                bvh.memory_bytes() + size_of_val(blocks.as_slice()) + size_of_val(slot.as_slice())
            }
            BlasShape::UnitSphere => 0,
        }
    }

    /// Whether it is the analytic sphere.
    pub fn is_sphere(&self) -> bool {
        matches!(self.shape, BlasShape::UnitSphere)
    }

    /// Corners of a triangle in object space; `None` for a sphere and for triangles that were left out.
    pub fn triangle(&self, primitive: u32) -> Option<[Vec3; 3]> {
        match &self.shape {
            BlasShape::Triangles(t) => {
                let slot = *t.slot.get(primitive as usize)? as usize;
                Some(t.blocks.get(slot / LANES)?.corners(slot % LANES))
            }
            BlasShape::UnitSphere => None,
        }
    }

    /// Volume enclosed, positive if the triangles are wound counter-clockwise seen from outside (divergence theorem,
    /// in f64). Independent of the origin for closed meshes.
    pub fn signed_volume(&self) -> f64 {
        let BlasShape::Triangles(t) = &self.shape else { return 4.0 / 3.0 * std::f64::consts::PI };
        let origin = (self.bounds.min.as_dvec3() + self.bounds.max.as_dvec3()) * 0.5;
        let triangles = (0..t.slot.len() as u32).filter_map(|i| self.triangle(i));
        triangles.map(|corners| signed_volume(corners.map(Vec3::as_dvec3), origin)).sum()
    }

    /// Replaces `best` by the nearest hit of `ray` (in object space) if there is one nearer, or as near with a lower
    /// number.
    #[inline(always)]
    pub(crate) fn nearest<K: Kernel>(&self, kernel: K, ray: &Ray, best: &mut LocalHit) {
        match &self.shape {
            BlasShape::Triangles(t) => {
                let mut visitor = Nearest { kernel, blocks: &t.blocks, shear: Shear::new(ray), best };
                walk(kernel, &t.bvh.nodes, &BoxRay::new(ray), &mut visitor);
            }
            BlasShape::UnitSphere => sphere::nearest(ray, best),
        }
    }

    /// Whether `ray` (in object space) hits anything.
    #[inline(always)]
    pub(crate) fn any<K: Kernel>(&self, kernel: K, ray: &Ray) -> bool {
        match &self.shape {
            BlasShape::Triangles(t) => {
                let mut visitor = Any { kernel, blocks: &t.blocks, shear: Shear::new(ray), t_max: ray.t_max };
                walk(kernel, &t.bvh.nodes, &BoxRay::new(ray), &mut visitor)
            }
            BlasShape::UnitSphere => sphere::roots(ray).iter().any(|t| (0.0..=ray.t_max).contains(t)),
        }
    }

    /// Appends every crossing of `ray` (in object space), in no order, as of instance `instance`.
    #[inline(always)]
    pub(crate) fn all<K: Kernel>(&self, kernel: K, ray: &Ray, instance: u32, out: &mut Vec<Crossing>) {
        match &self.shape {
            BlasShape::Triangles(t) => {
                let shear = Shear::new(ray);
                let mut visitor = All { kernel, blocks: &t.blocks, shear, t_max: ray.t_max, instance, out };
                walk(kernel, &t.bvh.nodes, &BoxRay::new(ray), &mut visitor);
            }
            BlasShape::UnitSphere => sphere::all(ray, instance, out),
        }
    }
}

/// Whether a triangle has no area or no place.
fn is_degenerate([a, b, c]: [Vec3; 3]) -> bool {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    // Differences of f32 are exact enough in f64 that collinear corners give zero or rounding of 1e-16.
    let normal = (b - a).cross(c - a);
    let scale = (b - a).abs().max((c - a).abs()).max_element();
    let has_area = normal.length() > 1e-15 * scale * scale;
    // Comparing with NaN is false.
    !has_area || !(a + b + c).is_finite()
}

/// Volume of the tetrahedron of a triangle and `origin`, positive if the triangle faces away from it.
pub(crate) fn signed_volume([a, b, c]: [DVec3; 3], origin: DVec3) -> f64 {
    (a - origin).dot((b - origin).cross(c - origin)) / 6.0
}

struct Nearest<'a, K> {
    kernel: K,
    blocks: &'a [Block],
    shear: Shear,
    best: &'a mut LocalHit,
}

impl<K: Kernel> Visit for Nearest<'_, K> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t
    }

    #[inline(always)]
    fn leaf(&mut self, items: Range<usize>) -> bool {
        for block in &self.blocks[items] {
            let hits = self.kernel.triangles(block, &self.shear, self.best.t);
            let mut mask = hits.mask;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let (t, primitive) = (hits.t[lane], block.primitive[lane]);
                // Ties go to the lower number, so the hit doesn't depend on the order of leaves.
                if t < self.best.t || t == self.best.t && primitive < self.best.primitive {
                    let (u, v) = (hits.v[lane] / hits.det[lane], hits.w[lane] / hits.det[lane]);
                    *self.best = LocalHit { t, primitive, u, v };
                }
            }
        }
        false
    }
}

struct Any<'a, K> {
    kernel: K,
    blocks: &'a [Block],
    shear: Shear,
    t_max: f32,
}

impl<K: Kernel> Visit for Any<'_, K> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, items: Range<usize>) -> bool {
        self.blocks[items].iter().any(|block| self.kernel.triangles(block, &self.shear, self.t_max).mask != 0)
    }
}

struct All<'a, K> {
    kernel: K,
    blocks: &'a [Block],
    shear: Shear,
    t_max: f32,
    instance: u32,
    out: &'a mut Vec<Crossing>,
}

impl<K: Kernel> Visit for All<'_, K> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, items: Range<usize>) -> bool {
        for block in &self.blocks[items] {
            let hits = self.kernel.triangles(block, &self.shear, self.t_max);
            for lane in (0..LANES).filter(|lane| hits.mask >> lane & 1 == 1) {
                let on_edge = hits.u[lane] == 0.0 || hits.v[lane] == 0.0 || hits.w[lane] == 0.0;
                let side = if on_edge {
                    crossing_sides(block, &self.shear, lane)
                } else {
                    Some(hits.det[lane] > 0.0)
                };
                if let Some(entering) = side {
                    let (t, primitive) = (hits.t[lane], block.primitive[lane]);
                    self.out.push(Crossing { t, instance: self.instance, entering, primitive });
                }
            }
        }
        false
    }
}

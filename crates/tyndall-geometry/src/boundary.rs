//! Which parts of a ray are inside closed boundaries: the media a ray passes, found without any state from earlier
//! along the path.
//!
//! Boxes and spheres are analytic and solved in f64. A mesh is counted: the winding is 0 at infinity; coming back, an
//! exit adds one and an entry subtracts one, and the ray is inside where it is positive. A mesh with a hole is clipped
//! to its box, so it never fills the world.

mod analytic;
mod hull;
mod winding;

pub use winding::inside_intervals;

use crate::accel::{Crossing, Placement};
use crate::blas::Blas;
use crate::bvh::{
    Bounds, BoxRay, Kernel, KernelTask, Leaves, SimdLevel, Visit, WideBvh, build, is_traceable, run, walk,
};
use analytic::{box_interval, sphere_interval};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Mat3A, Vec3A};
use hull::Hull;
use std::ops::Range;
use std::sync::Arc;
use tyndall_math::Ray;

/// Boundaries up to this many are simply tried one after another.
const LINEAR: usize = 16;

/// A closed region of the camera-relative world. Transforms are f64 because thin boxes would not survive f32.
#[derive(Debug, Clone)]
pub enum BoundaryShape {
    /// All of space.
    Unbounded,
    /// The box [-1, 1]^3, transformed. Half-open: of two boxes that touch, one has the common face.
    Box {
        /// Places the box.
        world_from_box: DAffine3,
    },
    /// The unit sphere, transformed.
    Sphere {
        /// Places the sphere.
        world_from_sphere: DAffine3,
    },
    /// The inside of a mesh, whichever way it is wound.
    Mesh {
        /// The mesh.
        blas: Arc<Blas>,
        /// Places the mesh.
        world_from_object: Affine3A,
    },
}

/// Many boundaries; their numbers are their indices at building.
#[derive(Debug, Clone)]
pub struct Boundaries {
    regions: Vec<Region>,
    /// Boundaries without a box, always tried.
    unbounded: Vec<u32>,
    /// Over the others, if they are many.
    bvh: Option<WideBvh>,
    hull: Hull,
    simd: SimdLevel,
}

/// Memory of [`Boundaries::spans`], kept between calls so that rays don't allocate.
#[derive(Debug, Clone, Default)]
pub struct SpanScratch {
    candidates: Vec<u32>,
    crossings: Vec<Crossing>,
}

#[derive(Debug, Clone)]
enum Region {
    Unbounded,
    Box(Inverse),
    Sphere(Inverse),
    Mesh {
        blas: Arc<Blas>,
        placement: Placement,
        /// Whether the triangles are wound with their normals inward.
        is_flipped: bool,
    },
    /// Singular transforms and empty meshes contain nothing.
    Nothing,
}

/// The inverse of an affine map; the translation applies first, as in [`Placement`].
#[derive(Debug, Clone, Copy)]
struct Inverse {
    local_from_world: DMat3,
    center: DVec3,
}

impl Inverse {
    fn new(world_from_local: &DAffine3) -> Option<Self> {
        let local_from_world = world_from_local.matrix3.inverse();
        let inverse = Self { local_from_world, center: world_from_local.translation };
        (world_from_local.matrix3.determinant() != 0.0
            && local_from_world.is_finite()
            && inverse.center.is_finite())
        .then_some(inverse)
    }

    #[inline]
    fn ray(&self, ray: &Ray, low: Vec3A) -> (DVec3, DVec3) {
        let origin = self.local_from_world * (ray.origin.as_dvec3() + low.as_dvec3() - self.center);
        (origin, self.local_from_world * ray.direction.as_dvec3())
    }
}

impl Boundaries {
    /// Prepares boundaries. Singular transforms (a box without thickness) and meshes without triangles never contain
    /// anything.
    pub fn build(shapes: Vec<BoundaryShape>) -> Self {
        let regions: Vec<Region> = shapes.into_iter().map(Region::new).collect();
        let boxes: Vec<Option<Bounds>> = regions.iter().map(Region::world_bounds).collect();
        let hull = Hull::new(&boxes);
        let unbounded = (0..).zip(&boxes).filter(|(_, b)| b.is_none()).map(|(i, _)| i).collect();
        let bvh = (regions.len() > LINEAR).then(|| {
            let boxes: Vec<Bounds> = boxes.iter().map(|b| b.unwrap_or(Bounds::EMPTY)).collect();
            build(&boxes, Leaves { max_primitives: 1, primitives_per_item: 1 })
        });
        Self { regions, unbounded, bvh, hull, simd: SimdLevel::detect() }
    }

    /// Uses other instructions. Results don't change; for tests and comparisons.
    pub fn with_simd(self, simd: SimdLevel) -> Self {
        Self { simd, ..self }
    }

    /// Number of boundaries.
    pub fn len(&self) -> usize {
        self.regions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.regions.is_empty()
    }

    /// Calls `emit(boundary, t0, t1)` for every part of `ray` inside a boundary, `0 <= t0 < t1 <= t_max`,
    /// ordered by (boundary, t0). Spans of one boundary don't overlap; those of different ones may. The ray begins at
    /// `ray.origin + low` (see [`tyndall_math::SplitPoint`]): between walls a free flight apart, rounding to f32 would
    /// decide on which side. A ray that is not finite or has no direction has no spans.
    #[inline(always)]
    pub fn spans(
        &self,
        ray: &Ray,
        low: Vec3A,
        scratch: &mut SpanScratch,
        emit: &mut impl FnMut(u32, f64, f64),
    ) {
        if !self.hull.is_out_of_reach(ray, low) {
            self.spans_in_reach(ray, low, scratch, emit);
        }
    }

    #[inline(never)]
    fn spans_in_reach(
        &self,
        ray: &Ray,
        low: Vec3A,
        scratch: &mut SpanScratch,
        emit: &mut impl FnMut(u32, f64, f64),
    ) {
        if self.hull.is_passed_by(ray, low) || !is_traceable(ray) {
            return;
        }
        let SpanScratch { candidates, crossings } = scratch;
        let Some(bvh) = &self.bvh else {
            for boundary in 0..self.regions.len() as u32 {
                self.spans_of(boundary, ray, low, crossings, emit);
            }
            return;
        };
        candidates.clear();
        candidates.extend_from_slice(&self.unbounded);
        run(self.simd, CandidatesTask { bvh, ray, candidates });
        // In order of number, not of the tree.
        candidates.sort_unstable();
        for &boundary in candidates.iter() {
            self.spans_of(boundary, ray, low, crossings, emit);
        }
    }

    #[inline]
    fn spans_of(
        &self,
        boundary: u32,
        ray: &Ray,
        low: Vec3A,
        crossings: &mut Vec<Crossing>,
        emit: &mut impl FnMut(u32, f64, f64),
    ) {
        let mut clipped = |t0: f64, t1: f64| {
            let (t0, t1) = (t0.max(0.0), t1.min(f64::from(ray.t_max)));
            if t0 < t1 {
                emit(boundary, t0, t1);
            }
        };
        match &self.regions[boundary as usize] {
            Region::Nothing => {}
            Region::Unbounded => clipped(0.0, f64::INFINITY),
            Region::Box(inverse) => {
                let (origin, direction) = inverse.ray(ray, low);
                if let Some([t0, t1]) = box_interval(origin, direction, DVec3::NEG_ONE, DVec3::ONE) {
                    clipped(t0, t1);
                }
            }
            Region::Sphere(inverse) => {
                let (origin, direction) = inverse.ray(ray, low);
                if let Some([t0, t1]) = sphere_interval(origin, direction) {
                    clipped(t0, t1);
                }
            }
            Region::Mesh { blas, placement, is_flipped } => {
                self.mesh_spans(blas, placement, *is_flipped, ray, crossings, &mut clipped);
            }
        }
    }

    fn mesh_spans(
        &self,
        blas: &Blas,
        placement: &Placement,
        is_flipped: bool,
        ray: &Ray,
        crossings: &mut Vec<Crossing>,
        emit: &mut impl FnMut(f64, f64),
    ) {
        // Unbounded: where the ray is inside depends on everything ahead, not only up to the next surface.
        let local = placement.object_ray(&ray.up_to(f32::MAX));
        let Bounds { min, max } = blas.object_bounds();
        let (origin, direction) = (local.origin.as_dvec3(), local.direction.as_dvec3());
        let Some([enter, exit]) = box_interval(origin, direction, min.as_dvec3(), max.as_dvec3()) else {
            return;
        };
        if !is_traceable(&local) || enter > f64::from(ray.t_max) {
            return;
        }
        crossings.clear();
        run(self.simd, CrossingsTask { blas, ray: &local, crossings });
        crossings.iter_mut().for_each(|c| c.entering ^= is_flipped);
        inside_intervals(crossings, |_, t0, t1| {
            emit(f64::from(t0).max(enter), f64::from(t1).min(exit));
        });
    }
}

impl Region {
    fn new(shape: BoundaryShape) -> Self {
        match shape {
            BoundaryShape::Unbounded => Self::Unbounded,
            BoundaryShape::Box { world_from_box } => {
                Inverse::new(&world_from_box).map_or(Self::Nothing, Self::Box)
            }
            BoundaryShape::Sphere { world_from_sphere } => {
                Inverse::new(&world_from_sphere).map_or(Self::Nothing, Self::Sphere)
            }
            BoundaryShape::Mesh { blas, world_from_object } => {
                let placement = Placement::new(0, &world_from_object);
                if placement.is_singular() || blas.object_bounds().is_empty() {
                    return Self::Nothing;
                }
                let is_flipped = blas.signed_volume() < 0.0;
                Self::Mesh { blas, placement, is_flipped }
            }
        }
    }

    /// The box in the world; `None` if there is none.
    fn world_bounds(&self) -> Option<Bounds> {
        let unit = Bounds { min: Vec3A::NEG_ONE, max: Vec3A::ONE };
        match self {
            Self::Unbounded => None,
            Self::Nothing => Some(Bounds::EMPTY),
            Self::Box(inverse) | Self::Sphere(inverse) => {
                let linear = inverse.local_from_world.inverse().as_mat3();
                let world = unit.transformed(&Mat3A::from(linear), inverse.center.as_vec3a());
                world.is_finite().then_some(world)
            }
            Self::Mesh { blas, placement, .. } => Some(placement.world_bounds(&blas.object_bounds())),
        }
    }
}

struct CandidatesTask<'a> {
    bvh: &'a WideBvh,
    ray: &'a Ray,
    candidates: &'a mut Vec<u32>,
}

impl KernelTask for CandidatesTask<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) {
        let (nodes, ray) = (&self.bvh.nodes, BoxRay::new(self.ray));
        walk(kernel, nodes, &ray, &mut self);
    }
}

impl Visit for CandidatesTask<'_> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.ray.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, items: Range<usize>) -> bool {
        self.candidates.extend_from_slice(&self.bvh.order[items]);
        false
    }
}

struct CrossingsTask<'a> {
    blas: &'a Blas,
    ray: &'a Ray,
    crossings: &'a mut Vec<Crossing>,
}

impl KernelTask for CrossingsTask<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        self.blas.all(kernel, self.ray, 0, self.crossings);
    }
}

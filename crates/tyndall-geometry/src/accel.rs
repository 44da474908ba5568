//! Top level: instances of objects in the camera-relative world.
//!
//! A ray is moved to object space without normalising its direction, so distances compare across instances.

use crate::blas::Blas;
use crate::bvh::{Bounds, Leaves, SimdLevel, WideBvh, build, is_traceable, run};
use crate::surface::{self, SurfacePoint};
use glam::{Affine3A, Vec3A};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::Arc;
use tyndall_math::Ray;

mod motion;
mod placement;
mod search;

pub use motion::InstanceKey;
use motion::Motion;
pub(crate) use placement::Placement;
use search::{AllTask, AnyTask, At, Moment, NearestTask, Still};

/// An object and its place.
#[derive(Debug, Clone)]
pub struct Instance {
    /// What is placed.
    pub blas: Arc<Blas>,
    /// Where: object to camera-relative world. May mirror and scale unevenly.
    pub world_from_object: Affine3A,
    /// Where it is while the shutter is open, at ascending times; empty if it stands still. `world_from_object` does not
    /// count if there are any.
    pub motion: Vec<InstanceKey>,
}

/// The nearest thing a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Ray parameter, in lengths of the world ray's direction.
    pub t: f32,
    /// Index in the instances given to [`Accel::build`].
    pub instance: u32,
    /// Triangle of the mesh; 0 for a sphere.
    pub primitive: u32,
    /// Barycentric weight of corner 1; 0 for a sphere.
    pub u: f32,
    /// Barycentric weight of corner 2; 0 for a sphere.
    pub v: f32,
}

/// One of all the places where a ray meets surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Ray parameter.
    pub t: f32,
    /// Index of the instance.
    pub instance: u32,
    /// Whether the ray goes against the outward normal (of the winding, whatever the transform).
    pub entering: bool,
    /// Triangle of the mesh; 0 for a sphere.
    pub primitive: u32,
}

/// Every surface of a scene, ready for rays.
#[derive(Debug, Clone)]
pub struct Accel {
    bvh: WideBvh,
    placements: Vec<Placement>,
    /// Of the instances that move, with their numbers, ascending.
    motions: Vec<(u32, Motion)>,
    objects: Vec<Arc<Blas>>,
    /// Instances in the tree.
    n_active: usize,
    simd: SimdLevel,
}

impl Accel {
    /// Builds the top level. Instances whose transform has no finite inverse, or whose object is empty, stay in the
    /// numbering but can't be hit; [`Accel::skipped`] lists the former.
    pub fn build(instances: Vec<Instance>) -> Self {
        let mut object_of_address = FxHashMap::<*const Blas, u32>::default();
        let mut objects = Vec::new();
        let mut placements = Vec::with_capacity(instances.len());
        let mut motions = Vec::new();
        for Instance { blas, world_from_object, motion } in instances {
            let object = *object_of_address.entry(Arc::as_ptr(&blas)).or_insert_with(|| {
                objects.push(blas);
                objects.len() as u32 - 1
            });
            if motion.is_empty() {
                placements.push(Placement::new(object, &world_from_object));
            } else {
                motions.push((placements.len() as u32, Motion::new(object, motion)));
                placements.push(Placement::new(object, &world_from_object).moving());
            }
        }
        let world_bounds = |p: &Placement| p.world_bounds(&objects[p.object as usize].object_bounds());
        let mut boxes: Vec<Bounds> = placements.par_iter().map(world_bounds).collect();
        for (instance, motion) in &motions {
            let object = objects[placements[*instance as usize].object as usize].object_bounds();
            boxes[*instance as usize] = motion.world_bounds(&object);
        }
        let n_active = boxes.iter().filter(|b| !b.is_empty()).count();
        let bvh = build(&boxes, Leaves { max_primitives: 1, primitives_per_item: 1 });
        Self { bvh, placements, motions, objects, n_active, simd: SimdLevel::detect() }
    }

    /// Uses other instructions. Results don't change; for tests and comparisons.
    pub fn with_simd(self, simd: SimdLevel) -> Self {
        Self { simd, ..self }
    }

    /// Instances that can't be placed because their transform is singular or not finite, ascending.
    pub fn skipped(&self) -> impl Iterator<Item = u32> + '_ {
        let singular = self.placements.iter().enumerate().filter(|(_, p)| p.is_singular());
        singular.map(|(i, _)| i as u32)
    }

    /// Number of instances, skipped ones included.
    pub fn n_instances(&self) -> usize {
        self.placements.len()
    }

    /// Bytes on the heap, the objects' included.
    pub fn memory_bytes(&self) -> usize {
        let objects: usize = self.objects.iter().map(|b| size_of::<Blas>() + b.memory_bytes()).sum();
        let motions: usize = self.motions.iter().map(|(_, motion)| motion.memory_bytes()).sum();
        self.bvh.memory_bytes() + size_of_val(self.placements.as_slice()) + motions + objects
    }

    /// Whether any instance moves; if none does, times do not matter.
    pub fn moves(&self) -> bool {
        !self.motions.is_empty()
    }

    /// Least and greatest world coordinates of everything at any time; inverted infinities if there is nothing.
    pub fn bounds(&self) -> (Vec3A, Vec3A) {
        let all = self.bvh.bounds();
        (all.min, all.max)
    }

    /// The nearest hit with `0 <= t <= t_max`; among equally near ones that of the lower (instance, primitive).
    /// A ray that is not finite or has no direction hits nothing. `time` is in [0, 1] from the opening of the shutter to its
    /// closing.
    #[inline]
    pub fn intersect(&self, ray: &Ray, time: f32) -> Option<Hit> {
        if !is_traceable(ray) {
            return None;
        }
        if self.moves() {
            return self.intersect_moving(ray, time);
        }
        let hit = self.nearest(ray, Still);
        (hit.instance != u32::MAX).then_some(hit)
    }

    #[cold]
    #[inline(never)]
    fn intersect_moving(&self, ray: &Ray, time: f32) -> Option<Hit> {
        let hit = self.nearest(ray, At(time));
        (hit.instance != u32::MAX).then_some(hit)
    }

    /// Whether anything is hit with `0 <= t <= t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray, time: f32) -> bool {
        is_traceable(ray) && if self.moves() { self.occluded_moving(ray, time) } else { self.any(ray, Still) }
    }

    #[cold]
    #[inline(never)]
    fn occluded_moving(&self, ray: &Ray, time: f32) -> bool {
        self.any(ray, At(time))
    }

    /// Appends every crossing with `0 <= t <= t_max`, ordered by (instance, t). A ray through an edge or corner of a
    /// closed mesh crosses as if it passed infinitesimally beside it.
    pub fn intersect_all(&self, ray: &Ray, time: f32, out: &mut Vec<Crossing>) {
        if !is_traceable(ray) {
            return;
        }
        let first = out.len();
        let ray = &ray.up_to(ray.t_max.min(f32::MAX));
        if self.moves() {
            run(self.simd, AllTask { accel: self, ray, moment: At(time), out });
        } else {
            run(self.simd, AllTask { accel: self, ray, moment: Still, out });
        }
        out[first..].sort_unstable_by(|a, b| {
            let by_t = (a.instance, a.t.to_bits()).cmp(&(b.instance, b.t.to_bits()));
            by_t.then((!a.entering, a.primitive).cmp(&(!b.entering, b.primitive)))
        });
    }

    /// Where and with what orientation the surface is that `ray` hit at `time`.
    #[inline(always)]
    pub fn surface_point(&self, ray: &Ray, time: f32, hit: &Hit) -> SurfacePoint {
        let placement = &self.placements[hit.instance as usize];
        let object = &self.objects[placement.object as usize];
        let mut moved = None;
        let placement =
            if placement.moves() { moved.insert(self.moved(hit.instance, time)) } else { placement };
        surface::surface_point(object, placement, ray, hit)
    }

    /// An object-space normal of `instance` as a unit vector of the world, on the same side of the surface; zero if it
    /// vanishes.
    #[inline]
    pub fn world_normal(&self, instance: u32, time: f32, object_normal: Vec3A) -> Vec3A {
        let placement = &self.placements[instance as usize];
        if placement.moves() {
            return self.moved(instance, time).world_normal(object_normal);
        }
        placement.world_normal(object_normal)
    }

    /// The transform of `instance` at `time` as it is used.
    pub fn world_from_object(&self, instance: u32, time: f32) -> Affine3A {
        let placement = &self.placements[instance as usize];
        if placement.moves() {
            return self.moved(instance, time).world_from_object();
        }
        placement.world_from_object()
    }

    /// Where an instance that moves is at `time`.
    #[cold]
    #[inline(never)]
    fn moved(&self, instance: u32, time: f32) -> Placement {
        let found = self.motions.binary_search_by_key(&instance, |(moving, _)| *moving);
        found.map_or_else(|_| self.placements[instance as usize].clone(), |i| self.motions[i].1.at(time))
    }

    #[inline(always)]
    fn nearest<M: Moment>(&self, ray: &Ray, moment: M) -> Hit {
        // A distance that overflows is not a hit.
        let best =
            Hit { t: ray.t_max.min(f32::MAX), instance: u32::MAX, primitive: u32::MAX, u: 0.0, v: 0.0 };
        run(self.simd, NearestTask { accel: self, ray, moment, best })
    }

    #[inline(always)]
    fn any<M: Moment>(&self, ray: &Ray, moment: M) -> bool {
        run(self.simd, AnyTask { accel: self, ray: &ray.up_to(ray.t_max.min(f32::MAX)), moment })
    }

    /// The object of `instance`.
    pub fn object(&self, instance: u32) -> &Arc<Blas> {
        &self.objects[self.placements[instance as usize].object as usize]
    }

    /// The only instance, when it needs no transform: its object is traced directly.
    #[inline(always)]
    fn direct(&self) -> Option<(u32, &Blas)> {
        let [placement] = self.placements.as_slice() else { return None };
        (placement.is_identity() && self.n_active == 1).then(|| (0, &*self.objects[0]))
    }
}

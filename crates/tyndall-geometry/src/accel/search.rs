//! The three searches: nearest, any, all.

use super::{Accel, Crossing, Hit};
use crate::blas::{Blas, LocalHit};
use crate::bvh::{BoxRay, Kernel, KernelTask, Visit, is_traceable, walk};
use glam::Vec3A;
use std::ops::Range;
use tyndall_math::Ray;

pub(super) struct NearestTask<'a, M> {
    pub(super) accel: &'a Accel,
    pub(super) ray: &'a Ray,
    pub(super) moment: M,
    pub(super) best: Hit,
}

impl<M: Moment> KernelTask for NearestTask<'_, M> {
    type Output = Hit;

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> Hit {
        if let Some((instance, blas)) = self.accel.direct() {
            self.object(kernel, instance, blas, self.ray);
        } else {
            let (nodes, ray) = (&self.accel.bvh.nodes, BoxRay::new(self.ray));
            walk(kernel, nodes, &ray, &mut Instances { kernel, task: &mut self });
        }
        self.best
    }
}

impl<'a, M: Moment> InstanceTask<'a> for NearestTask<'a, M> {
    type Moment = M;
    const ORDERED: bool = true;

    #[inline(always)]
    fn scene(&self) -> (&'a Accel, &'a Ray, f32) {
        (self.accel, self.ray, self.best.t)
    }

    #[inline(always)]
    fn moment(&self) -> M {
        self.moment
    }

    #[inline(always)]
    fn object<K: Kernel>(&mut self, kernel: K, instance: u32, blas: &Blas, ray: &Ray) -> bool {
        let mut local = LocalHit::none(self.best.t);
        blas.nearest(kernel, ray, &mut local);
        // `local` is no farther than `best`; at the same distance the lower instance wins.
        if local.is_some() && (local.t < self.best.t || instance < self.best.instance) {
            let LocalHit { t, primitive, u, v } = local;
            self.best = Hit { t, instance, primitive, u, v };
        }
        false
    }
}

pub(super) struct AnyTask<'a, M> {
    pub(super) accel: &'a Accel,
    pub(super) ray: &'a Ray,
    pub(super) moment: M,
}

impl<M: Moment> KernelTask for AnyTask<'_, M> {
    type Output = bool;

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> bool {
        if let Some((_, blas)) = self.accel.direct() {
            return blas.any(kernel, self.ray);
        }
        let (nodes, ray) = (&self.accel.bvh.nodes, BoxRay::new(self.ray));
        walk(kernel, nodes, &ray, &mut Instances { kernel, task: &mut self })
    }
}

impl<'a, M: Moment> InstanceTask<'a> for AnyTask<'a, M> {
    type Moment = M;
    const ORDERED: bool = false;

    #[inline(always)]
    fn scene(&self) -> (&'a Accel, &'a Ray, f32) {
        (self.accel, self.ray, self.ray.t_max)
    }

    #[inline(always)]
    fn moment(&self) -> M {
        self.moment
    }

    #[inline(always)]
    fn object<K: Kernel>(&mut self, kernel: K, _instance: u32, blas: &Blas, ray: &Ray) -> bool {
        blas.any(kernel, ray)
    }
}

pub(super) struct AllTask<'a, M> {
    pub(super) accel: &'a Accel,
    pub(super) ray: &'a Ray,
    pub(super) moment: M,
    pub(super) out: &'a mut Vec<Crossing>,
}

impl<M: Moment> KernelTask for AllTask<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) {
        let (nodes, ray) = (&self.accel.bvh.nodes, BoxRay::new(self.ray));
        walk(kernel, nodes, &ray, &mut Instances { kernel, task: &mut self });
    }
}

impl<'a, M: Moment> InstanceTask<'a> for AllTask<'a, M> {
    type Moment = M;
    const ORDERED: bool = false;

    #[inline(always)]
    fn scene(&self) -> (&'a Accel, &'a Ray, f32) {
        (self.accel, self.ray, self.ray.t_max)
    }

    #[inline(always)]
    fn moment(&self) -> M {
        self.moment
    }

    #[inline(always)]
    fn object<K: Kernel>(&mut self, kernel: K, instance: u32, blas: &Blas, ray: &Ray) -> bool {
        blas.all(kernel, ray, instance, self.out);
        false
    }
}

/// When a ray is in the scene. Searches are compiled twice: where nothing moves, nobody asks what time it is.
pub(super) trait Moment: Copy {
    /// `ray` in the space of a placed object.
    fn object_ray(self, accel: &Accel, instance: u32, ray: &Ray) -> Ray;
}

/// Nothing moves.
#[derive(Clone, Copy)]
pub(super) struct Still;

impl Moment for Still {
    #[inline(always)]
    fn object_ray(self, accel: &Accel, instance: u32, ray: &Ray) -> Ray {
        accel.placements[instance as usize].object_ray(ray)
    }
}

/// At this time.
#[derive(Clone, Copy)]
pub(super) struct At(pub(super) f32);

impl Moment for At {
    #[inline(always)]
    fn object_ray(self, accel: &Accel, instance: u32, ray: &Ray) -> Ray {
        let placement = &accel.placements[instance as usize];
        if !placement.moves() {
            return placement.object_ray(ray);
        }
        let now = accel.moved(instance, self.0);
        // Without a space of its own it cannot be hit.
        if now.is_singular() { Ray::new(Vec3A::ZERO, Vec3A::ZERO) } else { now.object_ray(ray) }
    }
}

/// What is done with every instance a ray comes near.
trait InstanceTask<'a> {
    type Moment: Moment;
    const ORDERED: bool;

    /// The scene, the world ray and how far it still matters.
    fn scene(&self) -> (&'a Accel, &'a Ray, f32);

    /// When the ray is there.
    fn moment(&self) -> Self::Moment;

    /// Looks at one object with the ray in its space; true ends the search.
    fn object<K: Kernel>(&mut self, kernel: K, instance: u32, blas: &Blas, ray: &Ray) -> bool;
}

/// Walks the top level on behalf of a task.
struct Instances<'t, K, T> {
    kernel: K,
    task: &'t mut T,
}

impl<'a, K: Kernel, T: InstanceTask<'a>> Visit for Instances<'_, K, T> {
    const ORDERED: bool = T::ORDERED;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.task.scene().2
    }

    #[inline(always)]
    fn leaf(&mut self, items: Range<usize>) -> bool {
        for item in items {
            let (accel, ray, t_max) = self.task.scene();
            let instance = accel.bvh.order[item];
            let placement = &accel.placements[instance as usize];
            let local = self.task.moment().object_ray(accel, instance, ray).up_to(t_max);
            let blas = &*accel.objects[placement.object as usize];
            if is_traceable(&local) && self.task.object(self.kernel, instance, blas, &local) {
                return true;
            }
        }
        false
    }
}

//! One instance as the traversal needs it.

use crate::bvh::Bounds;
use glam::{Affine3A, DMat3, DVec3, Mat3, Mat3A, Vec3, Vec3A};
use tyndall_math::Ray;

/// A transform and its inverse. The translation is kept apart: it is subtracted from ray origins *before* the linear
/// part applies, so a small object far away loses nothing but what its distance costs anyway.
#[derive(Debug, Clone)]
pub(crate) struct Placement {
    object_from_world: Mat3,
    world_from_object: Mat3,
    translation: Vec3,
    pub(crate) object: u32,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Identity,
    General,
    Singular,
    /// It is somewhere else at other times.
    Moving,
}

impl Placement {
    pub(crate) fn new(object: u32, world_from_object: &Affine3A) -> Self {
        let linear = Mat3::from(world_from_object.matrix3);
        let translation = Vec3::from(world_from_object.translation);
        let inverse = linear.as_dmat3().inverse();
        let object_from_world = inverse.as_mat3();
        let is_regular = linear.as_dmat3().determinant() != 0.0
            && object_from_world.is_finite()
            && translation.is_finite()
            && linear.is_finite()
            && is_invertible(&linear.as_dmat3(), &inverse);
        let kind = match (is_regular, linear == Mat3::IDENTITY && translation == Vec3::ZERO) {
            (false, _) => Kind::Singular,
            (true, true) => Kind::Identity,
            (true, false) => Kind::General,
        };
        Self { object_from_world, world_from_object: linear, translation, object, kind }
    }

    /// Stands for an instance that moves.
    pub(super) fn moving(self) -> Self {
        Self { kind: Kind::Moving, ..self }
    }

    #[inline(always)]
    pub(super) fn moves(&self) -> bool {
        self.kind == Kind::Moving
    }

    pub(crate) fn is_singular(&self) -> bool {
        self.kind == Kind::Singular
    }

    pub(crate) fn is_identity(&self) -> bool {
        self.kind == Kind::Identity
    }

    /// The box in the world; empty if the instance can't be hit.
    pub(crate) fn world_bounds(&self, object: &Bounds) -> Bounds {
        if self.is_singular() || object.is_empty() {
            return Bounds::EMPTY;
        }
        let world = object.transformed(&Mat3A::from(self.world_from_object), self.translation.into());
        if world.is_finite() { world } else { Bounds::EMPTY }
    }

    /// The ray in object space, at the same parameters.
    #[inline(always)]
    pub(crate) fn object_ray(&self, ray: &Ray) -> Ray {
        if self.kind == Kind::Identity {
            return *ray;
        }
        Ray {
            origin: self.object_from_world * (ray.origin - Vec3A::from(self.translation)),
            direction: self.object_from_world * ray.direction,
            t_max: ray.t_max,
        }
    }

    #[inline(always)]
    pub(crate) fn world_point(&self, object_point: Vec3A) -> Vec3A {
        if self.kind == Kind::Identity {
            return object_point;
        }
        self.world_from_object * object_point + Vec3A::from(self.translation)
    }

    /// By the inverse transpose, which keeps `normal . direction` and so the side, also under mirroring.
    #[inline(always)]
    pub(crate) fn world_normal(&self, object_normal: Vec3A) -> Vec3A {
        if self.kind == Kind::Identity {
            return object_normal.normalize_or_zero();
        }
        let world = (self.object_from_world.transpose() * object_normal).as_dvec3();
        world.normalize_or_zero().as_vec3a()
    }

    pub(crate) fn world_from_object(&self) -> Affine3A {
        Affine3A { matrix3: self.world_from_object.into(), translation: self.translation.into() }
    }

    /// Bound on how far rounding displaces a world point near `object_point`, beyond `object_error`, when it is
    /// transformed to the world here and back as the origin of the next ray; per world axis.
    #[inline(always)]
    pub(crate) fn world_error(&self, object_point: Vec3A, object_error: Vec3A) -> Vec3A {
        if self.kind == Kind::Identity {
            return object_error;
        }
        let gamma = tyndall_math::gamma(4);
        let forth = absolute(&self.world_from_object);
        let back = absolute(&self.object_from_world);
        let relative = forth * object_point.abs();
        let rounding_forth = (relative + Vec3A::from(self.translation).abs()) * gamma;
        // Back: subtracting the translation is exact to half an ulp, the product to gamma(3) of absolute values.
        let rounding_back = forth * (back * relative) * gamma;
        forth * object_error + rounding_forth + rounding_back
    }
}

/// Whether the inverse is one in f32: singular matrices can have a finite inverse that is only noise.
fn is_invertible(matrix: &DMat3, inverse: &DMat3) -> bool {
    let absolute = |m: &DMat3| DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let is_diagonal =
        *matrix == DMat3::from_diagonal(DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z));
    // Skeel's condition number, which uneven scale along the axes doesn't raise.
    let condition = absolute(inverse) * absolute(matrix);
    condition.to_cols_array().iter().all(|x| *x < 1e7) || is_diagonal
}

#[inline(always)]
fn absolute(m: &Mat3) -> Mat3 {
    Mat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

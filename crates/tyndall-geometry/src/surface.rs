//! The point where a ray met a surface, with a bound on its rounding.
//!
//! Computed from barycentrics in object space, never from `origin + t * direction` (Pharr, Jakob, Humphreys 2023,
//! section 6.8). The bound also covers what the *next* ray's test of this and neighbouring triangles rounds, so that
//! an origin moved by it ([`tyndall_math::offset_ray_origin`]) is on its side for the intersector too.

use crate::accel::{Hit, Placement};
use crate::blas::{Blas, sphere_roots};
use glam::{DVec3, Vec3A};
use tyndall_math::{Ray, gamma};

/// Where a surface was hit. World space is camera-relative.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    /// The point in the world.
    pub position: Vec3A,
    /// Bound on the absolute error of each coordinate of `position`.
    pub error: Vec3A,
    /// Unit normal of the surface in the world, on the outward (counter-clockwise) side, not the ray's.
    pub geometric_normal: Vec3A,
    /// The point in object space (of the positions given to [`Blas::from_triangles`]).
    pub object_position: Vec3A,
    /// The unit geometric normal in object space.
    pub object_normal: Vec3A,
    /// Weights of the three corners; (1, 0, 0) for a sphere.
    pub barycentric: [f32; 3],
}

/// Rounding of the leaf test in units of the triangle's size: six chained operations on sheared coordinates, for a
/// triangle as high as it is long.
const TEST_ROUNDING: f32 = gamma(8);

/// Slivers amplify the rounding of their test by length / height. Beyond this, the offset would show.
const MAX_SLIVER: f64 = 32.0;

struct Local {
    position: Vec3A,
    error: Vec3A,
    normal: Vec3A,
    barycentric: [f32; 3],
}

#[inline(always)]
pub(crate) fn surface_point(blas: &Blas, placement: &Placement, ray: &Ray, hit: &Hit) -> SurfacePoint {
    let local = match blas.triangle(hit.primitive) {
        Some(corners) => on_triangle(corners.map(|p| p.as_dvec3()), hit),
        None => on_sphere(&placement.object_ray(ray), hit.t),
    };
    SurfacePoint {
        position: placement.world_point(local.position),
        error: placement.world_error(local.position, local.error),
        geometric_normal: placement.world_normal(local.normal),
        object_position: local.position,
        object_normal: local.normal,
        barycentric: local.barycentric,
    }
}

fn on_triangle([a, b, c]: [DVec3; 3], hit: &Hit) -> Local {
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let (e1, e2) = (b - a, c - a);
    let position = a + e1 * u + e2 * v;
    let cross = e1.cross(e2);
    let size = (b - position).abs().max((c - position).abs()).max((a - position).abs()).max_element();
    let area = cross.length();
    let sliver = (size * size / area).clamp(1.0, MAX_SLIVER);
    let rounding = TEST_ROUNDING * (size * sliver) as f32;
    let position = position.as_vec3a();
    Local {
        position,
        error: position.abs() * gamma(2) + rounding,
        normal: (cross / area).as_vec3a(),
        barycentric: [(1.0 - u - v) as f32, hit.u, hit.v],
    }
}

fn on_sphere(object_ray: &Ray, t: f32) -> Local {
    let (o, d) = (object_ray.origin.as_dvec3(), object_ray.direction.as_dvec3());
    // The root in f64 nearest to the hit, then back onto the sphere.
    let t = f64::from(t);
    let root = sphere_roots(o, d).into_iter().min_by(|x, y| (x - t).abs().total_cmp(&(y - t).abs()));
    let point = (o + d * root.filter(|r| r.is_finite()).unwrap_or(t)).try_normalize().unwrap_or(DVec3::Z);
    let position = point.as_vec3a();
    Local { position, error: position.abs() * gamma(2), normal: position, barycentric: [1.0, 0.0, 0.0] }
}

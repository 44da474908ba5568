//! From a hit to what its surface does with light.

use super::World;
use super::query::SurfaceHit;
use super::surfaces::SurfacePrim;
use glam::Vec3A;
use tyndall_geometry::{SurfacePoint, TriangleMesh};
use tyndall_math::{Ray, Rgb, offset_ray_origin};
use tyndall_scene::prim::Primvar;
use tyndall_shading::{Bsdf, ShadingContext, ShadingFrame};

/// A surface at a hit.
pub(crate) struct Surface {
    /// Position in camera-relative world space.
    pub(crate) position: Vec3A,
    /// Bound of its rounding error per axis.
    pub(crate) error: Vec3A,
    /// Shading frame and geometric normal.
    pub(crate) frame: ShadingFrame,
    /// Scattering.
    pub(crate) bsdf: Bsdf,
    /// Emitted radiance.
    pub(crate) emission: Rgb,
    /// Part of the light that goes straight through, unscattered.
    pub(crate) transparency: Rgb,
}

impl Surface {
    /// A ray origin just behind the surface.
    pub(crate) fn origin_behind(&self, direction: Vec3A) -> Vec3A {
        offset_ray_origin(self.position, self.error, self.frame.geometric_normal, direction)
    }
}

impl World {
    /// The surface at `hit` of `ray`.
    #[inline]
    pub(crate) fn shade(&self, ray: &Ray, hit: &SurfaceHit) -> Surface {
        let hit = &hit.0;
        let point = self.surfaces.accel().surface_point(ray, hit);
        let prim = self.surfaces.prim_of(hit.instance);
        let triangle = hit.primitive as usize;
        let triangles = prim.mesh.triangles();
        let slot = triangles.map_or(0, |t| usize::from(t.subset[triangle]));
        let material = &self.materials[prim.materials[slot] as usize];
        let context = HitContext { prim, triangles, slot, triangle, barycentric: point.barycentric };
        let frame = self.frame(&point, hit.instance, triangles, triangle);
        let (frame, shading) = match material.constant() {
            Some(shading) => (frame, shading),
            None => {
                let shading = material.evaluate(&context);
                let frame =
                    shading.normal.map_or(frame, |normal| self.bend(frame, normal, &context, hit.instance));
                return surface(&point, frame, &shading);
            }
        };
        surface(&point, frame, shading)
    }

    /// The frame of the interpolated normal, or of the surface itself.
    #[inline]
    fn frame(
        &self,
        point: &SurfacePoint,
        instance: u32,
        triangles: Option<&TriangleMesh>,
        triangle: usize,
    ) -> ShadingFrame {
        let Some(normals) = triangles.and_then(|t| t.normals.as_ref()) else {
            return ShadingFrame::flat(point.geometric_normal);
        };
        let [a, b, c] = normals[triangle];
        let [u, v, w] = point.barycentric;
        let interpolated = Vec3A::from(a * u + b * v + c * w);
        let normal = self.surfaces.accel().world_normal(instance, interpolated);
        if normal.length_squared() > 0.5 {
            ShadingFrame::new(point.geometric_normal, normal)
        } else {
            ShadingFrame::flat(point.geometric_normal)
        }
    }

    /// Applies a tangent-space normal along the directions in which the texture coordinates grow.
    #[cold]
    fn bend(&self, frame: ShadingFrame, normal: Vec3A, context: &HitContext, instance: u32) -> ShadingFrame {
        let Some((along_s, along_t)) = context.texture_axes() else { return frame };
        let world_from_object = self.surfaces.accel().world_from_object(instance);
        let tangent = world_from_object.transform_vector3a(along_s);
        let bitangent = world_from_object.transform_vector3a(along_t);
        let handedness = 1f32.copysign(frame.frame.normal.cross(tangent).dot(bitangent));
        frame.with_tangent_space_normal(normal, tangent, handedness)
    }
}

fn surface(point: &SurfacePoint, frame: ShadingFrame, shading: &tyndall_shading::SurfaceShading) -> Surface {
    Surface {
        position: point.position,
        error: point.error,
        frame,
        bsdf: shading.bsdf,
        emission: shading.emission,
        transparency: shading.bsdf.transparency(),
    }
}

/// What a material may ask about a hit.
struct HitContext<'a> {
    prim: &'a SurfacePrim,
    triangles: Option<&'a TriangleMesh>,
    slot: usize,
    triangle: usize,
    barycentric: [f32; 3],
}

impl ShadingContext for HitContext<'_> {
    fn primvar(&self, slot: usize) -> Option<[f32; 4]> {
        let primvar = self.prim.primvars[self.slot].get(slot)?.as_deref()?;
        Some(self.value(primvar))
    }
}

impl HitContext<'_> {
    fn value(&self, primvar: &Primvar) -> [f32; 4] {
        let value = match self.triangles {
            Some(triangles) => triangles.primvar(primvar, self.triangle, self.barycentric),
            // An implicit sphere has constant primvars only.
            None => std::array::from_fn(|i| {
                let absent = if i == 3 { 1.0 } else { 0.0 };
                if i < primvar.components { primvar.values.get(i).copied().unwrap_or(absent) } else { absent }
            }),
        };
        if primvar.components == 1 { [value[0]; 4] } else { value }
    }

    /// Object-space directions in which the first two-component primvar the material reads grows.
    fn texture_axes(&self) -> Option<(Vec3A, Vec3A)> {
        let triangles = self.triangles?;
        let st = self.prim.primvars[self.slot].iter().flatten().find(|p| p.components == 2)?;
        let corner = |weights| {
            let [s, t, ..] = triangles.primvar(st, self.triangle, weights);
            glam::Vec2::new(s, t)
        };
        let (a, b, c) = (corner([1.0, 0.0, 0.0]), corner([0.0, 1.0, 0.0]), corner([0.0, 0.0, 1.0]));
        let [p, q, r] = triangles.triangle(self.triangle).map(Vec3A::from);
        let (e1, e2, d1, d2) = (q - p, r - p, b - a, c - a);
        let determinant = d1.perp_dot(d2);
        (determinant != 0.0)
            .then(|| ((e1 * d2.y - e2 * d1.y) / determinant, (e2 * d1.x - e1 * d2.x) / determinant))
    }
}

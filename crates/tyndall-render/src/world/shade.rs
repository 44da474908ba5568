//! From a hit to what its surface does with light.

use super::World;
use super::query::SurfaceHit;
use super::surfaces::HitSurface;
use glam::{Affine3A, DVec3, Vec3A};
use tyndall_geometry::{SurfacePoint, TriangleMesh};
use tyndall_math::{Ray, offset_ray_origin};
use tyndall_scene::prim::Primvar;
use tyndall_shading::{ShadingContext, ShadingFrame, Space, SurfaceShading};

/// A surface at a hit. Its shading lives in the material, if it is the same everywhere, or in the caller's buffer.
pub(crate) struct Surface<'a> {
    /// Position in camera-relative world space.
    pub(crate) position: Vec3A,
    /// Bound of its rounding error per axis.
    pub(crate) error: Vec3A,
    /// Shading frame and geometric normal.
    pub(crate) frame: ShadingFrame,
    /// Ids of its object and its material, for cryptomattes.
    pub(crate) mattes: [u32; 2],
    /// Scattering, emission, transparency.
    pub(crate) shading: &'a SurfaceShading,
}

impl Surface<'_> {
    /// A ray origin just behind the surface.
    pub(crate) fn origin_behind(&self, direction: Vec3A) -> Vec3A {
        offset_ray_origin(self.position, self.error, self.frame.geometric_normal, direction)
    }
}

/// Room for a shading that varies over its surface. Large, therefore not returned by value.
#[derive(Default)]
pub(crate) struct ShadingBuffer(Option<SurfaceShading>);

impl World {
    /// The surface at `hit` of `ray` at `time`.
    #[inline]
    pub(crate) fn shade<'a>(
        &'a self,
        ray: &Ray,
        time: f32,
        hit: &SurfaceHit,
        buffer: &'a mut ShadingBuffer,
    ) -> Surface<'a> {
        let hit = &hit.0;
        let point = self.surfaces.accel().surface_point(ray, time, hit);
        let of_hit = self.surfaces.surface_of(hit, time);
        let triangles = of_hit.prim.mesh.triangles();
        let slot = triangles.map_or(0, |t| usize::from(t.subset[of_hit.triangle]));
        let material_index = of_hit.prim.materials[slot] as usize;
        let material = &self.materials[material_index];
        let mattes = [of_hit.prim.matte, self.material_names[material_index].id];
        let mut frame = interpolated_frame(&point, &of_hit, triangles);
        let shading = match material.constant() {
            Some(shading) => shading,
            None => {
                let (barycentric, position, origin) = (point.barycentric, point.position, self.origin);
                let context = HitContext { of_hit, triangles, slot, barycentric, position, origin };
                let shading = buffer.0.insert(material.evaluate(&context));
                if let Some(normal) = shading.normal {
                    frame = bend(frame, normal, &context);
                }
                shading
            }
        };
        Surface { position: point.position, error: point.error, frame, mattes, shading }
    }
}

/// The frame of the interpolated normal, or of the surface itself.
#[inline]
fn interpolated_frame(
    point: &SurfacePoint,
    of_hit: &HitSurface,
    triangles: Option<&TriangleMesh>,
) -> ShadingFrame {
    let Some(normals) = triangles.and_then(|t| t.normals.as_ref()) else {
        return ShadingFrame::flat(point.geometric_normal);
    };
    let [a, b, c] = normals[of_hit.triangle];
    let [u, v, w] = point.barycentric;
    let in_object = Vec3A::from(a * u + b * v + c * w);
    match world_normal(&of_hit.world_from_object(), in_object) {
        Some(normal) => ShadingFrame::new(point.geometric_normal, normal),
        None => ShadingFrame::flat(point.geometric_normal),
    }
}

/// An object-space normal as a unit vector of the world: by the cofactors of the transform, which is the inverse
/// transpose up to a factor (the sign of which the frame puts right) and exists for any transform.
#[inline]
fn world_normal(world_from_object: &Affine3A, normal: Vec3A) -> Option<Vec3A> {
    let m = &world_from_object.matrix3;
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let turned = y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
    // Any scale of transform: bring the vector near one before its length is squared.
    let largest = turned.abs().max_element();
    (turned / largest).try_normalize()
}

/// Applies a tangent-space normal along the directions in which the texture coordinates grow.
#[cold]
fn bend(frame: ShadingFrame, normal: Vec3A, context: &HitContext) -> ShadingFrame {
    let Some((along_s, along_t)) = context.texture_axes() else { return frame };
    let world_from_object = context.of_hit.world_from_object();
    let tangent = world_from_object.transform_vector3a(along_s);
    let bitangent = world_from_object.transform_vector3a(along_t);
    let handedness = 1f32.copysign(frame.frame.normal.cross(tangent).dot(bitangent));
    frame.with_tangent_space_normal(normal, tangent, handedness)
}

/// What a material may ask about a hit.
struct HitContext<'a> {
    of_hit: HitSurface<'a>,
    triangles: Option<&'a TriangleMesh>,
    slot: usize,
    barycentric: [f32; 3],
    /// In camera-relative space.
    position: Vec3A,
    /// Of that space, on the stage.
    origin: DVec3,
}

impl ShadingContext for HitContext<'_> {
    fn primvar(&self, slot: usize) -> Option<[f32; 4]> {
        let primvar = self.of_hit.prim.primvars[self.slot].get(slot)?.as_deref()?;
        Some(self.value(primvar))
    }

    fn position(&self, space: Space) -> Vec3A {
        let mesh = &self.of_hit.prim.mesh;
        match space {
            Space::World => (self.position.as_dvec3() + self.origin).as_vec3a(),
            Space::Object => {
                let stored = mesh.object_from_blas().transform_point3(self.stored_position().as_dvec3());
                (stored + mesh.center()).as_vec3a()
            }
            Space::Box => {
                let (min, max) = mesh.blas().bounds();
                let size = max - min;
                Vec3A::select(size.cmpgt(Vec3A::ZERO), (self.stored_position() - min) / size, Vec3A::ZERO)
            }
        }
    }
}

impl HitContext<'_> {
    /// Where the hit is among the positions that the mesh stores.
    fn stored_position(&self) -> Vec3A {
        let Some(triangles) = self.triangles else {
            return self.of_hit.world_from_object().inverse().transform_point3a(self.position);
        };
        let [u, v, w] = self.barycentric;
        let [a, b, c] = triangles.triangle(self.of_hit.triangle).map(Vec3A::from);
        a * u + b * v + c * w
    }

    fn value(&self, primvar: &Primvar) -> [f32; 4] {
        let value = match self.triangles {
            Some(triangles) => triangles.primvar(primvar, self.of_hit.triangle, self.barycentric),
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
        let st = self.of_hit.prim.primvars[self.slot].iter().flatten().find(|p| p.components == 2)?;
        let corner = |weights| {
            let [s, t, ..] = triangles.primvar(st, self.of_hit.triangle, weights);
            glam::Vec2::new(s, t)
        };
        let (a, b, c) = (corner([1.0, 0.0, 0.0]), corner([0.0, 1.0, 0.0]), corner([0.0, 0.0, 1.0]));
        let [p, q, r] = triangles.triangle(self.of_hit.triangle).map(Vec3A::from);
        let (e1, e2, d1, d2) = (q - p, r - p, b - a, c - a);
        let determinant = d1.perp_dot(d2);
        (determinant != 0.0)
            .then(|| ((e1 * d2.y - e2 * d1.y) / determinant, (e2 * d1.x - e1 * d2.x) / determinant))
    }
}

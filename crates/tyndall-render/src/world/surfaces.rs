//! Surfaces: what is placed where, and the structure that rays search.

use super::cache::MeshSource;
use super::context::BuildContext;
use super::materials::Materials;
use super::media::MediaBuilder;
use super::merged::Merged;
use super::place::Place;
use super::placements::{camera_relative, relative_to};
use super::surface_mesh::SurfaceMesh;
use crate::aov::cryptomatte;
use glam::{Affine3A, DAffine3, DVec3, Vec3A};
use std::collections::BTreeMap;
use std::sync::Arc;
use tyndall_geometry::{Accel, Hit, Instance, InstanceKey};
use tyndall_scene::PrimPath;
use tyndall_scene::prim::{Mesh, Primvar, Shape};
use tyndall_shading::CompiledMaterial;

/// A prim's surface: mesh, materials and primvars.
pub(super) struct SurfacePrim {
    pub(super) path: PrimPath,
    /// Id of the path, for cryptomattes.
    pub(super) matte: u32,
    pub(super) mesh: Arc<SurfaceMesh>,
    /// Material of the mesh, then of each subset.
    pub(super) materials: Vec<u32>,
    /// For each material, the primvars it reads, in the order of its slots.
    pub(super) primvars: Vec<Vec<Option<Arc<Primvar>>>>,
}

/// All surfaces of a world.
pub(super) struct Surfaces {
    accel: Accel,
    prims: Vec<SurfacePrim>,
    /// Each placed surface.
    placed: Vec<PlacedSurface>,
    /// Instance 0 of `accel` is this, if it is not empty; instance `n_merged_instances + i` is
    /// `placed[first_instanced + i]`.
    merged: Merged,
    /// Placed surfaces that are not part of `merged` start here.
    first_instanced: usize,
    all_opaque: bool,
    is_emissive: bool,
}

/// A prim at one of its places.
#[derive(Clone, Copy)]
struct PlacedSurface {
    prim: u32,
    /// From the prim's stored positions to the camera-relative world, at the frame's own time.
    world_from_object: Affine3A,
    /// Whether it is somewhere else while the shutter is open.
    moves: bool,
}

/// Which surface a hit is on.
pub(super) struct HitSurface<'a> {
    pub(super) prim: &'a SurfacePrim,
    /// Triangle of the prim's mesh.
    pub(super) triangle: usize,
    placed: &'a PlacedSurface,
    accel: &'a Accel,
    instance: u32,
    time: f32,
}

impl HitSurface<'_> {
    /// Where it is at the time of the hit. Few need to know.
    #[inline]
    pub(super) fn world_from_object(&self) -> Affine3A {
        if self.placed.moves {
            return self.accel.world_from_object(self.instance, self.time);
        }
        self.placed.world_from_object
    }
}

impl Surfaces {
    pub(super) fn accel(&self) -> &Accel {
        &self.accel
    }

    /// The surface a hit at `time` is on.
    #[inline]
    pub(super) fn surface_of(&self, hit: &Hit, time: f32) -> HitSurface<'_> {
        let n_merged_instances = u32::from(!self.merged.is_empty());
        let (placed, triangle) = if hit.instance < n_merged_instances {
            self.merged.resolve(hit.primitive)
        } else {
            (self.first_instanced + (hit.instance - n_merged_instances) as usize, hit.primitive)
        };
        let placed = &self.placed[placed];
        let prim = &self.prims[placed.prim as usize];
        let (accel, instance) = (&self.accel, hit.instance);
        HitSurface { prim, triangle: triangle as usize, placed, accel, instance, time }
    }

    /// Whether every surface stops light.
    pub(super) fn all_opaque(&self) -> bool {
        self.all_opaque
    }

    pub(super) fn is_emissive(&self) -> bool {
        self.is_emissive
    }

    /// The prims' paths.
    pub(super) fn paths(&self) -> impl Iterator<Item = &PrimPath> {
        self.prims.iter().map(|prim| &prim.path)
    }

    pub(super) fn instance_count(&self) -> usize {
        self.placed.len()
    }

    pub(super) fn triangle_count(&self) -> usize {
        self.prims.iter().map(|p| p.mesh.triangles().map_or(0, |t| t.indices.len())).sum()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.accel.memory_bytes() + self.prims.iter().map(|p| p.mesh.memory_bytes()).sum::<usize>()
    }

    pub(super) fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        let (min, max) = self.accel.bounds();
        min.cmple(max).all().then_some((min, max))
    }
}

/// Collects surfaces.
#[derive(Default)]
pub(super) struct SurfacesBuilder {
    prims: Vec<SurfacePrim>,
    merged: Merged,
    placed_merged: Vec<PlacedSurface>,
    placed_instanced: Vec<PlacedSurface>,
    /// Of each placed instance.
    motions: Vec<Vec<InstanceKey>>,
}

impl SurfacesBuilder {
    pub(super) fn add_mesh(
        &mut self,
        path: &PrimPath,
        mesh: &Arc<Mesh>,
        materials: &mut Materials,
        media: &mut MediaBuilder,
        context: &mut BuildContext,
    ) {
        let source = MeshSource::Mesh(Arc::clone(mesh));
        let built =
            context.cache.meshes.get_or_build(path.clone(), source, |_| SurfaceMesh::of_mesh(path, mesh));
        let slots: Vec<usize> = std::iter::once(materials.bound(mesh.material.as_ref(), path, context))
            .chain(mesh.subsets.iter().map(|subset| {
                materials.bound(subset.material.as_ref().or(mesh.material.as_ref()), path, context)
            }))
            .collect();
        let placed = Placed {
            path,
            own: Place::new(mesh.world_from_object, &mesh.motion),
            instancer: mesh.instancer.as_ref(),
            primvars: &mesh.primvars,
            slots,
        };
        self.add(placed, built, materials, media, context);
    }

    pub(super) fn add_shape(
        &mut self,
        path: &PrimPath,
        shape: &Arc<Shape>,
        materials: &mut Materials,
        media: &mut MediaBuilder,
        context: &mut BuildContext,
    ) {
        let source = MeshSource::Shape(Arc::clone(shape));
        let built = context.cache.meshes.get_or_build(path.clone(), source, |_| SurfaceMesh::of_shape(shape));
        let slots = vec![materials.bound(shape.material.as_ref(), path, context)];
        let placed = Placed {
            path,
            own: Place::new(shape.world_from_object, &shape.motion),
            instancer: shape.instancer.as_ref(),
            primvars: &shape.primvars,
            slots,
        };
        self.add(placed, built, materials, media, context);
    }

    fn add(
        &mut self,
        placed: Placed,
        mesh: Arc<SurfaceMesh>,
        materials: &Materials,
        media: &mut MediaBuilder,
        context: &mut BuildContext,
    ) {
        let Placed { path, own, instancer, primvars, slots } = placed;
        context.diagnostics.extend(mesh.diagnostics.clone());
        if mesh.is_empty() {
            return;
        }
        let mut placements = context.placements.of(path, own, instancer, &mut context.diagnostics);
        let n_all = placements.len();
        placements.retain(Place::is_invertible);
        if placements.len() < n_all {
            let what =
                format!("{} of {n_all} placements are singular or not finite", n_all - placements.len());
            context.diagnostics.warn(path, what, "they are not drawn; check the scale of the transform");
        }
        if let Some(volume) = materials.get(slots[0]).volume() {
            media.add_inside(path, &mesh, volume, &placements, context);
        }
        if !materials.get(slots[0]).has_surface() {
            return;
        }
        self.place(&mesh, &placements, context.origin);
        let primvars = read_primvars(&mesh, primvars, slots.iter().map(|&slot| materials.get(slot)));
        let materials = slots.into_iter().map(|slot| slot as u32).collect();
        let matte = cryptomatte::id(super::matte_name(Some(path)));
        self.prims.push(SurfacePrim { path: path.clone(), matte, mesh, materials, primvars });
    }

    /// Adds the next prim at all its places: to the merged triangles if they are few, else as instances.
    fn place(&mut self, mesh: &SurfaceMesh, placements: &[Place], origin: DVec3) {
        let prim = self.prims.len() as u32;
        let triangles =
            mesh.triangles().filter(|t| self.merged.has_room_for(t.len().saturating_mul(placements.len())));
        let relative = |world_from_object: DAffine3| {
            camera_relative(world_from_object * mesh.object_from_blas(), mesh.center(), origin)
        };
        for place in placements {
            let placed = place.at_frame * mesh.object_from_blas();
            let world_from_object = relative(place.at_frame);
            let surface = PlacedSurface { prim, world_from_object, moves: place.moves() };
            if let Some(triangles) = triangles
                && placed.matrix3.determinant() > 0.0
                && !place.moves()
            {
                self.merged.add(triangles, relative_to(placed, mesh.center(), origin));
                self.placed_merged.push(surface);
            } else {
                self.placed_instanced.push(surface);
                self.motions.push(place.instance_keys(relative));
            }
        }
    }

    pub(super) fn finish(mut self, materials: &Materials) -> Surfaces {
        let used = || self.prims.iter().flat_map(|p| &p.materials).map(|&m| materials.get(m as usize));
        let all_opaque = used().all(CompiledMaterial::is_opaque);
        let is_emissive = used().any(CompiledMaterial::is_emissive);
        let mut instances = Vec::with_capacity(1 + self.placed_instanced.len());
        instances.extend(self.merged.build());
        instances.extend(self.placed_instanced.iter().zip(self.motions).map(|(placed, motion)| Instance {
            blas: Arc::clone(self.prims[placed.prim as usize].mesh.blas()),
            world_from_object: placed.world_from_object,
            motion,
        }));
        let first_instanced = self.placed_merged.len();
        let mut placed = self.placed_merged;
        placed.extend(self.placed_instanced);
        Surfaces {
            all_opaque,
            is_emissive,
            accel: Accel::build(instances),
            prims: self.prims,
            placed,
            merged: self.merged,
            first_instanced,
        }
    }
}

/// For each material the primvars it reads, refined like the mesh; those nobody reads are not touched.
fn read_primvars<'a>(
    mesh: &SurfaceMesh,
    primvars: &BTreeMap<String, Primvar>,
    materials: impl Iterator<Item = &'a CompiledMaterial>,
) -> Vec<Vec<Option<Arc<Primvar>>>> {
    let mut refined = BTreeMap::<String, Arc<Primvar>>::new();
    let mut lookup = |name: &String| {
        let primvar = primvars.get(name)?;
        let entry = refined.entry(name.clone()).or_insert_with(|| {
            Arc::new(mesh.triangles().map_or_else(|| primvar.clone(), |t| t.refine(primvar).into_owned()))
        });
        Some(Arc::clone(entry))
    };
    materials.map(|material| material.required_primvars().iter().map(&mut lookup).collect()).collect()
}

/// A prim on its way into the world.
struct Placed<'a> {
    path: &'a PrimPath,
    own: Place,
    instancer: Option<&'a PrimPath>,
    primvars: &'a BTreeMap<String, Primvar>,
    slots: Vec<usize>,
}

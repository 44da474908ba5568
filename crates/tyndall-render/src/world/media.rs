//! Participating media and the boundaries that hold them.

use super::context::BuildContext;
use super::grids::{self, LoadedField};
use super::materials::Materials;
use super::placements::{camera_relative, is_invertible, relative_to};
use super::surfaces::{ShapeOfSurface, SurfaceMesh};
use glam::{DAffine3, DVec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::{Boundaries, BoundaryShape};
use tyndall_math::Rgb;
use tyndall_scene::PrimPath;
use tyndall_scene::prim;
use tyndall_shading::VolumeMaterial;
use tyndall_volume::{BrickGrid, GridDensity, Medium, Phase};

/// Single-scattering albedo of a volume without a material: smoke that is neither black nor white, in agreement with
/// what a grey card reflects. A diagnostic says so.
const UNBOUND_ALBEDO: f32 = 0.5;

/// The media of a world; medium `i` fills boundary `i`.
pub(super) struct Media {
    list: Vec<Medium>,
    boundaries: Boundaries,
    bounds: Option<(Vec3A, Vec3A)>,
    grid_bytes: usize,
}

impl Media {
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub(super) fn list(&self) -> &[Medium] {
        &self.list
    }

    pub(super) fn boundaries(&self) -> &Boundaries {
        &self.boundaries
    }

    /// Smallest box around the bounded media.
    pub(super) fn bounds(&self) -> Option<(Vec3A, Vec3A)> {
        self.bounds
    }

    pub(super) fn is_emissive(&self) -> bool {
        self.list.iter().any(|m| m.emission != Rgb::ZERO)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.grid_bytes
    }
}

/// Collects media.
#[derive(Default)]
pub(super) struct MediaBuilder {
    list: Vec<Medium>,
    shapes: Vec<BoundaryShape>,
    bounds: Option<(Vec3A, Vec3A)>,
    grids: Vec<Arc<BrickGrid>>,
}

impl MediaBuilder {
    /// Adds the homogeneous medium inside a closed surface, once per placement.
    pub(super) fn add_inside(
        &mut self,
        path: &PrimPath,
        mesh: &SurfaceMesh,
        material: &VolumeMaterial,
        placements: &[DAffine3],
        context: &mut BuildContext,
    ) {
        let is_filled = material.density_field.is_some() || material.emission_field.is_some();
        if is_filled {
            let action = "the field counts as 1 everywhere; bind the material to a Volume prim";
            context.diagnostics.warn(
                path,
                "a volume material that reads a field is bound to a surface",
                action,
            );
        }
        if !mesh.is_closed() {
            context.diagnostics.warn(
                path,
                "the boundary of its medium is not closed",
                "the medium ends at the boundary's bounding box where a hole leaves it open; close the mesh",
            );
        }
        let medium = homogeneous(material);
        for world_from_object in placements {
            let shape = match mesh.shape() {
                ShapeOfSurface::Cube => BoundaryShape::Box {
                    world_from_box: relative_to(
                        *world_from_object * mesh.object_from_unit(),
                        DVec3::ZERO,
                        context.origin,
                    ),
                },
                ShapeOfSurface::Sphere => BoundaryShape::Sphere {
                    world_from_sphere: relative_to(
                        *world_from_object * mesh.object_from_unit(),
                        DVec3::ZERO,
                        context.origin,
                    ),
                },
                ShapeOfSurface::Triangles => BoundaryShape::Mesh {
                    blas: Arc::clone(mesh.blas()),
                    world_from_object: camera_relative(*world_from_object, mesh.center(), context.origin),
                },
            };
            let (min, max) = mesh.blas().bounds();
            let to_world =
                camera_relative(*world_from_object * mesh.object_from_blas(), mesh.center(), context.origin);
            self.grow(box_corners(min, max).map(|p| to_world.transform_point3a(p)));
            self.list.push(medium.clone());
            self.shapes.push(shape);
        }
    }

    /// Adds a volume prim: a medium filled by grids, or all of space if it has no fields.
    pub(super) fn add_volume(
        &mut self,
        path: &PrimPath,
        volume: &prim::Volume,
        materials: &mut Materials,
        context: &mut BuildContext,
    ) {
        let Some(material) = volume_material(path, volume, materials, context) else { return };
        if volume.fields.is_empty() {
            self.list.push(homogeneous(&material));
            self.shapes.push(BoundaryShape::Unbounded);
            return;
        }
        let Some(wanted) = material.density_field.clone().or_else(|| material.emission_field.clone()) else {
            let action = "its extent is that of its first field, with density 1 inside";
            context.diagnostics.warn(path, "the volume's material reads none of its fields", action);
            self.add_filled(path, volume, &volume.fields[0].1, &material, false, context);
            return;
        };
        if material.emission_field.as_ref().is_some_and(|e| *e != wanted) {
            let what = format!("emission from a second field ({:?})", material.emission_field);
            context.diagnostics.warn(path, what, "emission follows the density field in this version");
        }
        let Some((_, field)) = volume.fields.iter().find(|(name, _)| *name == wanted) else {
            let known: Vec<_> = volume.fields.iter().map(|(name, _)| name.as_str()).collect();
            let what =
                format!("the material reads the field {wanted:?}; the volume has {}", known.join(", "));
            context.diagnostics.error(path, what, "the volume is not drawn; rename the field relationship");
            return;
        };
        self.add_filled(path, volume, field, &material, true, context);
    }

    fn add_filled(
        &mut self,
        path: &PrimPath,
        volume: &prim::Volume,
        field: &PrimPath,
        material: &VolumeMaterial,
        is_density: bool,
        context: &mut BuildContext,
    ) {
        let Some(loaded) = grids::load(path, field, context) else { return };
        let Some([min, max]) = loaded.grid.bounds() else { return };
        let instances = context.placements.of(
            path,
            DAffine3::IDENTITY,
            volume.instancer.as_ref(),
            &mut context.diagnostics,
        );
        for world_from_instance in instances {
            let world_from_index = world_from_instance * loaded.world_from_index;
            if !is_invertible(&world_from_index) {
                context.diagnostics.warn(
                    field,
                    "its transform is singular or not finite",
                    "the volume is not drawn",
                );
                continue;
            }
            self.place(
                &loaded,
                relative_to(world_from_index, DVec3::ZERO, context.origin),
                min,
                max,
                material,
                is_density,
            );
        }
        self.grids.push(loaded.grid);
    }

    fn place(
        &mut self,
        loaded: &LoadedField,
        world_from_index: DAffine3,
        min: Vec3A,
        max: Vec3A,
        material: &VolumeMaterial,
        is_density: bool,
    ) {
        let (center, half) = ((min + max).as_dvec3() * 0.5, (max - min).as_dvec3() * 0.5);
        let world_from_box =
            world_from_index * DAffine3::from_scale_rotation_translation(half, glam::DQuat::IDENTITY, center);
        self.grow(box_corners(min, max).map(|p| world_from_index.transform_point3(p.as_dvec3()).as_vec3a()));
        let mut medium = homogeneous(material);
        if is_density {
            let grid = Arc::clone(&loaded.grid);
            medium.density =
                Some(GridDensity { grid, index_from_world: world_from_index.inverse().as_affine3a() });
        }
        self.list.push(medium);
        self.shapes.push(BoundaryShape::Box { world_from_box });
    }

    pub(super) fn finish(self) -> Media {
        let grid_bytes = self.grids.iter().map(|g| g.memory_bytes()).sum();
        Media { list: self.list, boundaries: Boundaries::build(self.shapes), bounds: self.bounds, grid_bytes }
    }

    fn grow(&mut self, points: [Vec3A; 8]) {
        for p in points.into_iter().filter(|p| p.is_finite()) {
            let (min, max) = self.bounds.unwrap_or((p, p));
            self.bounds = Some((min.min(p), max.max(p)));
        }
    }
}

fn homogeneous(material: &VolumeMaterial) -> Medium {
    Medium {
        sigma_a: material.sigma_a,
        sigma_s: material.sigma_s,
        emission: material.emission,
        phase: Phase::HenyeyGreenstein { g: material.g },
        density: None,
    }
}

/// The volume half of the bound material; without a binding, extinction = density with a grey albedo.
fn volume_material(
    path: &PrimPath,
    volume: &prim::Volume,
    materials: &mut Materials,
    context: &mut BuildContext,
) -> Option<VolumeMaterial> {
    if let Some(bound) = &volume.material {
        let index = materials.bound(Some(bound), path, context);
        let material = materials.get(index).volume().cloned();
        if material.is_none() {
            let what = format!("the bound material <{bound}> has no volume terminal");
            context.diagnostics.error(path, what, "the volume is not drawn; connect outputs:volume");
        }
        return material;
    }
    let (name, _) = volume.fields.iter().find(|(name, _)| name == "density").or(volume.fields.first())?;
    context.diagnostics.warn(
        path,
        "the volume has no material",
        format!("extinction = field {name:?}, with albedo {UNBOUND_ALBEDO}; bind a material with a volume terminal"),
    );
    Some(VolumeMaterial {
        sigma_a: Rgb::splat(1.0 - UNBOUND_ALBEDO),
        sigma_s: Rgb::splat(UNBOUND_ALBEDO),
        emission: Rgb::ZERO,
        g: 0.0,
        density_field: Some(name.clone()),
        emission_field: None,
    })
}

fn box_corners(min: Vec3A, max: Vec3A) -> [Vec3A; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3A::new(pick(0), pick(1), pick(2))
    })
}

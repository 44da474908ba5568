//! Participating media and the boundaries that hold them.

mod parts;

use super::context::BuildContext;
use super::grids::{self, LoadedField};
use super::materials::Materials;
use super::placements::{camera_relative, is_invertible, relative_to};
use super::surfaces::{ShapeOfSurface, SurfaceMesh};
use glam::{DAffine3, DVec3, Vec3A};
use parts::{Part, homogeneous, parts};
use std::sync::Arc;
use tyndall_geometry::{Boundaries, BoundaryShape};
use tyndall_math::Rgb;
use tyndall_scene::PrimPath;
use tyndall_scene::prim;
use tyndall_shading::{PhaseModel, VolumeMaterial};
use tyndall_volume::{BrickGrid, GridDensity, Medium};

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
        self.list.iter().any(Medium::emits)
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
        if material.reads_fields() {
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

    /// Adds a volume prim: media filled by grids, or one in all of space if it has no fields.
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
        let parts = parts(&material);
        let extent = volume_extent(&parts, volume);
        let Some(wanted) = wanted_fields(path, volume, &parts, context) else { return };
        let instances = context.placements.of(
            path,
            DAffine3::IDENTITY,
            volume.instancer.as_ref(),
            &mut context.diagnostics,
        );
        for (name, field) in wanted {
            let Some(loaded) = grids::load(path, field, context) else { continue };
            for world_from_instance in &instances {
                let world_from_index = *world_from_instance * loaded.world_from_index;
                if !is_invertible(&world_from_index) {
                    let what = "its transform is singular or not finite";
                    context.diagnostics.warn(field, what, "the volume is drawn without this field");
                    continue;
                }
                let world_from_index = relative_to(world_from_index, DVec3::ZERO, context.origin);
                for part in &parts {
                    if part.field.as_ref().unwrap_or(&extent) == name {
                        self.place(&loaded, world_from_index, part);
                    }
                }
            }
            self.grids.push(loaded.grid);
        }
    }

    /// Adds `part` inside the box of a grid, with the grid as its density if it has a field.
    fn place(&mut self, loaded: &LoadedField, world_from_index: DAffine3, part: &Part) {
        let Some([min, max]) = loaded.grid.bounds() else { return };
        let (center, half) = ((min + max).as_dvec3() * 0.5, (max - min).as_dvec3() * 0.5);
        let world_from_box =
            world_from_index * DAffine3::from_scale_rotation_translation(half, glam::DQuat::IDENTITY, center);
        self.grow(box_corners(min, max).map(|p| world_from_index.transform_point3(p.as_dvec3()).as_vec3a()));
        let density = part.field.as_ref().map(|_| GridDensity {
            grid: Arc::clone(&loaded.grid),
            index_from_world: world_from_index.inverse().as_affine3a(),
        });
        self.list.push(Medium { density, ..part.medium.clone() });
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

/// Names and prims of the fields that the parts need, each once; `None`, with a message, if the density is missing.
fn wanted_fields<'a>(
    path: &PrimPath,
    volume: &'a prim::Volume,
    parts: &[Part],
    context: &mut BuildContext,
) -> Option<Vec<&'a (String, PrimPath)>> {
    let extent = volume_extent(parts, volume);
    let mut wanted: Vec<&(String, PrimPath)> = Vec::new();
    for part in parts {
        if part.field.is_none() {
            report_constant(path, part, &extent, context);
        }
        let name = part.field.as_ref().unwrap_or(&extent);
        match volume.fields.iter().find(|(known, _)| known == name) {
            Some(field) if wanted.iter().any(|(known, _)| *known == field.0) => {}
            Some(field) => wanted.push(field),
            None => {
                report_missing(path, volume, name, part, context);
                if part.has_extinction() {
                    return None;
                }
            }
        }
    }
    Some(wanted)
}

/// The field whose box holds what has no field: the first that the material reads, or the volume's first.
fn volume_extent(parts: &[Part], volume: &prim::Volume) -> String {
    let read = parts.iter().filter_map(|part| part.field.as_ref());
    let present = |name: &&String| volume.fields.iter().any(|(known, _)| known == *name);
    read.into_iter().find(present).unwrap_or(&volume.fields[0].0).clone()
}

fn report_constant(path: &PrimPath, part: &Part, extent: &str, context: &mut BuildContext) {
    let what = if part.has_extinction() {
        "the coefficients of the volume's material read none of its fields"
    } else {
        "the emission of the volume's material is constant"
    };
    let action = format!("it fills the bounding box of the field {extent:?}; multiply it by a field");
    context.diagnostics.warn(path, what, action);
}

fn report_missing(
    path: &PrimPath,
    volume: &prim::Volume,
    name: &str,
    part: &Part,
    context: &mut BuildContext,
) {
    let known: Vec<_> = volume.fields.iter().map(|(name, _)| name.as_str()).collect();
    let what = format!("the material reads the field {name:?}; the volume has {}", known.join(", "));
    if part.has_extinction() {
        context.diagnostics.error(path, what, "the volume is not drawn; rename the field relationship");
    } else {
        context.diagnostics.warn(path, what, "that emission is left out; rename the field relationship");
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
        density_field: Some(name.clone()),
        phase: PhaseModel::lobe(0.0),
        emission: Vec::new(),
    })
}

fn box_corners(min: Vec3A, max: Vec3A) -> [Vec3A; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3A::new(pick(0), pick(1), pick(2))
    })
}

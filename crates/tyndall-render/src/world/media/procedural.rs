//! Media that a program describes, inside closed surfaces or in the box of a volume's fields.

use super::super::bake::{BakeSource, Baked, FieldSampler, FieldVoxels, Layer};
use super::super::context::BuildContext;
use super::super::grids;
use super::super::placements::relative_to;
use super::super::surface_mesh::SurfaceMesh;
use super::MediaBuilder;
use super::parts::{homogeneous, phase};
use glam::{DAffine3, DVec3, Vec3A};
use std::sync::Arc;
use tyndall_geometry::BoundaryShape;
use tyndall_math::Rgb;
use tyndall_scene::prim::{self, Prim};
use tyndall_scene::{PrimPath, Severity};
use tyndall_shading::{PhaseModel, VolumeMaterial, VolumeProgram};
use tyndall_volume::{Emission, GridDensity, Medium, Tint};

/// Errors of interpolation above this are worth a message.
const VISIBLE_ERROR: f64 = 0.08;

/// A procedural medium on its way into the world.
pub(super) struct Procedural<'a> {
    pub(super) path: &'a PrimPath,
    pub(super) program: &'a Arc<VolumeProgram>,
    pub(super) phase: PhaseModel,
}

impl Procedural<'_> {
    /// The media of a box of the object at one of its places, in grids.
    fn media(&self, baked: &Baked, world_from_object: DAffine3, origin: DVec3) -> Vec<Medium> {
        let world_from_index = relative_to(world_from_object * baked.object_from_index, DVec3::ZERO, origin);
        let index_from_world = world_from_index.inverse().as_affine3a();
        let medium = |Layer { ratio: [sigma_a, sigma_s, glow], density, colors }: &Layer| {
            let is_tinted = colors.is_some();
            let plain = |c: Rgb| if is_tinted { Rgb::ZERO } else { c };
            Medium {
                sigma_a: plain(*sigma_a),
                sigma_s: plain(*sigma_s),
                emission: Emission::Glow(plain(*glow)),
                phase: phase(self.phase),
                density: Some(GridDensity { grid: Arc::clone(density), index_from_world }),
                tint: colors.as_ref().map(|grid| Tint {
                    grid: Arc::clone(grid),
                    index_from_world,
                    is_relative: true,
                    sigma_a: *sigma_a,
                    sigma_s: *sigma_s,
                    glow: *glow,
                    most: 1.0,
                }),
            }
        };
        baked.layers.iter().map(medium).collect()
    }

    /// The program over a box of the object, sampled or found in the cache. Placements differ only if it reads the world.
    fn bake(
        &self,
        space: &ObjectBox,
        placement: (usize, DAffine3),
        context: &mut BuildContext,
    ) -> Arc<Baked> {
        let reads_world = self.program.reads_world();
        let source = BakeSource {
            program: Arc::clone(self.program),
            min: space.min,
            max: space.max,
            world_from_object: if reads_world { placement.1 } else { DAffine3::IDENTITY },
            fields: space.fields.clone(),
            least_cells: space.least_cells,
            resolution: context.procedural_resolution,
        };
        let key = (self.path.clone(), if reads_world { placement.0 } else { 0 });
        let baked = context.cache.baked.get_or_build(key, source, BakeSource::bake);
        if baked.error > VISIBLE_ERROR {
            let percent = 100.0 * baked.error;
            let what =
                format!("its procedural medium varies within voxels, by about {percent:.0} % of its mean");
            let action = "raise proceduralResolution if detail is missing";
            context.diagnostics.report(Severity::Info, self.path, what, action);
        }
        baked
    }
}

/// Where a procedural medium is, in the space of its object, and what it may read there.
pub(super) struct ObjectBox {
    pub(super) min: DVec3,
    pub(super) max: DVec3,
    pub(super) fields: Vec<Option<FieldSampler>>,
    pub(super) least_cells: [u32; 3],
}

impl ObjectBox {
    /// The box of a surface, which has no fields.
    pub(super) fn of_surface(mesh: &SurfaceMesh, program: &VolumeProgram) -> Self {
        let [min, max] = mesh.object_bounds();
        Self { min, max, fields: vec![None; program.fields().len()], least_cells: [1; 3] }
    }

    /// The box around the fields of a volume that a program reads, or around all of them if it reads none, with no fewer
    /// cells than they have voxels; and the transform that places it. `None` if no field can be read.
    fn of_volume(
        path: &PrimPath,
        volume: &prim::Volume,
        program: &VolumeProgram,
        context: &mut BuildContext,
    ) -> Option<(Self, DAffine3)> {
        let names = program.fields();
        let mut fields = vec![None; names.len()];
        let mut space: Option<(Self, DAffine3)> = None;
        for (name, field_path) in &volume.fields {
            let slot = names.iter().position(|wanted| wanted == name);
            if slot.is_none() && !names.is_empty() {
                continue;
            }
            let Some(Prim::Field(field)) = context.scene.get(field_path) else { continue };
            let own = field.world_from_field;
            let Some(loaded) = grids::load_density(path, field_path, context) else { continue };
            let world_from_object = space.as_ref().map_or(own, |(_, world)| *world);
            let object_from_index = world_from_object.inverse() * loaded.world_from_index;
            let Some(bounds) = loaded.grid.bounds() else { continue };
            let of_field = Self::around(bounds, object_from_index);
            match &mut space {
                Some((space, _)) => space.join(&of_field),
                None => space = Some((of_field, own)),
            }
            let voxels = match grids::holds_colors(field_path, context) {
                true => {
                    grids::load_colors(path, field_path, context).map(|found| FieldVoxels::Colors(found.grid))
                }
                false => Some(FieldVoxels::Numbers(loaded.grid)),
            };
            if let (Some(slot), Some(voxels)) = (slot, voxels) {
                fields[slot] = Some(FieldSampler { voxels, index_from_object: object_from_index.inverse() });
            }
        }
        space.map(|(space, world_from_object)| (Self { fields, ..space }, world_from_object))
    }

    /// A box of voxels.
    fn around([lo, hi]: [Vec3A; 2], object_from_index: DAffine3) -> Self {
        let corners = super::box_corners(lo, hi).map(|p| object_from_index.transform_point3(p.as_dvec3()));
        let min = corners.into_iter().reduce(DVec3::min).unwrap_or_default();
        let max = corners.into_iter().reduce(DVec3::max).unwrap_or_default();
        let m = object_from_index.matrix3;
        let voxel =
            [m.x_axis, m.y_axis, m.z_axis].map(DVec3::abs).into_iter().reduce(DVec3::max).unwrap_or_default();
        let cells = ((max - min) / voxel).round();
        let least_cells = cells.to_array().map(|n| if n.is_finite() { n.max(1.0) as u32 } else { 1 });
        Self { min, max, fields: Vec::new(), least_cells }
    }

    /// Grows to hold another box with voxels no larger than those of either.
    fn join(&mut self, other: &Self) {
        let finer = |a: &Self, axis: usize| f64::from(a.least_cells[axis]) / (a.max - a.min)[axis];
        let (min, max) = (self.min.min(other.min), self.max.max(other.max));
        self.least_cells = std::array::from_fn(|axis| {
            let per_unit = finer(self, axis).max(finer(other, axis));
            let cells = (per_unit * (max - min)[axis]).round();
            if cells.is_finite() { cells.max(1.0) as u32 } else { 1 }
        });
        (self.min, self.max) = (min, max);
    }
}

impl MediaBuilder {
    /// Adds a procedural medium inside a closed surface, once per placement.
    pub(super) fn add_procedural(
        &mut self,
        procedural: &Procedural<'_>,
        mesh: &SurfaceMesh,
        placements: &[DAffine3],
        context: &mut BuildContext,
    ) {
        let space = ObjectBox::of_surface(mesh, procedural.program);
        for (i, world_from_object) in placements.iter().enumerate() {
            let baked = procedural.bake(&space, (i, *world_from_object), context);
            self.grow_around(mesh, *world_from_object, context.origin);
            for medium in procedural.media(&baked, *world_from_object, context.origin) {
                self.count_grids(&medium, i);
                self.list.push(medium);
                self.shapes.push(super::shape_of(mesh, *world_from_object, context.origin));
            }
        }
    }

    /// Adds a procedural medium in the box of a volume's fields, once per placement.
    pub(super) fn add_procedural_volume(
        &mut self,
        procedural: &Procedural<'_>,
        volume: &prim::Volume,
        placements: &[DAffine3],
        context: &mut BuildContext,
    ) {
        let path = procedural.path;
        for name in procedural.program.fields() {
            if super::field_of(volume, name).is_none() {
                let known: Vec<_> = volume.fields.iter().map(|(name, _)| name.as_str()).collect();
                let what =
                    format!("the material reads the field {name:?}; the volume has {}", known.join(", "));
                context.diagnostics.warn(path, what, "its default was used; rename the field relationship");
            }
        }
        let Some((space, world_from_object)) =
            ObjectBox::of_volume(path, volume, procedural.program, context)
        else {
            return;
        };
        for (i, world_from_instance) in placements.iter().enumerate() {
            let world_from_object = *world_from_instance * world_from_object;
            let baked = procedural.bake(&space, (i, world_from_object), context);
            let Some(placed) = super::placed(world_from_object, path, context) else { continue };
            let (center, half) = ((space.min + space.max) * 0.5, (space.max - space.min) * 0.5);
            let world_from_box = placed * DAffine3::from_translation(center) * DAffine3::from_scale(half);
            let corners = super::box_corners(Vec3A::NEG_ONE, Vec3A::ONE);
            self.grow(corners.map(|p| world_from_box.transform_point3(p.as_dvec3()).as_vec3a()));
            for medium in procedural.media(&baked, world_from_object, context.origin) {
                self.count_grids(&medium, i);
                self.list.push(medium);
                self.shapes.push(BoundaryShape::Box { world_from_box });
            }
        }
    }

    /// Counts the memory of the grids of a medium at its first placement.
    fn count_grids(&mut self, medium: &Medium, placement: usize) {
        if placement == 0 {
            let grid = medium.density.as_ref().map_or(0, |density| density.grid.memory_bytes());
            let colors = medium.tint.as_ref().map_or(0, |tint| tint.grid.memory_bytes());
            self.grid_bytes += grid + colors;
        }
    }
}

/// A procedural medium in all of space, as its mean over the unit cube, with a message.
pub(super) fn mean_of_all_space(
    path: &PrimPath,
    material: &VolumeMaterial,
    program: &Arc<VolumeProgram>,
    context: &mut BuildContext,
) -> Medium {
    let what = "its procedural medium fills all of space";
    let action = "its mean over the unit cube is used everywhere; put it inside a large mesh";
    context.diagnostics.warn(path, what, action);
    let source = BakeSource {
        program: Arc::clone(program),
        min: DVec3::ZERO,
        max: DVec3::ONE,
        world_from_object: DAffine3::IDENTITY,
        fields: vec![None; program.fields().len()],
        least_cells: [1; 3],
        resolution: 1,
    };
    let mean = source.mean();
    Medium {
        sigma_a: mean.sigma_a,
        sigma_s: mean.sigma_s,
        emission: Emission::Glow(mean.emission),
        ..homogeneous(material)
    }
}

//! Participating media and the boundaries that hold them.

mod fields;
mod parts;
mod procedural;
mod roles;

use super::context::BuildContext;
use super::grids::{self, LoadedField};
use super::materials::Materials;
use super::place::Place;
use super::placements::{camera_relative, is_invertible, relative_to};
use super::surface_mesh::{ShapeOfSurface, SurfaceMesh};
use fields::{field_of, has_all_fields, volume_extent};
use glam::{DAffine3, DVec3, Vec3A};
use parts::{Part, PartTint, homogeneous, parts};
use procedural::Procedural;
use std::collections::BTreeMap;
use std::sync::Arc;
use tyndall_geometry::{Boundaries, BoundaryShape};
use tyndall_math::Rgb;
use tyndall_scene::PrimPath;
use tyndall_scene::prim;
use tyndall_shading::{PhaseModel, VolumeMaterial};
use tyndall_volume::{BrickGrid, ColorGrid, GridDensity, Medium, Tint};

/// Single-scattering albedo of a volume without a material: smoke that is neither black nor white, in agreement with
/// what a grey card reflects. A diagnostic says so.
const UNBOUND_ALBEDO: f32 = 0.5;

/// Optical depths below this cannot be seen.
const VISIBLE_DEPTH: f32 = 1e-4;

/// The media of a world; medium `i` fills boundary `i`.
pub(super) struct Media {
    list: Vec<Medium>,
    boundaries: Boundaries,
    bounds: Option<(Vec3A, Vec3A)>,
    is_dense: bool,
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

    /// Whether the rounding of positions shows in the optical depth of some medium. Grids don't count: at their edge the
    /// density begins with 0.
    pub(super) fn is_dense(&self) -> bool {
        self.is_dense
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
    grid_bytes: usize,
}

impl MediaBuilder {
    /// Adds the homogeneous medium inside a closed surface, once per placement.
    pub(super) fn add_inside(
        &mut self,
        path: &PrimPath,
        mesh: &SurfaceMesh,
        material: &VolumeMaterial,
        places: &[Place],
        context: &mut BuildContext,
    ) {
        let placements = &held_still(path, places, context);
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
        if let Some(program) = &material.program {
            self.add_procedural(
                &Procedural { path, program, phase: material.phase },
                mesh,
                placements,
                context,
            );
            return;
        }
        let medium = homogeneous(material);
        for world_from_object in placements {
            self.grow_around(mesh, *world_from_object, context.origin);
            self.list.push(medium.clone());
            self.shapes.push(shape_of(mesh, *world_from_object, context.origin));
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
            self.list.push(match &material.program {
                Some(program) => procedural::mean_of_all_space(path, &material, program, context),
                None => homogeneous(&material),
            });
            self.shapes.push(BoundaryShape::Unbounded);
            return;
        }
        let instances = |context: &mut BuildContext| {
            let BuildContext { placements, diagnostics, .. } = context;
            let own = Place::new(DAffine3::IDENTITY, &[]);
            let places = placements.of(path, own, volume.instancer.as_ref(), diagnostics);
            held_still(path, &places, context)
        };
        if let Some(program) = &material.program {
            let placements = instances(context);
            let procedural = Procedural { path, program, phase: material.phase };
            self.add_procedural_volume(&procedural, volume, &placements, context);
            return;
        }
        let mut parts = parts(&material);
        if !has_all_fields(path, volume, &mut parts, context) {
            return;
        }
        roles::assign(path, volume, &mut parts, context);
        let extent = volume_extent(&parts, volume);
        let colors = load_tints(path, volume, &parts, context);
        let instances = instances(context);
        for (name, field) in &volume.fields {
            let of_field: Vec<&Part> =
                parts.iter().filter(|part| part.field.as_ref().unwrap_or(&extent) == name).collect();
            if of_field.is_empty() {
                continue;
            }
            let Some(loaded) = grids::load_density(path, field, context) else { continue };
            for world_from_instance in &instances {
                let place = |world_from_index: DAffine3, field: &PrimPath, context: &mut BuildContext| {
                    placed(*world_from_instance * world_from_index, field, context)
                };
                let Some(world_from_index) = place(loaded.world_from_index, field, context) else { continue };
                for part in &of_field {
                    let tint = part.tint.as_ref().and_then(|tint| {
                        let (field, colors) = colors.get(&tint.field)?;
                        let world_from_index = place(colors.world_from_index, field, context)?;
                        Some(tint_of(part, tint, colors, world_from_index, field, context))
                    });
                    if part.tint.is_some() == tint.is_some() {
                        self.place(&loaded, world_from_index, part, tint);
                    }
                }
            }
            self.grid_bytes += loaded.grid.memory_bytes();
        }
        self.grid_bytes += colors.values().map(|(_, colors)| colors.grid.memory_bytes()).sum::<usize>();
    }

    /// Adds `part` inside the box of a grid, with the grid as its density if it has a field.
    fn place(
        &mut self,
        loaded: &LoadedField<BrickGrid>,
        world_from_index: DAffine3,
        part: &Part,
        tint: Option<Tint>,
    ) {
        let Some([min, max]) = loaded.grid.bounds() else { return };
        let (center, half) = ((min + max).as_dvec3() * 0.5, (max - min).as_dvec3() * 0.5);
        let world_from_box =
            world_from_index * DAffine3::from_scale_rotation_translation(half, glam::DQuat::IDENTITY, center);
        self.grow(box_corners(min, max).map(|p| world_from_index.transform_point3(p.as_dvec3()).as_vec3a()));
        let density = part.field.as_ref().map(|_| GridDensity {
            grid: Arc::clone(&loaded.grid),
            index_from_world: world_from_index.inverse().as_affine3a(),
        });
        self.list.push(Medium { density, tint, ..part.medium.clone() });
        self.shapes.push(BoundaryShape::Box { world_from_box });
    }

    pub(super) fn finish(self) -> Media {
        let Self { list, shapes, bounds, grid_bytes } = self;
        let reach = bounds.map_or(0.0, |(min, max)| min.abs().max(max.abs()).max_element());
        let densest =
            list.iter().filter(|m| m.density.is_none()).map(|m| m.coefficients().sigma_t.max_element());
        let is_dense = densest.fold(0.0, f32::max) * reach * f32::EPSILON > VISIBLE_DEPTH;
        Media { list, boundaries: Boundaries::build(shapes), bounds, is_dense, grid_bytes }
    }

    /// Grows by the box of a placed surface.
    fn grow_around(&mut self, mesh: &SurfaceMesh, world_from_object: DAffine3, origin: DVec3) {
        let (min, max) = mesh.blas().bounds();
        let to_world = camera_relative(world_from_object * mesh.object_from_blas(), mesh.center(), origin);
        self.grow(box_corners(min, max).map(|p| to_world.transform_point3a(p)));
    }

    fn grow(&mut self, points: [Vec3A; 8]) {
        for p in points.into_iter().filter(|p| p.is_finite()) {
            let (min, max) = self.bounds.unwrap_or((p, p));
            self.bounds = Some((min.min(p), max.max(p)));
        }
    }
}

/// Where media are: media do not blur, and those that would have to are named.
fn held_still(path: &PrimPath, places: &[Place], context: &mut BuildContext) -> Vec<DAffine3> {
    if places.iter().any(Place::moves) {
        context.diagnostics.warn(
            path,
            "its medium moves while the shutter is open",
            "the medium is drawn as it is at the frame's own time; only surfaces and cameras are blurred",
        );
    }
    places.iter().map(|place| place.at_frame).collect()
}

/// The boundary of a medium inside a placed surface.
fn shape_of(mesh: &SurfaceMesh, world_from_object: DAffine3, origin: DVec3) -> BoundaryShape {
    let of_unit = || relative_to(world_from_object * mesh.object_from_unit(), DVec3::ZERO, origin);
    match mesh.shape() {
        ShapeOfSurface::Cube => BoundaryShape::Box { world_from_box: of_unit() },
        ShapeOfSurface::Sphere => BoundaryShape::Sphere { world_from_sphere: of_unit() },
        ShapeOfSurface::Triangles => BoundaryShape::Mesh {
            blas: Arc::clone(mesh.blas()),
            world_from_object: camera_relative(world_from_object, mesh.center(), origin),
        },
    }
}

/// The colours that the parts need, each loaded once.
fn load_tints(
    path: &PrimPath,
    volume: &prim::Volume,
    parts: &[Part],
    context: &mut BuildContext,
) -> BTreeMap<String, (PrimPath, LoadedField<ColorGrid>)> {
    let mut colors = BTreeMap::new();
    for name in parts.iter().filter_map(|part| part.tint.as_ref()).map(|tint| &tint.field) {
        if !colors.contains_key(name)
            && let Some(field) = field_of(volume, name)
            && let Some(loaded) = grids::load_colors(path, field, context)
        {
            colors.insert(name.clone(), (field.clone(), loaded));
        }
    }
    colors
}

/// A grid's place in the camera-relative world; `None`, with a message, if there is none.
fn placed(world_from_index: DAffine3, field: &PrimPath, context: &mut BuildContext) -> Option<DAffine3> {
    if is_invertible(&world_from_index) {
        return Some(relative_to(world_from_index, DVec3::ZERO, context.origin));
    }
    let what = "its transform is singular or not finite";
    context.diagnostics.warn(field, what, "the volume is drawn without this field");
    None
}

/// The tint of `part`. An albedo is cut at 1.
fn tint_of(
    part: &Part,
    tint: &PartTint,
    colors: &LoadedField<ColorGrid>,
    world_from_index: DAffine3,
    field: &PrimPath,
    context: &mut BuildContext,
) -> Tint {
    let brightest = if tint.is_relative { 1.0 } else { colors.grid.max_component() };
    let least_zero = |base: Rgb, factor: Rgb| {
        let falls = factor.cmplt(Rgb::ZERO);
        Rgb::select(falls, base / -factor, Rgb::INFINITY).min_element()
    };
    let limit =
        least_zero(part.medium.sigma_a, tint.sigma_a).min(least_zero(part.medium.sigma_s, tint.sigma_s));
    if brightest > limit * 1.0001 {
        let what = format!("its values up to {brightest} are used as an albedo");
        context.diagnostics.warn(field, what, format!("they are cut at {limit}"));
    }
    Tint {
        grid: Arc::clone(&colors.grid),
        index_from_world: world_from_index.inverse().as_affine3a(),
        is_relative: tint.is_relative,
        sigma_a: tint.sigma_a,
        sigma_s: tint.sigma_s,
        glow: tint.glow,
        most: brightest.min(limit),
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
        tint: None,
        phase: PhaseModel::lobe(0.0),
        emission: Vec::new(),
        program: None,
    })
}

fn box_corners(min: Vec3A, max: Vec3A) -> [Vec3A; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3A::new(pick(0), pick(1), pick(2))
    })
}

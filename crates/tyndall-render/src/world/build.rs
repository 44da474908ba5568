//! From a scene to a world.

use super::bodies::LightBodies;
use super::cache::WorldCache;
use super::clipping;
use super::context::BuildContext;
use super::materials::Materials;
use super::media::MediaBuilder;
use super::placements::Placements;
use super::surfaces::SurfacesBuilder;
use super::{MatteName, World};
use crate::camera::CameraModel;
use glam::Vec3A;
use tyndall_scene::prim::{self, Prim};
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath, RenderSettings, Scene};
use tyndall_shading::{Light, LightSet};

/// Why a scene cannot become a world at all. Everything less is a diagnostic.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorldError {
    /// There is nothing to look through.
    #[error("the scene has no camera; add one, or name one with --camera")]
    NoCamera,
    /// The camera that was asked for is not there.
    #[error("there is no camera at <{path}>; cameras in the scene: {known}")]
    UnknownCamera {
        /// What was asked for.
        path: String,
        /// What there is.
        known: String,
    },
}

impl World {
    /// Builds the world of `scene`, reusing what `cache` still holds.
    ///
    /// # Errors
    /// There is no camera. Prims that cannot be rendered are diagnostics of the world.
    pub fn build(
        scene: &Scene,
        settings: &RenderSettings,
        assets: &dyn AssetLoader,
        cache: &mut WorldCache,
    ) -> Result<Self, WorldError> {
        let mut diagnostics = scene.diagnostics().clone();
        let (camera_path, camera) = find_camera(scene, settings, &mut diagnostics)?;
        let (mut camera, origin) = CameraModel::from_prim(&camera_path, camera, &mut diagnostics);
        camera.fit_to(settings.resolution, settings.pixel_aspect);

        let placements = Placements::new(scene);
        let procedural_resolution = settings.procedural_resolution;
        let mut context =
            BuildContext { scene, assets, cache, placements, origin, procedural_resolution, diagnostics };
        let mut materials = Materials::default();
        let mut surfaces = SurfacesBuilder::default();
        let mut media = MediaBuilder::default();
        for (path, prim) in scene.prims() {
            match prim {
                Prim::Mesh(mesh) if mesh.visible => {
                    surfaces.add_mesh(path, mesh, &mut materials, &mut media, &mut context)
                }
                Prim::Shape(shape) if shape.visible => {
                    surfaces.add_shape(path, shape, &mut materials, &mut media, &mut context)
                }
                Prim::Volume(volume) if volume.visible => {
                    media.add_volume(path, volume, &mut materials, &mut context)
                }
                _ => {}
            }
        }
        let surfaces = surfaces.finish(&materials);
        let media = media.finish();
        let lights = build_lights(&mut context);
        let of_lights = lights.iter().map(Light::bounds);
        let bounds = union([surfaces.bounds(), media.bounds()].into_iter().chain(of_lights));
        let lights = LightSet::build(lights, radius(bounds));
        let bodies = LightBodies::new(&lights);
        clipping::drop_if_nothing_is_left(&mut camera, &camera_path, bounds, &mut context.diagnostics);
        let BuildContext { cache, mut diagnostics, .. } = context;
        cache.meshes.drop_unused();
        cache.grids.drop_unused();
        cache.colors.drop_unused();
        cache.baked.drop_unused();
        let infinite_lights: Vec<usize> =
            (0..lights.lights.len()).filter(|&i| lights.lights[i].is_infinite()).collect();
        let (materials, material_paths) = materials.finish();
        let material_names = material_paths.into_iter().map(MatteName::new).collect();
        report_if_dark(&lights, &media, &surfaces, &mut diagnostics);
        Ok(Self {
            origin,
            camera,
            surfaces,
            materials,
            material_names,
            media,
            lights,
            infinite_lights,
            bodies,
            diagnostics,
        })
    }
}

fn find_camera<'a>(
    scene: &'a Scene,
    settings: &RenderSettings,
    diagnostics: &mut Diagnostics,
) -> Result<(PrimPath, &'a prim::Camera), WorldError> {
    let cameras: Vec<_> = scene
        .prims()
        .filter_map(
            |(path, prim)| if let Prim::Camera(camera) = prim { Some((path, camera.as_ref())) } else { None },
        )
        .collect();
    let names = || cameras.iter().map(|(path, _)| path.as_str()).collect::<Vec<_>>().join(", ");
    if let Some(wanted) = settings.camera_path() {
        let found = cameras.iter().find(|(path, _)| **path == wanted);
        return found.map(|(path, camera)| ((*path).clone(), *camera)).ok_or_else(|| {
            if cameras.is_empty() {
                WorldError::NoCamera
            } else {
                WorldError::UnknownCamera { path: wanted.as_str().to_owned(), known: names() }
            }
        });
    }
    let (path, camera) = cameras.first().ok_or(WorldError::NoCamera)?;
    if cameras.len() > 1 {
        let what = format!("the scene has {} cameras ({}) and none was asked for", cameras.len(), names());
        diagnostics.warn(path, what, "the first is used; choose one with --camera");
    }
    Ok(((*path).clone(), *camera))
}

fn build_lights(context: &mut BuildContext) -> Vec<Light> {
    let mut lights = Vec::new();
    for (path, prim) in context.scene.prims() {
        let Prim::Light(light) = prim else { continue };
        if light.visible && (light.diffuse != 1.0 || light.specular != 1.0) {
            context.diagnostics.warn(
                path,
                "inputs:diffuse and inputs:specular other than 1 are not supported",
                "the light reaches all lobes in full; leave both at 1",
            );
        }
        lights.extend(Light::from_prim(
            path,
            light,
            context.origin,
            context.assets,
            &mut context.diagnostics,
        ));
    }
    lights
}

fn report_if_dark(
    lights: &LightSet,
    media: &super::Media,
    surfaces: &super::Surfaces,
    diagnostics: &mut Diagnostics,
) {
    if lights.lights.is_empty() && !media.is_emissive() && !surfaces.is_emissive() {
        let whole_shot = PrimPath::from("");
        diagnostics.warn(&whole_shot, "nothing in the shot emits light", "the picture is black; add a light");
    }
}

type Bounds = Option<(Vec3A, Vec3A)>;

fn union(all: impl IntoIterator<Item = Bounds>) -> Bounds {
    all.into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn radius(bounds: Bounds) -> f32 {
    let half = bounds.map_or(1.0, |(min, max)| ((max - min) * 0.5).length());
    if half.is_finite() && half > 0.0 { half } else { 1.0 }
}

//! What a shot is made of, as hashes: equal content has equal hashes on every machine.
//!
//! Prims are hashed as they were received, with their paths. Of files, the path is hashed and not the content: whoever
//! overwrites one keeps its hash.

use crate::prim::{Light, Prim};
use crate::{RenderSettings, Scene};
use glam::DAffine3;
use serde::Serialize;
use std::io::{BufWriter, Write};

/// Small writes of numbers are collected: the hash function is fast for long ones.
const BUFFER: usize = 1 << 16;

/// The first half of a BLAKE3 hash of each part of a shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SceneFingerprint {
    /// Meshes, shapes, instancers, and where lights that have a place are: one that moves, as a lantern in a walk, leaves
    /// most of what was learned nearly right.
    pub geometry: [u8; 16],
    /// Volumes and fields.
    pub media: [u8; 16],
    /// Materials.
    pub materials: [u8; 16],
    /// Lights; those at infinity with their orientation.
    pub lights: [u8; 16],
    /// The camera and what maps the image to it.
    pub camera: [u8; 16],
    /// Settings that decide which light is followed.
    pub integrator: [u8; 16],
}

impl SceneFingerprint {
    /// Of `scene` rendered with `settings`.
    pub fn new(scene: &Scene, settings: &RenderSettings) -> Self {
        let [mut geometry, mut media, mut materials, mut lights, mut camera] =
            std::array::from_fn(|_| Content::default());
        let seen_through = settings.camera_path();
        for (path, prim) in scene.prims() {
            match prim {
                Prim::Mesh(mesh) => geometry.add(&(path, mesh)),
                Prim::Shape(shape) => geometry.add(&(path, shape)),
                Prim::Instancer(instancer) => geometry.add(&(path, instancer)),
                Prim::Volume(volume) => media.add(&(path, volume)),
                Prim::Field(field) => media.add(&(path, field)),
                Prim::Material(material) => materials.add(&(path, material)),
                Prim::Light(light) if light.kind.has_place() => {
                    geometry.add(&(path, light.world_from_light));
                    lights
                        .add(&(path, Light { world_from_light: DAffine3::IDENTITY, ..Light::clone(light) }));
                }
                Prim::Light(light) => lights.add(&(path, light)),
                Prim::Camera(prim) if seen_through.as_ref().is_none_or(|wanted| wanted == path) => {
                    camera.add(&(path, prim));
                }
                Prim::Camera(_) | Prim::RenderSettings(_) => {}
            }
        }
        camera.add(&(settings.resolution, settings.pixel_aspect, settings.filter));
        let mut integrator = Content::default();
        integrator.add(&(settings.max_bounces, settings.distance_sampling, settings.light_sampling));
        let [geometry, media, materials, lights, camera, integrator] =
            [geometry, media, materials, lights, camera, integrator].map(Content::hash);
        Self { geometry, media, materials, lights, camera, integrator }
    }
}

/// What is hashed so far.
struct Content(BufWriter<blake3::Hasher>);

impl Default for Content {
    fn default() -> Self {
        Self(BufWriter::with_capacity(BUFFER, blake3::Hasher::new()))
    }
}

impl Content {
    fn add(&mut self, content: &(impl Serialize + std::fmt::Debug)) {
        if postcard::to_io(content, &mut self.0).is_err() {
            // A path that is no Unicode cannot be serialised; its text for debugging is as good. Hashing cannot fail.
            let _ = write!(self.0, "{content:?}");
        }
    }

    fn hash(self) -> [u8; 16] {
        let mut half = [0; 16];
        // Cannot fail either.
        if let Ok(hasher) = self.0.into_inner() {
            half.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
        }
        half
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prim::{Camera, Field, FieldSource, LightKind, Material, Mesh, Shaping};
    use crate::{DirtyBits, DistanceSampling, RenderDelegate};
    use glam::DVec3;
    use std::sync::Arc;

    fn light() -> Light {
        Light {
            world_from_light: DAffine3::IDENTITY,
            kind: LightKind::Distant { angle: 0.5 },
            intensity: 1.0,
            exposure: 0.0,
            color: [1.0; 3],
            normalize: false,
            diffuse: 1.0,
            specular: 1.0,
            shaping: Shaping::default(),
            visible: true,
            camera_visible: true,
            opaque: true,
        }
    }

    fn field(path: &str) -> Prim {
        let source = FieldSource::File { path: path.into(), name: "density".into(), index: None };
        Prim::Field(Arc::new(Field { world_from_field: DAffine3::IDENTITY, source }))
    }

    fn hashes(change: Option<(&str, Prim)>, settings: &RenderSettings) -> SceneFingerprint {
        let mut delegate = RenderDelegate::new();
        let prims = [
            ("/camera", Prim::Camera(Arc::default())),
            ("/smoke", field("smoke.1.vdb")),
            ("/mesh", Prim::Mesh(Arc::default())),
            ("/sun", Prim::Light(Arc::new(light()))),
            ("/stone", Prim::Material(Arc::default())),
        ];
        for (path, prim) in prims.into_iter().chain(change) {
            delegate.sync(path.into(), prim, DirtyBits::ALL);
        }
        SceneFingerprint::new(&delegate.commit(), settings)
    }

    #[test]
    fn each_change_shows_in_its_part_alone() {
        let settings = RenderSettings::default();
        let before = hashes(None, &settings);
        assert_eq!(hashes(None, &settings), before);
        let mesh = Mesh { points: vec![[0.0; 3]], ..Mesh::default() };
        let camera = Camera { world_from_camera: DAffine3::from_translation(DVec3::X), ..Camera::default() };
        let material = Material { surface: Some(0), ..Material::default() };
        let sun = Light { intensity: 2.0, ..light() };
        let parts =
            |f: SceneFingerprint| [f.geometry, f.media, f.materials, f.lights, f.camera, f.integrator];
        let changes = [
            ("/mesh", Prim::Mesh(Arc::new(mesh))),
            ("/smoke", field("smoke.2.vdb")),
            ("/stone", Prim::Material(Arc::new(material))),
            ("/sun", Prim::Light(Arc::new(sun))),
            ("/camera", Prim::Camera(Arc::new(camera))),
        ];
        for (changed, (path, prim)) in changes.into_iter().enumerate() {
            let after = parts(hashes(Some((path, prim)), &settings));
            for (i, (a, b)) in after.into_iter().zip(parts(before)).enumerate() {
                assert_eq!(a != b, i == changed, "{path}, part {i}");
            }
        }
    }

    #[test]
    fn a_lamp_that_moves_is_a_change_of_places_and_a_sun_that_turns_is_one_of_light() {
        let settings = RenderSettings::default();
        let lamp = |x: f64, intensity: f32| {
            let kind = LightKind::Sphere { radius: 0.1, as_point: false };
            let place = DAffine3::from_translation(DVec3::X * x);
            Prim::Light(Arc::new(Light { kind, intensity, world_from_light: place, ..light() }))
        };
        let before = hashes(Some(("/lamp", lamp(0.0, 1.0))), &settings);
        let moved = hashes(Some(("/lamp", lamp(2.0, 1.0))), &settings);
        assert_eq!(SceneFingerprint { geometry: before.geometry, ..moved }, before);
        assert_ne!(moved.geometry, before.geometry);
        let brighter = hashes(Some(("/lamp", lamp(0.0, 2.0))), &settings);
        assert_eq!(SceneFingerprint { lights: before.lights, ..brighter }, before);
        assert_ne!(brighter.lights, before.lights);
        let sun = Light { world_from_light: DAffine3::from_rotation_x(0.5), ..light() };
        let turned = hashes(Some(("/sun", Prim::Light(Arc::new(sun)))), &settings);
        assert_ne!(turned.lights, hashes(None, &settings).lights);
    }

    #[test]
    fn settings_that_only_say_how_long_do_not_count() {
        let settings = RenderSettings::default();
        let before = hashes(None, &settings);
        let longer =
            RenderSettings { samples: 7, seed: 3, threads: 1, time_limit: 2.0, ..RenderSettings::default() };
        assert_eq!(hashes(None, &longer), before);
        let deeper = RenderSettings { max_bounces: 7, ..RenderSettings::default() };
        assert_ne!(hashes(None, &deeper).integrator, before.integrator);
        let odds = RenderSettings { distance_sampling: DistanceSampling::Odds, ..RenderSettings::default() };
        assert_ne!(hashes(None, &odds).integrator, before.integrator);
        let other = Some(("/other", Prim::Camera(Arc::default())));
        let chosen = RenderSettings { camera: Some("/camera".into()), ..RenderSettings::default() };
        assert_eq!(hashes(other, &chosen), hashes(None, &chosen), "only the camera that is used counts");
    }
}

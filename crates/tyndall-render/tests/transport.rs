//! The whole renderer on scenes whose answer is a known number, and its promises: the same bits on any number of
//! threads, and after any edit those of a world built from nothing.

use glam::{DAffine3, DVec2, DVec3};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use tyndall_render::{Control, Session, World, WorldCache};
use tyndall_scene::prim::*;
use tyndall_scene::{
    AssetError, AssetLoader, ColorSpace, DirtyBits, ImageData, PixelFilter, RenderDelegate, RenderSettings,
};

/// Scenes here are made of numbers alone.
struct NoFiles;

impl AssetLoader for NoFiles {
    fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
        Err(AssetError { message: format!("{}: no files in this test", path.display()) })
    }
}

fn node(kind: &str, inputs: &[(&str, NodeInput)]) -> ShadingNode {
    let inputs = inputs.iter().map(|(name, input)| ((*name).to_owned(), input.clone())).collect();
    ShadingNode { kind: kind.to_owned(), inputs }
}

fn diffuse(albedo: f32) -> Prim {
    let color = NodeInput::Vector([albedo; 3]);
    Prim::Material(Arc::new(Material {
        nodes: vec![node("diffuse", &[("color", color)])],
        surface: Some(0),
        volume: None,
    }))
}

fn medium(absorption: [f32; 3], scattering: [f32; 3], emission: [f32; 3]) -> Prim {
    let inputs = [
        ("absorption", NodeInput::Vector(absorption)),
        ("scattering", NodeInput::Vector(scattering)),
        ("emission", NodeInput::Vector(emission)),
        ("anisotropy", NodeInput::Float(0.4)),
    ];
    Prim::Material(Arc::new(Material {
        nodes: vec![node("volume", &inputs)],
        surface: None,
        volume: Some(0),
    }))
}

fn shape(kind: ShapeKind, position: DVec3, material: &str) -> Prim {
    Prim::Shape(Arc::new(Shape {
        world_from_object: DAffine3::from_translation(position),
        motion: Vec::new(),
        kind,
        primvars: BTreeMap::new(),
        material: Some(material.into()),
        instancer: None,
        visible: true,
    }))
}

fn light(kind: LightKind, intensity: f32) -> Prim {
    Prim::Light(Arc::new(Light {
        world_from_light: DAffine3::from_translation(DVec3::new(0.0, 3.0, 1.0)),
        kind,
        intensity,
        exposure: 0.0,
        color: [1.0; 3],
        normalize: false,
        diffuse: 1.0,
        specular: 1.0,
        shaping: Shaping::default(),
        visible: true,
        camera_visible: true,
        opaque: true,
    }))
}

fn dome(radiance: f32) -> Prim {
    light(LightKind::Dome { texture: None }, radiance)
}

fn camera(position: DVec3) -> Prim {
    Prim::Camera(Arc::new(Camera {
        world_from_camera: DAffine3::from_translation(position),
        aperture: DVec2::splat(1.0),
        focal_length: 1.0,
        ..Camera::default()
    }))
}

fn delegate(prims: &[(&str, Prim)]) -> RenderDelegate {
    let mut delegate = RenderDelegate::new();
    for (path, prim) in prims {
        delegate.sync((*path).into(), prim.clone(), DirtyBits::ALL);
    }
    delegate
}

fn settings(samples: u32, max_bounces: u32) -> RenderSettings {
    RenderSettings {
        resolution: [12, 12],
        samples,
        max_bounces,
        threads: 2,
        filter: PixelFilter::Box,
        aovs: ["rgba", "variance"].map(String::from).to_vec(),
        ..RenderSettings::default()
    }
}

fn render(delegate: &mut RenderDelegate, settings: &RenderSettings, cache: &mut WorldCache) -> Vec<f32> {
    let world = World::build(&delegate.commit(), settings, &NoFiles, cache).unwrap();
    let session = Session::new(Arc::new(world), settings.clone()).unwrap();
    session.render(&Control::default());
    let film = session.film();
    assert_eq!(film.non_finite_samples(), 0);
    assert_eq!(session.statistics().walks.majorant_violations, 0);
    film.image("rgba").unwrap()
}

/// Mean over pixels and channels, with its standard error from the spread of the pixels.
fn mean_and_error(rgba: &[f32]) -> (f64, f64) {
    let values: Vec<f64> = rgba.chunks_exact(4).flat_map(|p| p[..3].iter().map(|v| f64::from(*v))).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // The three channels of a pixel are one draw.
    (mean, (variance / (n / 3.0)).sqrt())
}

fn assert_is_everywhere(prims: &[(&str, Prim)], settings: &RenderSettings, expected: f64) {
    let image = render(&mut delegate(prims), settings, &mut WorldCache::default());
    let (mean, error) = mean_and_error(&image);
    let z = (mean - expected) / error.max(1e-6 * expected);
    assert!(z.abs() < 4.0, "mean {mean} is {z} standard errors from {expected}");
}

const ORIGIN: DVec3 = DVec3::new(0.0, 0.0, 5.0);

#[test]
fn white_medium_in_a_white_furnace_vanishes() {
    let ball = shape(ShapeKind::Sphere { radius: 1.5 }, DVec3::ZERO, "/m");
    for (density, position) in [(1e-6, ORIGIN), (3.0, ORIGIN), (3.0, DVec3::ZERO)] {
        let prims = [
            ("/ball", ball.clone()),
            ("/m", medium([0.0; 3], [density; 3], [0.0; 3])),
            ("/sky", dome(1.0)),
            ("/camera", camera(position)),
        ];
        assert_is_everywhere(&prims, &settings(64, 5000), 1.0);
    }
}

#[test]
fn isothermal_furnace_is_even_whatever_the_albedo_and_colour() {
    // sigma_a * B emission, environment B = 1 (Kirchhoff).
    let absorption = [0.3, 1.0, 2.5];
    let prims = [
        ("/ball", shape(ShapeKind::Cube { size: 2.0 }, DVec3::ZERO, "/m")),
        ("/m", medium(absorption, [1.0, 0.2, 0.0], absorption)),
        ("/sky", dome(1.0)),
        ("/camera", camera(ORIGIN)),
    ];
    assert_is_everywhere(&prims, &settings(64, 5000), 1.0);
}

#[test]
fn overlapping_media_add_and_the_camera_may_stand_in_them() {
    let cube = |size| shape(ShapeKind::Cube { size }, DVec3::ZERO, "/m");
    let prims = [
        ("/a", cube(2.0)),
        ("/b", cube(4.0)),
        ("/c", shape(ShapeKind::Sphere { radius: 1.0 }, DVec3::ZERO, "/m")),
        ("/m", medium([0.0; 3], [0.7; 3], [0.0; 3])),
        ("/sky", dome(1.0)),
        ("/camera", camera(DVec3::ZERO)),
    ];
    assert_is_everywhere(&prims, &settings(64, 5000), 1.0);
}

#[test]
fn closed_white_walls_with_fog_return_the_geometric_series() {
    // Walls of albedo 1/2 that also emit 1: radiance 2 everywhere; fog of albedo 1 changes nothing.
    let walls = Prim::Material(Arc::new(Material {
        nodes: vec![
            node("diffuse", &[("color", NodeInput::Vector([0.5; 3]))]),
            node("surface", &[("bsdf", NodeInput::Node(0)), ("emission", NodeInput::Vector([1.0; 3]))]),
        ],
        surface: Some(1),
        volume: None,
    }));
    let prims = [
        ("/room", shape(ShapeKind::Cube { size: 4.0 }, DVec3::ZERO, "/walls")),
        ("/walls", walls),
        ("/fog", shape(ShapeKind::Cube { size: 4.0 }, DVec3::ZERO, "/m")),
        ("/m", medium([0.0; 3], [0.2; 3], [0.0; 3])),
        ("/camera", camera(DVec3::ZERO)),
    ];
    assert_is_everywhere(&prims, &settings(128, 2000), 2.0);
}

#[test]
fn unbounded_media_scatter_under_a_sky_alone() {
    // In endless white fog no ray ever escapes: only fog of finite albedo has an answer, black at depth.
    let fog = Prim::Volume(Arc::new(Volume {
        fields: Vec::new(),
        material: Some("/m".into()),
        world_from_object: DAffine3::IDENTITY,
        instancer: None,
        visible: true,
    }));
    // Isothermal again: emission sigma_a makes every pixel 1 at any albedo below 1.
    let prims = [
        ("/fog", fog),
        ("/m", medium([0.5; 3], [0.5; 3], [0.5; 3])),
        ("/sky", dome(7.0)),
        ("/camera", camera(ORIGIN)),
    ];
    assert_is_everywhere(&prims, &settings(64, 500), 1.0);
}

#[test]
fn half_spaces_of_any_density_reflect_as_chandrasekhar_says() {
    // Free flights down to a billionth of the spacing of f32 at the surface. Seen head on under a white sky:
    // 1 - sqrt(1 - albedo) H(1), with H of isotropic scattering (Chandrasekhar 1950, Radiative Transfer, table XI).
    for sigma in [1.0f32, 1e4, 1e8, 1e12] {
        for (albedo, reflectance) in [(0.5f32, 0.1152259), (0.9, 0.4149475)] {
            let size = if sigma < 10.0 { 1000.0 } else { 1.7 };
            let material = isotropic([sigma * (1.0 - albedo); 3], [sigma * albedo; 3]);
            let prims = [
                ("/half", shape(ShapeKind::Cube { size }, DVec3::new(0.0, 0.0, -0.5 * size), "/m")),
                ("/m", material),
                ("/sky", dome(1.0)),
                ("/camera", head_on(DVec3::new(0.1, -0.2, 1.3))),
            ];
            assert_is_everywhere(&prims, &settings(512, 5000), reflectance);
        }
    }
}

fn isotropic(absorption: [f32; 3], scattering: [f32; 3]) -> Prim {
    let inputs =
        [("absorption", NodeInput::Vector(absorption)), ("scattering", NodeInput::Vector(scattering))];
    Prim::Material(Arc::new(Material {
        nodes: vec![node("volume", &inputs)],
        surface: None,
        volume: Some(0),
    }))
}

/// Sees a twentieth of a degree.
fn head_on(position: DVec3) -> Prim {
    Prim::Camera(Arc::new(Camera {
        world_from_camera: DAffine3::from_translation(position),
        aperture: DVec2::splat(1.0),
        focal_length: 1000.0,
        ..Camera::default()
    }))
}

fn still_life() -> Vec<(&'static str, Prim)> {
    vec![
        (
            "/floor",
            shape(ShapeKind::Plane { width: 20.0, length: 20.0 }, DVec3::new(0.0, 0.0, -3.0), "/grey"),
        ),
        ("/ball", shape(ShapeKind::Sphere { radius: 1.0 }, DVec3::ZERO, "/grey")),
        ("/smoke", shape(ShapeKind::Cube { size: 2.0 }, DVec3::X, "/m")),
        ("/grey", diffuse(0.6)),
        ("/m", medium([0.1; 3], [0.9, 0.7, 0.5], [0.0; 3])),
        ("/lamp", light(LightKind::Sphere { radius: 0.5, as_point: false }, 20.0)),
        ("/sky", dome(0.3)),
        ("/camera", camera(ORIGIN)),
    ]
}

#[test]
fn the_number_of_threads_and_repetition_change_no_bit() {
    let of_threads = |threads| {
        let settings = RenderSettings { threads, ..settings(8, 16) };
        render(&mut delegate(&still_life()), &settings, &mut WorldCache::default())
    };
    let one = of_threads(1);
    assert_eq!(one, of_threads(2));
    assert_eq!(one, of_threads(7));
    assert_eq!(one, of_threads(1));
}

#[test]
fn an_edited_world_equals_one_built_from_nothing() {
    let edits: Vec<(&str, Prim)> = vec![
        ("/ball", shape(ShapeKind::Sphere { radius: 1.0 }, DVec3::new(-1.0, 0.2, 0.5), "/grey")),
        ("/ball", shape(ShapeKind::Cube { size: 1.5 }, DVec3::ZERO, "/grey")),
        ("/grey", diffuse(0.2)),
        ("/m", medium([0.0; 3], [3.0; 3], [0.1; 3])),
        ("/lamp", light(LightKind::Disk { radius: 1.0 }, 5.0)),
        ("/camera", camera(DVec3::new(0.5, 0.1, 6.0))),
        ("/new", shape(ShapeKind::Cone { radius: 0.5, height: 1.0 }, DVec3::NEG_X, "/m")),
    ];
    let settings = settings(4, 8);
    let mut cache = WorldCache::default();
    let mut edited = delegate(&still_life());
    render(&mut edited, &settings, &mut cache);
    let mut current = still_life();
    for (path, prim) in edits {
        edited.sync(path.into(), prim.clone(), DirtyBits::PARAMS);
        current.retain(|(p, _)| *p != path);
        current.push((path, prim));
        let incremental = render(&mut edited, &settings, &mut cache);
        let fresh = render(&mut delegate(&current), &settings, &mut WorldCache::default());
        assert_eq!(incremental, fresh, "after editing {path}");
    }
    edited.remove(&"/ball".into());
    current.retain(|(p, _)| *p != "/ball");
    let fresh = render(&mut delegate(&current), &settings, &mut WorldCache::default());
    assert_eq!(render(&mut edited, &settings, &mut cache), fresh, "after removal");
}

#[test]
fn far_from_the_stage_origin_the_picture_is_the_same() {
    let moved = |offset: DVec3| {
        let shift = |prim: &Prim| match prim {
            Prim::Shape(s) => {
                let mut s = s.as_ref().clone();
                s.world_from_object.translation += offset;
                Prim::Shape(Arc::new(s))
            }
            Prim::Camera(c) => {
                let mut c = c.as_ref().clone();
                c.world_from_camera.translation += offset;
                Prim::Camera(Arc::new(c))
            }
            Prim::Light(l) => {
                let mut l = l.as_ref().clone();
                l.world_from_light.translation += offset;
                Prim::Light(Arc::new(l))
            }
            other => other.clone(),
        };
        let prims: Vec<_> = still_life().iter().map(|(path, prim)| (*path, shift(prim))).collect();
        render(&mut delegate(&prims), &settings(4, 8), &mut WorldCache::default())
    };
    // A power of two: f64 represents the moved scene exactly, so the camera-relative worlds are equal.
    assert_eq!(moved(DVec3::ZERO), moved(DVec3::splat(f64::from(1u32 << 30))));
}

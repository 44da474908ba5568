//! Scenes in pairs that differ only in something they do not use: does it cost anything?
//!
//! Usage: `lean CASE SAMPLES`; renders one of [`CASES`] on one thread and prints what its paths did as JSON. By itself
//! it measures nothing: `tests/bench/lean.py` counts its instructions under Valgrind, at two sample counts, so that
//! building the world drops out. Without arguments (`cargo bench`) every case is rendered once.

use glam::{DAffine3, DVec3, Vec3};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use tyndall_render::{Control, PathStatistics, Session, World, WorldCache};
use tyndall_scene::prim::*;
use tyndall_scene::{
    AssetError, AssetLoader, ColorSpace, DirtyBits, ImageData, PixelFilter, RenderDelegate, RenderSettings,
};

/// Every case and what is in its air.
const CASES: [(&str, Air); 6] = [
    ("surfaces", Vec::new),
    ("far_medium", far_medium),
    ("grey_fog", || fog([0.2; 3])),
    // One channel off by a rounding error: the same light, but nothing is the same in all channels.
    ("coloured_fog", || fog([0.2, 0.2, 0.200_000_02])),
    ("tight_grid", || grid(SLAB)),
    ("padded_grid", || grid(GRID)),
];

/// Voxels along a side of the padded grid: ten bricks of eight.
const GRID: usize = 80;
/// Voxels that hold something along its first side: a tenth of the bricks.
const SLAB: usize = 8;

type Prims = Vec<(&'static str, Prim)>;
type Air = fn() -> Prims;

fn main() {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    match arguments.as_slice() {
        [case, samples] => {
            let (name, air) = *CASES.iter().find(|(name, _)| name == case).expect("a case of CASES");
            print(name, &render(air(), samples.parse().expect("a number of samples")));
        }
        _ => CASES.iter().for_each(|(name, air)| print(name, &render(air(), 1))),
    }
}

fn print(case: &str, done: &PathStatistics) {
    println!(
        "{{\"case\": \"{case}\", \"paths\": {}, \"segments\": {}, \"shadowRays\": {}, \"volumeEvents\": {}, \
         \"candidates\": {}, \"lookups\": {}}}",
        done.paths,
        done.segments,
        done.shadow_rays,
        done.volume_events,
        done.walks.candidates,
        done.walks.lookups
    );
}

/// Scenes here are made of numbers alone.
struct NoFiles;

impl AssetLoader for NoFiles {
    fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
        Err(AssetError { message: format!("{}: no files in this benchmark", path.display()) })
    }
}

fn render(air: Prims, samples: u32) -> PathStatistics {
    let settings = RenderSettings {
        resolution: [48, 32],
        samples,
        max_bounces: 8,
        threads: 1,
        filter: PixelFilter::Box,
        aovs: vec!["rgba".to_owned()],
        ..RenderSettings::default()
    };
    let mut delegate = RenderDelegate::new();
    for (path, prim) in still_life().into_iter().chain(air) {
        delegate.sync(path.into(), prim, DirtyBits::ALL);
    }
    let mut cache = WorldCache::default();
    let world = World::build(&delegate.commit(), &settings, &NoFiles, &mut cache).expect("a world");
    let session = Session::new(Arc::new(world), settings).expect("a session");
    session.render(&Control::default());
    session.statistics()
}

/// A floor, four balls, a lamp and a sky, five units before the camera.
fn still_life() -> Prims {
    let ball = |x: f64, y: f64| shape(ShapeKind::Sphere { radius: 0.6 }, DVec3::new(x, y, 0.0), "/grey");
    vec![
        ("/camera", camera(DVec3::new(0.0, 0.0, 5.0))),
        ("/grey", diffuse([0.6; 3])),
        ("/wall", shape(ShapeKind::Plane { width: 20.0, length: 20.0 }, DVec3::new(0.0, 0.0, -3.0), "/grey")),
        ("/a", ball(-0.9, -0.6)),
        ("/b", ball(0.9, -0.6)),
        ("/c", ball(-0.9, 0.9)),
        ("/d", ball(0.9, 0.9)),
        ("/lamp", light(LightKind::Rect { width: 1.0, height: 1.0, texture: None }, 8.0)),
        ("/sky", light(LightKind::Dome { texture: None }, 0.5)),
    ]
}

/// A ball of fog so small and far away that no ray meets it.
fn far_medium() -> Prims {
    let place = DVec3::new(3e5, 2e5, 1e6);
    vec![
        ("/far", shape(ShapeKind::Sphere { radius: 1e-3 }, place, "/fog")),
        ("/fog", scattering(NodeInput::Vector([1.0; 3]), Vec::new())),
    ]
}

/// Fog all over the scene that scatters by these coefficients.
fn fog(sigma_s: [f32; 3]) -> Prims {
    vec![
        ("/air", shape(ShapeKind::Cube { size: 12.0 }, DVec3::ZERO, "/fog")),
        ("/fog", scattering(NodeInput::Vector(sigma_s), Vec::new())),
    ]
}

/// A grid whose first [`SLAB`] voxels along x are noise, a wall of mist at the left; as far as `length` all is empty but
/// the last voxel, so that the empty bricks are in the grid's box.
fn grid(length: usize) -> Prims {
    let dims = [length, GRID, GRID];
    let mut values = vec![0.0; length * GRID * GRID];
    for (i, value) in values[..SLAB * GRID * GRID].iter_mut().enumerate() {
        *value = 0.5 + 0.5 * ((i as f32) * 0.618_034).fract();
    }
    if let Some(last) = values.last_mut() {
        *last = 1.0;
    }
    let (origin, voxel_size) = (Vec3::splat(-3.0), 6.0 / GRID as f32);
    let source = FieldSource::Dense { dims, values: Arc::new(values), origin, voxel_size };
    let volume = Volume {
        fields: vec![("density".to_owned(), "/density".into())],
        material: Some("/fog".into()),
        world_from_object: DAffine3::IDENTITY,
        instancer: None,
        visible: true,
    };
    let name = NodeInput::Text("density".to_owned());
    vec![
        ("/density", Prim::Field(Arc::new(Field { world_from_field: DAffine3::IDENTITY, source }))),
        ("/volume", Prim::Volume(Arc::new(volume))),
        ("/fog", scattering(NodeInput::Node(0), vec![node("field", &[("name", name)])])),
    ]
}

fn node(kind: &str, inputs: &[(&str, NodeInput)]) -> ShadingNode {
    let inputs = inputs.iter().map(|(name, input)| ((*name).to_owned(), input.clone())).collect();
    ShadingNode { kind: kind.to_owned(), inputs }
}

/// A medium that only scatters; its coefficients may come from one of `nodes`.
fn scattering(sigma_s: NodeInput, mut nodes: Vec<ShadingNode>) -> Prim {
    nodes.push(node("volume", &[("scattering", sigma_s), ("anisotropy", NodeInput::Float(0.4))]));
    let volume = Some(nodes.len() - 1);
    Prim::Material(Arc::new(Material { nodes, surface: None, volume }))
}

fn diffuse(color: [f32; 3]) -> Prim {
    let nodes = vec![node("diffuse", &[("color", NodeInput::Vector(color))])];
    Prim::Material(Arc::new(Material { nodes, surface: Some(0), volume: None }))
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
        world_from_light: DAffine3::from_translation(DVec3::new(0.0, 3.0, 4.0)),
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

fn camera(position: DVec3) -> Prim {
    Prim::Camera(Arc::new(Camera {
        world_from_camera: DAffine3::from_translation(position),
        aperture: glam::DVec2::new(1.5, 1.0),
        focal_length: 1.0,
        ..Camera::default()
    }))
}

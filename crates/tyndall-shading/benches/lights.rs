//! Choosing among lights. One iteration is 1,000 choices, so microseconds per iteration are nanoseconds per choice.
//!
//! Lights and receivers fill a cube of 100 units evenly; `balls` send everywhere, `cards` to one side. Run with
//! `cargo bench -p tyndall-shading`.

use divan::{Bencher, black_box};
use glam::{DAffine3, DQuat, DVec3, Vec3A};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tyndall_math::random::Pcg;
use tyndall_scene::prim::{self, LightKind, Shaping};
use tyndall_scene::{AssetError, AssetLoader, ColorSpace, Diagnostics, ImageData, PrimPath};
use tyndall_shading::{Light, LightSet, Receiver};

const COUNTS: [usize; 5] = [1, 2, 16, 1_000, 100_000];
const SIZE: f64 = 100.0;
const CHOICES: usize = 1_000;

fn main() {
    for (name, kind) in [("balls", ball()), ("cards", card())] {
        let lights = lights(&kind, 100_000);
        let start = Instant::now();
        black_box(LightSet::build(lights, SIZE as f32));
        println!("building a set of 100,000 {name}: {:.3} s", start.elapsed().as_secs_f64());
    }
    divan::main();
}

fn ball() -> LightKind {
    LightKind::Sphere { radius: 0.05, as_point: false }
}

fn card() -> LightKind {
    LightKind::Rect { width: 0.1, height: 0.1, texture: None }
}

fn light(kind: &LightKind, world_from_light: DAffine3) -> Light {
    struct NoAssets;
    impl AssetLoader for NoAssets {
        fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
            Err(AssetError { message: format!("{} does not exist", path.display()) })
        }
    }
    let prim = prim::Light {
        world_from_light,
        kind: kind.clone(),
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
    };
    let path = PrimPath::from("/Light");
    Light::from_prim(&path, &prim, DVec3::ZERO, &NoAssets, &mut Diagnostics::default()).expect("it shines")
}

fn place(rng: &mut Pcg) -> DVec3 {
    DVec3::new(rng.next_f32().into(), rng.next_f32().into(), rng.next_f32().into()) * SIZE
}

fn lights(kind: &LightKind, n: usize) -> Vec<Light> {
    let mut rng = Pcg::new(&[1]);
    let mut placed = || {
        let axis = (place(&mut rng) / SIZE - 0.5).normalize_or(DVec3::X);
        let turn = DQuat::from_axis_angle(axis, std::f64::consts::TAU * f64::from(rng.next_f32()));
        DAffine3::from_rotation_translation(turn, place(&mut rng))
    };
    (0..n).map(|_| light(kind, placed())).collect()
}

fn points() -> Vec<Receiver> {
    let mut rng = Pcg::new(&[2]);
    (0..4096).map(|_| Receiver::Point { position: place(&mut rng).as_vec3a() }).collect()
}

fn surfaces() -> Vec<Receiver> {
    let mut rng = Pcg::new(&[3]);
    let mut direction = || (place(&mut rng) / SIZE - 0.5).normalize_or(DVec3::X).as_vec3a();
    let facing = |it: Receiver, normal: Vec3A| match it {
        Receiver::Point { position } => Receiver::Surface { position, normal, both_sides: false },
        other => other,
    };
    points().into_iter().map(|it| facing(it, direction())).collect()
}

fn segments() -> Vec<Receiver> {
    let mut rng = Pcg::new(&[4]);
    let mut segment = || {
        let (a, b) = (place(&mut rng).as_vec3a(), place(&mut rng).as_vec3a());
        Receiver::Segment { origin: a, direction: (b - a).normalize(), t0: 0.0, t1: (b - a).length() }
    };
    (0..4096).map(|_| segment()).collect()
}

fn bench_choices(bencher: Bencher<'_, '_>, set: &LightSet, receivers: &[Receiver]) {
    let (mut rng, mut i) = (Pcg::new(&[5]), 0);
    bencher.bench_local(|| {
        for _ in 0..CHOICES {
            i = (i + 1) % receivers.len();
            black_box(set.sample_light(&receivers[i], rng.next_f32()));
        }
    });
}

fn bench_probabilities(bencher: Bencher<'_, '_>, set: &LightSet, receivers: &[Receiver]) {
    let (mut i, mut light) = (0, 0);
    bencher.bench_local(|| {
        for _ in 0..CHOICES {
            i = (i + 1) % receivers.len();
            light = (light + 7919) % set.lights.len();
            black_box(set.probability(&receivers[i], light));
        }
    });
}

#[divan::bench(args = COUNTS)]
fn balls_at_points(bencher: Bencher<'_, '_>, n: usize) {
    bench_choices(bencher, &LightSet::build(lights(&ball(), n), SIZE as f32), &points());
}

#[divan::bench(args = COUNTS)]
fn balls_at_points_probability(bencher: Bencher<'_, '_>, n: usize) {
    bench_probabilities(bencher, &LightSet::build(lights(&ball(), n), SIZE as f32), &points());
}

#[divan::bench(args = COUNTS)]
fn cards_at_points(bencher: Bencher<'_, '_>, n: usize) {
    bench_choices(bencher, &LightSet::build(lights(&card(), n), SIZE as f32), &points());
}

#[divan::bench(args = COUNTS)]
fn cards_at_surfaces(bencher: Bencher<'_, '_>, n: usize) {
    bench_choices(bencher, &LightSet::build(lights(&card(), n), SIZE as f32), &surfaces());
}

#[divan::bench(args = COUNTS)]
fn cards_along_segments(bencher: Bencher<'_, '_>, n: usize) {
    bench_choices(bencher, &LightSet::build(lights(&card(), n), SIZE as f32), &segments());
}

fn sun_and_sky() -> LightSet {
    let kinds = [LightKind::Distant { angle: 0.53 }, LightKind::Dome { texture: None }];
    LightSet::build(kinds.iter().map(|kind| light(kind, DAffine3::IDENTITY)).collect(), SIZE as f32)
}

#[divan::bench]
fn sun_and_sky_choice(bencher: Bencher<'_, '_>) {
    bench_choices(bencher, &sun_and_sky(), &points());
}

#[divan::bench]
fn sun_and_sky_probability(bencher: Bencher<'_, '_>) {
    bench_probabilities(bencher, &sun_and_sky(), &points());
}

//! Asking a mixture of eight lobes; asking and teaching a field. One iteration is 1,000 questions, so microseconds per iteration are
//! nanoseconds per question; `update` is one iteration per pass, with the samples per second beside it.
//!
//! Run with `cargo bench -p tyndall-guiding`; one thread.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::{Vec2, Vec3A};
use std::sync::LazyLock;
use tyndall_guiding::EventClass;
use tyndall_guiding::directional::{MAX_LOBES, VmfMixture};
use tyndall_guiding::field::{Field, FieldSettings, PackedDirection, TrainingSample};
use tyndall_math::INV_4PI;
use tyndall_math::random::Pcg;
use tyndall_math::sampling::uniform_sphere;

const QUESTIONS: usize = 1_000;

/// Forty lights of different size around a cube, seen through uniform samples.
fn samples(seed: u64, n: usize) -> Vec<TrainingSample> {
    let mut rng = Pcg::new(&[seed]);
    let mut light_rng = Pcg::new(&[99]);
    let lights: Vec<(Vec3A, f32)> = (0..40)
        .map(|i| (uniform_sphere(u2(&mut light_rng)) * (1.0 + 0.1 * i as f32), 5.0 * 1.12f32.powi(i)))
        .collect();
    (0..n)
        .map(|_| {
            let position = Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5;
            let direction = uniform_sphere(u2(&mut rng));
            let shine = |(centre, kappa): &(Vec3A, f32)| {
                kappa * (kappa * (direction.dot((*centre - position).normalize()) - 1.0)).exp()
            };
            TrainingSample {
                position: position.into(),
                direction: PackedDirection::new(direction),
                radiance: lights.iter().map(shine).sum(),
                emission: 0.0,
                pdf: INV_4PI,
                distance: 2.0,
                selection_probability: 0.5,
                w: 0.4,
                t_hat: 0.6,
                vertex: EventClass::Volume,
                end: if rng.next_f32() < 0.5 { EventClass::Volume } else { EventClass::Surface },
            }
        })
        .collect()
}

static PASS: LazyLock<Vec<TrainingSample>> = LazyLock::new(|| samples(1, 200_000));

static FIELD: LazyLock<Field> = LazyLock::new(|| {
    let mut field = Field::new(FieldSettings::default());
    for seed in 1..4 {
        field.update(&samples(seed, 200_000));
    }
    println!("{:#?}", field.statistics());
    field
});

fn u2(rng: &mut Pcg) -> Vec2 {
    Vec2::new(rng.next_f32(), rng.next_f32())
}

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("no pool exists yet");
    divan::main();
}

/// Asks `question` at random points, with random directions.
fn ask<T>(bencher: Bencher<'_, '_>, question: impl Fn(&Field, Vec3A, Vec3A, Vec2) -> T) {
    let mut rng = Pcg::new(&[7]);
    let places: Vec<_> = (0..4096)
        .map(|_| {
            let position = Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5;
            (position, uniform_sphere(u2(&mut rng)), u2(&mut rng))
        })
        .collect();
    let mut i = 0;
    bencher.bench_local(|| {
        for _ in 0..QUESTIONS {
            i = (i + 1) % places.len();
            let (position, direction, u) = places[i];
            black_box(question(&FIELD, position, direction, u));
        }
    });
}

/// Asks `question` of a mixture of as many lobes as there can be.
fn ask_mixture<T>(bencher: Bencher<'_, '_>, question: impl Fn(&VmfMixture, Vec3A, Vec2) -> T) {
    let mixture = VmfMixture::spread(MAX_LOBES);
    ask(bencher, |_, _, direction, u| question(black_box(&mixture), direction, u));
}

#[divan::bench]
fn region(bencher: Bencher<'_, '_>) {
    ask(bencher, |field, position, _, u| field.region(position, EventClass::Volume, u.x).is_some());
}

#[divan::bench]
fn region_and_incident(bencher: Bencher<'_, '_>) {
    ask(bencher, |field, position, _, u| {
        field.region(position, EventClass::Volume, u.x).map(|region| region.incident(position).fluence())
    });
}

#[divan::bench]
fn pdf(bencher: Bencher<'_, '_>) {
    ask_mixture(bencher, |mixture, direction, _| mixture.pdf(direction));
}

#[divan::bench]
fn sample_and_pdf(bencher: Bencher<'_, '_>) {
    ask_mixture(bencher, |mixture, _, u| mixture.sample(u));
}

#[divan::bench]
fn odds(bencher: Bencher<'_, '_>) {
    let region = FIELD.region(Vec3A::ZERO, EventClass::Volume, 0.5).expect("it was trained");
    ask(bencher, |_, _, direction, _| black_box(region).moments_towards(direction).odds());
}

#[divan::bench]
fn product_with_cosine(bencher: Bencher<'_, '_>) {
    ask_mixture(bencher, |mixture, direction, _| mixture.product_with_cosine(direction));
}

#[divan::bench]
fn product_with_hg(bencher: Bencher<'_, '_>) {
    ask_mixture(bencher, |mixture, direction, _| mixture.product_with_hg(direction, 0.7));
}

/// A pass like those before it: lobes are near their place.
#[divan::bench(sample_count = 5)]
fn update(bencher: Bencher<'_, '_>) {
    bencher
        .counter(ItemsCount::new(PASS.len()))
        .with_inputs(|| FIELD.clone())
        .bench_local_values(|mut field| field.update(&PASS));
}

/// The first pass: everything is new.
#[divan::bench(sample_count = 5)]
fn first_update(bencher: Bencher<'_, '_>) {
    bencher
        .counter(ItemsCount::new(PASS.len()))
        .with_inputs(|| Field::new(FieldSettings::default()))
        .bench_local_values(|mut field| field.update(&PASS));
}

/// Partition, one step of fitting eight lobes, merging them, and the odds.
#[divan::bench(sample_count = 5)]
fn update_of_one_step(bencher: Bencher<'_, '_>) {
    let settings = FieldSettings { max_iterations: 1, ..Default::default() };
    bencher
        .counter(ItemsCount::new(PASS.len()))
        .with_inputs(|| Field::new(settings))
        .bench_local_values(|mut field| field.update(&PASS));
}

//! Writing and reading caches; beside each the bytes of the file a second.
//!
//! Run with `cargo bench -p tyndall-guiding --bench cache`.

use divan::counter::BytesCount;
use divan::{Bencher, black_box};
use std::sync::LazyLock;
use tyndall_guiding::cache::{Cache, Present};
use tyndall_guiding::field::{Field, FieldSettings, PackedDirection, TrainingSample};
use tyndall_guiding::image_space::ImageGuide;
use tyndall_guiding::{ClassCosts, EventClass, Moments, Strategy};
use tyndall_math::random::Pcg;
use tyndall_math::sampling::uniform_sphere;

/// A field of many small regions.
static FIELD: LazyLock<(Cache, Vec<u8>)> = LazyLock::new(|| {
    let settings = FieldSettings { region_samples: 64, ..Default::default() };
    let mut field = Field::new(settings);
    for seed in 0..4 {
        field.update(&samples(seed, 800_000));
    }
    let cache = Cache { field: Some(field), ..Cache::default() };
    let bytes = cache.to_bytes();
    println!("field: {} bytes in memory, {} in the file", memory(&cache), bytes.len());
    (cache, bytes)
});

/// A field whose file has 70 MB. How well lobes fit does not matter here: one step of fitting makes it in a minute.
static LARGE: LazyLock<(Cache, Vec<u8>)> = LazyLock::new(|| {
    let settings =
        FieldSettings { region_samples: 64, effective_samples: 16, max_iterations: 1, ..Default::default() };
    let mut field = Field::new(settings);
    field.update(&samples(0, 5_000_000));
    let size = field.statistics();
    let cache = Cache { field: Some(field), ..Cache::default() };
    let bytes = cache.to_bytes();
    println!("large field: {size:?}, {} bytes in the file", bytes.len());
    (cache, bytes)
});

/// The sums of an image of 1280x720.
static IMAGE: LazyLock<(Cache, Vec<u8>)> = LazyLock::new(|| {
    let mut image = ImageGuide::new([0, 0], 1280, 720, Strategy::Odds);
    let mut rng = Pcg::new(&[3]);
    let mut moments = || Moments {
        volume_x2: rng.next_f32(),
        surface_x2: rng.next_f32(),
        w2: rng.next_f32(),
        t2: rng.next_f32(),
        n: 8.0,
        ..Moments::default()
    };
    let pass: Vec<_> = (0..1280 * 720).map(|_| moments()).collect();
    let learned = image.learn(&pass, &ClassCosts::default());
    assert!(learned.is_ok());
    let cache = Cache { image: Some(image), ..Cache::default() };
    let bytes = cache.to_bytes();
    println!("image guide: {} bytes in the file", bytes.len());
    (cache, bytes)
});

fn memory(cache: &Cache) -> usize {
    cache.field.as_ref().map_or(0, |field| field.statistics().n_bytes)
}

fn samples(seed: u64, n: usize) -> Vec<TrainingSample> {
    let mut rng = Pcg::new(&[seed]);
    let mut sample = || {
        let position = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
        let direction = uniform_sphere(glam::Vec2::new(rng.next_f32(), rng.next_f32()));
        let class = if rng.next_f32() < 0.5 { EventClass::Volume } else { EventClass::Surface };
        TrainingSample {
            position,
            direction: PackedDirection::new(direction),
            radiance: (4.0 * direction.z).exp() + rng.next_f32(),
            emission: 0.0,
            pdf: tyndall_math::INV_4PI,
            distance: 1.0 + rng.next_f32(),
            selection_probability: 0.5,
            w: 0.5,
            t_hat: 0.5,
            vertex: class,
            end: EventClass::Volume,
        }
    };
    (0..n).map(|_| sample()).collect()
}

fn main() {
    divan::main();
}

fn read(bencher: Bencher<'_, '_>, (_, bytes): &(Cache, Vec<u8>)) {
    let reads = || Cache::from_bytes(black_box(bytes)).is_ok();
    bencher.counter(BytesCount::new(bytes.len())).bench_local(reads);
}

#[divan::bench(sample_count = 9)]
fn read_field(bencher: Bencher<'_, '_>) {
    read(bencher, &FIELD);
}

/// Until a render could begin with it.
#[divan::bench(sample_count = 9)]
fn read_and_reuse_large_field(bencher: Bencher<'_, '_>) {
    let (cache, bytes) = &*LARGE;
    bencher.counter(BytesCount::new(bytes.len())).bench_local(|| {
        let mut read = Cache::from_bytes(black_box(bytes)).unwrap_or_default();
        let (fingerprint, origin, view) = (cache.fingerprint, cache.origin, cache.view);
        read.reuse(&Present { fingerprint, origin, view, resolution: [1280, 720] })
    });
}

/// Without the filter that makes odds of the sums.
#[divan::bench(sample_count = 9)]
fn read_image(bencher: Bencher<'_, '_>) {
    read(bencher, &IMAGE);
}

/// What is learned of one camera, moved to another.
#[divan::bench(sample_count = 9)]
fn reproject_image(bencher: Bencher<'_, '_>) {
    let (cache, _) = &*IMAGE;
    let mut moved = cache.view;
    moved.world_from_camera.translation.x += 0.01;
    let image = || cache.image.as_ref().map(|image| image.reprojected(&cache.view, &moved, [1280, 720]));
    bencher.bench_local(|| black_box(image()));
}

#[divan::bench(sample_count = 9)]
fn write_field(bencher: Bencher<'_, '_>) {
    let (cache, bytes) = &*FIELD;
    bencher.counter(BytesCount::new(bytes.len())).bench_local(|| black_box(cache).to_bytes());
}

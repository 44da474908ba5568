//! What guiding is worth on a known integral: the light of small bright balls at points of a box that a wall cuts in two.
//!
//! Half of all directions are drawn from the field and half uniformly, as a renderer would; passes double, and each teaches
//! the field with what it saw, made noisy as by further bounces. The error is the relative variance of one sample of
//! ∫ L dω, which is known in closed form, averaged over the box.
//!
//! `cargo run --release --example guided_balls -p tyndall-guiding`

use glam::{Vec2, Vec3A};
use tyndall_guiding::EventClass::{Surface, Volume};
use tyndall_guiding::field::{Field, FieldSettings, Incident, PackedDirection, TrainingSample};
use tyndall_math::INV_4PI;
use tyndall_math::random::Pcg;
use tyndall_math::sampling::uniform_sphere;

/// Centre, radius and radiance.
const BALLS: [([f32; 3], f32, f32); 4] = [
    ([0.25, 0.3, 1.2], 0.05, 100.0),
    ([0.1, -0.4, 0.2], 0.10, 20.0),
    ([0.8, 1.6, 0.5], 0.15, 15.0),
    ([0.7, 0.5, 0.5], 0.02, 200.0),
];
/// Radiance from everywhere else.
const AMBIENT: f32 = 0.02;
/// Vertices per pass and sample: 256 × 192 pixels, one vertex each.
const VERTICES: usize = 49_152;
const PASSES: [usize; 6] = [1, 1, 2, 4, 8, 16];

fn main() {
    for (effective_samples, region_samples) in [(32, 32_768), (64, 32_768), (256, 32_768), (1 << 30, 4096)] {
        let settings = FieldSettings { effective_samples, region_samples, ..Default::default() };
        println!(
            "regions of {effective_samples} effective or {region_samples} samples: relative variance after each pass"
        );
        run(settings);
    }
}

/// CPU seconds of all threads of this process so far (Linux).
fn cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let schedstat = tasks.filter_map(|t| std::fs::read_to_string(t.path().join("schedstat")).ok());
    schedstat.filter_map(|s| s.split_whitespace().next()?.parse::<f64>().ok()).sum::<f64>() * 1e-9
}

fn run(settings: FieldSettings) {
    let mut field = Field::new(settings);
    let first = relative_variance(&field);
    print!("  {first:7.1}");
    let (mut last, mut seconds) = (first, 0.0);
    for (i, n) in PASSES.into_iter().enumerate() {
        let pass = samples_of_pass(&field, i as u64, n * VERTICES);
        let begin = cpu_seconds();
        field.update(&pass);
        seconds += cpu_seconds() - begin;
        last = relative_variance(&field);
        print!("  {last:7.2}");
    }
    let s = field.statistics();
    println!(
        "\n  {:.0} times less; {} regions, {:.1} lobes each, {:.2} µs of CPU per training sample",
        first / last,
        s.n_volume_regions,
        s.n_lobes as f32 / s.n_volume_regions as f32,
        seconds * 1e6 / s.n_samples as f64
    );
}

fn u2(rng: &mut Pcg) -> Vec2 {
    Vec2::new(rng.next_f32(), rng.next_f32())
}

fn point(rng: &mut Pcg) -> Vec3A {
    Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
}

/// Balls on this side of the wall x = 0.5.
fn visible(position: Vec3A) -> impl Iterator<Item = (Vec3A, f32, f32)> {
    let is_here = move |ball: &([f32; 3], f32, f32)| (ball.0[0] < 0.5) == (position.x < 0.5);
    BALLS
        .into_iter()
        .filter(is_here)
        .map(|(centre, radius, radiance)| (Vec3A::from(centre), radius, radiance))
}

/// Radiance and distance.
fn look(position: Vec3A, direction: Vec3A) -> (f32, f32) {
    let mut seen = (AMBIENT, f32::INFINITY);
    for (centre, radius, radiance) in visible(position) {
        let to = centre - position;
        let along = to.dot(direction);
        let miss = to.length_squared() - along * along;
        if along > 0.0 && miss < radius * radius && along < seen.1 {
            seen = (radiance, along);
        }
    }
    seen
}

/// ∫ L dω, but for balls in front of each other.
fn fluence(position: Vec3A) -> f32 {
    let of_ball = |(centre, radius, radiance): (Vec3A, f32, f32)| {
        let sin2 = radius * radius / (centre - position).length_squared();
        std::f32::consts::TAU * sin2 / (1.0 + (1.0 - sin2).sqrt()) * (radiance - AMBIENT)
    };
    visible(position).map(of_ball).sum::<f32>() + AMBIENT / INV_4PI
}

/// A direction and its density.
fn draw(incident: Option<&Incident>, rng: &mut Pcg) -> (Vec3A, f32) {
    let Some(incident) = incident else { return (uniform_sphere(u2(rng)), INV_4PI) };
    let direction =
        if rng.next_f32() < 0.5 { uniform_sphere(u2(rng)) } else { incident.sample(u2(rng)).direction };
    (direction, 0.5 * (INV_4PI + incident.pdf(direction)))
}

fn samples_of_pass(field: &Field, pass: u64, n: usize) -> Vec<TrainingSample> {
    let mut rng = Pcg::new(&[1, pass]);
    let mut sample = || {
        let position = point(&mut rng);
        let incident = field.region(position, Volume, rng.next_f32()).map(|r| r.incident(position));
        let (direction, pdf) = draw(incident.as_ref(), &mut rng);
        let (radiance, distance) = look(position, direction);
        // Two of three paths find nothing, the rest more than their share.
        let noise = if rng.next_f32() < 1.0 / 3.0 { 3.0 * rng.next_exponential() } else { 0.0 };
        TrainingSample {
            position: position.into(),
            direction: PackedDirection::new(direction),
            radiance: radiance * noise,
            emission: 0.0,
            pdf,
            distance,
            selection_probability: 1.0,
            w: 0.0,
            t_hat: 1.0,
            vertex: Volume,
            end: Surface,
        }
    };
    (0..n).map(|_| sample()).collect()
}

fn relative_variance(field: &Field) -> f64 {
    let mut rng = Pcg::new(&[2]);
    let (n_positions, n_samples) = (3000, 200);
    let mut total = 0.0;
    for _ in 0..n_positions {
        let position = point(&mut rng);
        // Inside of the ball in the box, or behind it, the closed form does not hold.
        if visible(position).any(|(c, r, _)| (c - position).length() < 2.0 * r) {
            continue;
        }
        let truth = f64::from(fluence(position));
        for _ in 0..n_samples {
            let incident = field.region(position, Volume, rng.next_f32()).map(|r| r.incident(position));
            let (direction, pdf) = draw(incident.as_ref(), &mut rng);
            total += (f64::from(look(position, direction).0 / pdf) / truth - 1.0).powi(2);
        }
    }
    total / (n_positions * n_samples) as f64
}

//! Estimators of transmittance against each other: ratio tracking with and without a control, unbiased ray marching
//! (Kettunen, d'Eon, Pantaleoni & Novák 2021, doi:10.1145/3450626.3459937), and the crate's own.
//!
//! Prints what the table in `src/transmittance.rs` is made of. All estimators see the same rays in turns of one process;
//! times are medians over the turns of the ratio to residual ratio tracking within a turn, so a noisy machine moves
//! them little. That all have the same mean is asserted. `cargo bench -p tyndall-volume --bench shadows`; with
//! `-- CLASS` (see [`media::CLASSES`]) for one class only.

#[path = "shadows/estimators.rs"]
mod estimators;
#[path = "shadows/media.rs"]
mod media;
#[path = "shadows/ray_marching.rs"]
mod ray_marching;

use estimators::{Estimator, Shot, all};
use media::{CLASSES, Class};
use std::time::Instant;
use tyndall_math::Rgb;
use tyndall_math::random::Pcg;

/// Mean optical depths of the rays.
const DEPTHS: [f32; 4] = [0.1, 1.0, 5.0, 10.0];
/// Extinction by channel, relative to the largest.
const COLORS: [(&str, Rgb); 2] = [("grey", Rgb::ONE), ("coloured", Rgb::new(1.0, 0.5, 0.2))];
const RAYS: usize = 400;
/// Estimates of each ray in a turn.
const REPEATS: usize = 8;
const TURNS: usize = 12;
/// Means may differ by this many standard errors.
const LARGEST_Z: f64 = 4.5;

fn main() {
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with("--"));
    println!(
        "Per cell: look-ups a ray, variance, time and variance x time, the last three relative to residual"
    );
    println!("ratio tracking. Variance is that of one estimate, averaged over rays and channels.\n");
    println!(
        "| medium | depth | light | residual ratio: look-ups | ratio | marching, even | marching, by bounds | this crate |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for class in CLASSES.iter().filter(|class| wanted.as_ref().is_none_or(|name| name == class.name)) {
        let scene = class.scene(RAYS);
        for depth in DEPTHS {
            for (light, color) in COLORS {
                measure(class, &scene, depth, light, color);
            }
        }
    }
}

fn measure(class: &Class, scene: &media::Scene, depth: f32, light: &str, color: Rgb) {
    let shot = Shot::new(scene, color * (depth / scene.mean_density_along_rays));
    let mut runs: Vec<Run> = all().into_iter().map(Run::new).collect();
    for _ in 0..TURNS {
        runs.iter_mut().for_each(|run| run.turn(&shot));
    }
    let (first, others) = runs.split_first().expect("residual ratio tracking comes first");
    others.iter().for_each(|run| run.assert_same_mean(first, class.name, depth));
    let cells: Vec<String> = others.iter().map(|run| run.cell(first)).collect();
    println!("| {} | {depth} | {light} | {:.2} | {} |", class.name, first.lookups(), cells.join(" | "));
}

/// What one estimator did.
struct Run {
    estimator: Box<dyn Estimator>,
    rng: Pcg,
    lookups: u64,
    /// Of each ray and channel: sum and sum of squares.
    sums: Vec<[[f64; 2]; 3]>,
    seconds: Vec<f64>,
}

impl Run {
    fn new(estimator: Box<dyn Estimator>) -> Self {
        let sums = vec![[[0.0; 2]; 3]; RAYS];
        Self { estimator, rng: Pcg::new(&[11]), lookups: 0, sums, seconds: Vec::new() }
    }

    fn turn(&mut self, shot: &Shot<'_>) {
        let mut found = [[Rgb::ZERO; REPEATS]; RAYS];
        let before = Instant::now();
        for (ray, found) in shot.rays.iter().zip(&mut found) {
            for found in found {
                *found = self.estimator.estimate(shot, ray, &mut self.rng, &mut self.lookups);
            }
        }
        self.seconds.push(before.elapsed().as_secs_f64());
        for (sums, found) in self.sums.iter_mut().zip(&found) {
            for (c, sums) in sums.iter_mut().enumerate() {
                for x in found.iter().map(|found| f64::from(found[c])) {
                    sums[0] += x;
                    sums[1] += x * x;
                }
            }
        }
    }

    const ESTIMATES: f64 = (REPEATS * TURNS) as f64;

    fn lookups(&self) -> f64 {
        self.lookups as f64 / (Self::ESTIMATES * RAYS as f64)
    }

    /// Mean and variance of one estimate for each ray and channel.
    fn moments(&self) -> impl Iterator<Item = [f64; 2]> {
        self.sums.iter().flatten().map(|[sum, squares]| {
            let mean = sum / Self::ESTIMATES;
            [mean, (squares / Self::ESTIMATES - mean * mean).max(0.0)]
        })
    }

    fn variance(&self) -> f64 {
        self.moments().map(|[_, variance]| variance).sum::<f64>() / (3 * RAYS) as f64
    }

    fn cell(&self, reference: &Self) -> String {
        let ratios = self.seconds.iter().zip(&reference.seconds).map(|(a, b)| a / b);
        let (variance, time) = (self.variance() / reference.variance(), median(ratios.collect()));
        let lookups = self.lookups();
        format!("{lookups:.2}, {variance:.2}, {time:.2}, **{:.2}**", variance * time)
    }

    fn assert_same_mean(&self, other: &Self, class: &str, depth: f32) {
        let (mut difference, mut variance) = (0.0, 0.0);
        for (a, b) in self.moments().zip(other.moments()) {
            difference += a[0] - b[0];
            variance += (a[1] + b[1]) / Self::ESTIMATES;
        }
        // Channels of a ray share their random numbers: at worst they are one.
        let z = difference / (3.0 * variance).sqrt().max(1e-12);
        assert!(
            z.abs() < LARGEST_Z,
            "{class} at {depth}: {} is off by {z} standard errors",
            self.estimator.name()
        );
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

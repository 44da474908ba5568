//! Layouts of bricks against each other, the memory of a build, and the cost of crossing a grid.
//!
//! Prints three markdown tables. Layouts are small twins of `BrickGrid` written here, timed in turns in one process;
//! figures are medians of the ratios within a turn, so a noisy machine moves them little. The second table times
//! walks and shadow rays of the crate itself, the third its half floats. `cargo bench -p tyndall-volume --bench grids`,
//! with `-- crossing` or `-- half` for one of the latter only.

#[path = "grids/crossing.rs"]
mod crossing;
#[path = "grids/half.rs"]
mod half_floats;
#[path = "grids/layouts.rs"]
mod layouts;
#[path = "grids/memory.rs"]
mod memory;
#[path = "grids/scenes.rs"]
mod scenes;

use std::time::Instant;

fn main() {
    let asks_for = |name: &str| std::env::args().any(|argument| argument == name);
    let (crossing, half) = (asks_for("crossing"), asks_for("half"));
    if !crossing && !half {
        memory::print_peak();
        layouts::print_table();
    }
    if !half {
        crossing::print_table();
    }
    if !crossing {
        half_floats::print_table();
    }
}

/// Nanoseconds per item of one call of `work`, which handles `n` items.
fn time(n: usize, work: impl FnOnce() -> f32) -> f64 {
    let before = Instant::now();
    std::hint::black_box(work());
    before.elapsed().as_secs_f64() * 1e9 / n as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

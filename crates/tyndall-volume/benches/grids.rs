//! Layouts of bricks against each other, the memory of a build, and the cost of crossing a grid.
//!
//! Prints two markdown tables. Layouts are small twins of `BrickGrid` written here, timed in turns in one process;
//! figures are medians of the ratios within a turn, so a noisy machine moves them little. The second table times
//! walks and shadow rays of the crate itself. `cargo bench -p tyndall-volume --bench grids`, with `-- crossing` for
//! the second table only.

#[path = "grids/crossing.rs"]
mod crossing;
#[path = "grids/layouts.rs"]
mod layouts;
#[path = "grids/memory.rs"]
mod memory;
#[path = "grids/scenes.rs"]
mod scenes;

use std::time::Instant;

fn main() {
    if !std::env::args().any(|argument| argument == "crossing") {
        memory::print_peak();
        layouts::print_table();
    }
    crossing::print_table();
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

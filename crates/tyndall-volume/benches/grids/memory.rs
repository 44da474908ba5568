//! The most memory a build holds, beyond the voxels it is given (Linux only).

use crate::scenes::cloud;
use std::fs;
use tyndall_volume::{BrickGrid, SparseVoxels};

pub(crate) fn print_peak() {
    let leaves = cloud(512);
    let borrowed = leaves.iter().map(|(origin, values)| (*origin, values.as_slice())).collect();
    let voxels = SparseVoxels { leaves: borrowed, ..Default::default() };
    // Forgets the peak of making the leaves; see proc(5).
    let is_reset = fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = status_kib("VmRSS:");
    let (grid, _) = BrickGrid::build(&voxels);
    let (peak, decoded) = (status_kib("VmHWM:").saturating_sub(before), leaves.len() * 2);
    if is_reset && peak > 0 {
        println!(
            "Build of 512^3: peak {:.2}, result {:.2} of the {decoded} KiB of its active bricks.\n",
            peak as f64 / decoded as f64,
            grid.memory_bytes() as f64 / 1024.0 / decoded as f64
        );
    }
}

fn status_kib(key: &str) -> usize {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

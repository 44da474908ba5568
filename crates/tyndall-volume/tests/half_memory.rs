//! Memory of a large grid of half floats, while it is built and after. A process of its own: the peak is that of all.

use half::f16;
use std::fs;
use tyndall_volume::{BrickGrid, SparseVoxels};

const BRICKS_ALONG: i32 = 52;

/// A full box of bricks with these values, 268 MiB as f32.
fn build(values: &[f32], first: &[f32]) -> BrickGrid {
    let n = BRICKS_ALONG;
    let origin = |i: i32| [i / (n * n) * 8, i / n % n * 8, i % n * 8];
    let leaves = (0..n.pow(3)).map(|i| (origin(i), if i == 0 { first } else { values })).collect();
    BrickGrid::build(&SparseVoxels { leaves, ..Default::default() }).0
}

fn status_bytes(key: &str) -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
}

#[test]
fn half_floats_take_two_bytes_a_voxel_at_their_peak_too() {
    let values: Vec<f32> = (1..=512).map(|i| f16::from_f32(i as f32 * 0.013).to_f32()).collect();
    let voxels = f64::from(BRICKS_ALONG.pow(3) * 512);
    // Forgets earlier peaks, see proc(5).
    let is_reset = fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = status_bytes("VmRSS:");
    let half = build(&values, &values);
    let peak = status_bytes("VmHWM:");
    let kept = half.memory_bytes() as f64 / voxels;
    assert!((2.0..2.2).contains(&kept), "{kept} bytes a voxel");
    if let (true, Some(before), Some(peak)) = (is_reset, before, peak) {
        // Beside the voxels a build holds a record of each brick.
        let peak = (peak - before) / voxels;
        assert!(peak < 2.5, "{peak} bytes a voxel at the peak");
    }
    drop(half);
    let mut inexact = values.clone();
    inexact[7] = 0.1;
    let full = build(&values, &inexact);
    let kept = full.memory_bytes() as f64 / voxels;
    assert!((4.0..4.4).contains(&kept), "{kept} bytes a voxel with one that is not a half float");
}

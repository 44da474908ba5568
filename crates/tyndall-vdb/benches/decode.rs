//! Megabytes of voxels decoded a second, CPU seconds and peak memory, by packing.
//!
//! `cargo bench -p tyndall-vdb --bench decode` makes fog grids of 256 MiB and reads them back;
//! `-- FILE...` reads every float grid of the files given instead. Files are read once beforehand, so that the disk is
//! not measured.
//!
//! 272 million voxels (1038 MiB) of smooth waves with noise, on two cores of a shared virtual machine, least of several
//! runs; the peak is of the whole process:
//!
//! | packing | file | CPU seconds | MiB of voxels a CPU second | peak memory |
//! |---|---|---|---|---|
//! | none | 1.1 GB | 1.3 | 800 | 1140 MiB (1.10 of the voxels) |
//! | Blosc | 0.9 GB | 1.3 | 790 | 1140 MiB |
//! | Blosc, half floats | 0.4 GB | 1.7 | 610 | 1140 MiB |
//! | zip (four times a grid of 259 MiB) | | 8.6 | 120 | |
//!
//! About half of the time is the system's, handing out the memory of the voxels and copying from the file. Zip is
//! slow with every decoder (`src/codec/zip.rs` compares them); OpenVDB itself zips no fog volume. A map of the file
//! instead of positioned reads took 1.25 s instead of 1.32 s (Blosc) and 1.27 s instead of 1.28 s (none).

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DAffine3;
use tyndall_vdb::{GridBuilder, LEAF_VOXELS, VdbError, VdbFile, WriteCompression, write_fog};

/// Voxels per side of the grid that is made.
const SIDE: usize = 406;

fn main() -> Result<(), VdbError> {
    // Cargo passes `--bench`.
    let files: Vec<PathBuf> =
        std::env::args_os().skip(1).filter(|arg| arg != "--bench").map(Into::into).collect();
    if !files.is_empty() {
        return files.iter().try_for_each(|path| measure(path));
    }
    let folder = std::env::temp_dir().join(format!("tyndall-vdb-bench-{}", std::process::id()));
    let made = make_files(&folder).and_then(|files| files.iter().try_for_each(|path| measure(path)));
    // Best effort: the result of the measurement is what counts.
    let _ = fs::remove_dir_all(&folder);
    made
}

/// The same cloud unpacked and zipped.
fn make_files(folder: &Path) -> Result<Vec<PathBuf>, VdbError> {
    let io_error = |source| VdbError::Io { action: "make", path: folder.to_owned(), source };
    fs::create_dir_all(folder).map_err(io_error)?;
    let values = cloud();
    let grid = GridBuilder::from_dense("density", [SIDE; 3], [0; 3], &values, DAffine3::IDENTITY).build()?;
    let mut files = Vec::new();
    for (name, compression) in [("none", WriteCompression::None), ("zip", WriteCompression::Zip)] {
        let path = folder.join(format!("{name}.vdb"));
        write_fog(&path, std::slice::from_ref(&grid), compression)?;
        files.push(path);
    }
    Ok(files)
}

/// Smooth waves with a little noise: like smoke, mantissas are nearly random and exponents nearly constant.
fn cloud() -> Vec<f32> {
    let wave: Vec<f32> = (0..SIDE).map(|i| (i as f32 * 0.05).sin()).collect();
    let mut noise = 1_u32;
    let mut value = |x: usize, y: usize, z: usize| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        1.5 + wave[x] * wave[y] * wave[z] + (noise >> 8) as f32 * (0.02 / (1 << 24) as f32)
    };
    let mut values = Vec::with_capacity(SIDE * SIDE * SIDE);
    for x in 0..SIDE {
        for y in 0..SIDE {
            values.extend((0..SIDE).map(|z| value(x, y, z)));
        }
    }
    values
}

fn measure(path: &Path) -> Result<(), VdbError> {
    black_box(fs::read(path).map(|bytes| bytes.len()).unwrap_or_default());
    let names: Vec<(String, usize)> =
        VdbFile::open(path)?.grids().iter().map(|info| (info.name.clone(), info.index)).collect();
    for (name, index) in names {
        for _ in 0..2 {
            let (cpu, wall) = (cpu_seconds(), Instant::now());
            let grid = VdbFile::open(path)?.read_grid(&name, Some(index))?;
            let (cpu, wall) = (cpu_seconds() - cpu, wall.elapsed().as_secs_f64());
            let mib = (grid.leaves.len() * LEAF_VOXELS * 4) as f64 / (1 << 20) as f64;
            println!(
                "{} {name}[{index}]: {mib:.0} MiB of voxels, {cpu:.2} CPU s, {wall:.2} s, {:.0} MiB a CPU second, \
                 peak {} MiB",
                path.file_name().unwrap_or_default().to_string_lossy(),
                mib / cpu.max(0.01),
                peak_mib()
            );
        }
    }
    Ok(())
}

/// Of all threads, user and system; zero where there is no `/proc`.
fn cpu_seconds() -> f64 {
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the command's name in parentheses: state is field 3, user and system time are fields 14 and 15.
    let fields = stat.rsplit_once(')').map_or("", |(_, fields)| fields);
    fields.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>()
        / TICKS_PER_SECOND
}

/// Most memory held so far; zero where there is no `/proc`.
fn peak_mib() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix("kB")).and_then(|kib| kib.trim().parse().ok()).unwrap_or(0)
        >> 10
}

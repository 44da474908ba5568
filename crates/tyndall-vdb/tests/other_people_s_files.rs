//! Files nobody on this project wrote, read from the folder `TYNDALL_SHARED` (default: `shared` next to the
//! repository). They must not enter the repository; without them each test says so and passes.
//!
//! Counts: OpenVDB 10 and NanoVDB 32, from the folder's own manifest.

use std::path::{Path, PathBuf};

use tyndall_vdb::{GridClass, VdbError, VdbFile};

fn shared(relative: &str) -> Option<PathBuf> {
    let root = std::env::var_os("TYNDALL_SHARED")
        .map(PathBuf::from)
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"));
    let path = root.join(relative);
    if !path.exists() {
        println!("skipped: {relative} is not in TYNDALL_SHARED");
        return None;
    }
    Some(path)
}

/// Dimensions of the active bounds.
fn dims((min, max): ([i32; 3], [i32; 3])) -> [i32; 3] {
    std::array::from_fn(|axis| max[axis] - min[axis] + 1)
}

#[test]
fn active_voxels_and_dimensions_match_the_manifest() {
    let cases = [
        ("data/gaffer/smoke.vdb", "density", 1_049_275, [111, 222, 112]),
        ("data/gaffer/sphere.vdb", "ls_sphere", 270_638, [125, 125, 125]),
        ("data/openusd_vdbvolume/densityAndHeat.vdb", "density", 6_124, [23, 23, 42]),
        ("data/openusd_vdbvolume/densityAndHeat.vdb", "heat", 5_224, [22, 21, 32]),
        ("data/openusd_vdbvolume/smoke_000002.vdb", "density", 71_983, [51, 49, 80]),
        ("data/openusd_vdbvolume/smoke_000003.vdb", "density", 90_197, [51, 49, 96]),
        ("data/arnold_2239/torus01.vdb", "voxel_fog_density", 2_450, [22, 9, 22]),
    ];
    for (file, name, count, expected) in cases {
        let Some(path) = shared(file) else { continue };
        let grid = VdbFile::open(&path).and_then(|file| file.read_grid(name, None)).expect(file);
        assert_eq!(grid.active_voxel_count(), count, "{file} {name}");
        assert_eq!(grid.active_bounds().map(dims), Some(expected), "{file} {name}");
    }
}

#[test]
fn classes_and_half_storage_are_reported() {
    let Some(path) = shared("data/gaffer/sphere.vdb") else { return };
    let file = VdbFile::open(&path).expect("sphere");
    let info = &file.grids()[0];
    assert_eq!((file.version(), info.class, info.saved_as_half), (222, GridClass::LevelSet, true));
    let grid = file.read_grid("ls_sphere", Some(0)).expect("sphere");
    assert!(grid.value([0, 0, 0]) < 0.0, "inside the sphere");
    assert!(grid.tiles.iter().any(|tile| !tile.active && tile.value < 0.0), "inactive interior");
}

#[test]
fn grids_of_other_types_do_not_hide_the_rest() {
    let Some(path) = shared("data/openusd_vdbvolume/smoke_000001.vdb") else { return };
    let file = VdbFile::open(&path).expect("smoke_000001");
    assert_eq!(file.grids().len(), 4);
    for name in ["density", "shadow", "obstacles"] {
        assert_eq!(file.read_grid(name, None).expect(name).active_voxel_count(), 0, "{name}");
    }
    let error = file.read_grid("velocity", None).expect_err("vectors");
    assert!(
        matches!(error, VdbError::UnsupportedGrid { .. }) && error.to_string().contains("vec3s"),
        "{error}"
    );
    assert_eq!(file.read_grid_as::<[f32; 3]>("velocity", None).expect("velocity").active_voxel_count(), 0);
}

#[test]
fn points_grids_are_named_as_such() {
    let Some(path) = shared("data/gaffer/points.vdb") else { return };
    let file = VdbFile::open(&path).expect("points");
    let error = file.read_grid(&file.grids()[0].name, None).expect_err("points").to_string();
    assert!(error.contains("points grid"), "{error}");
}

#[test]
fn our_own_scene_and_stress_files_open() {
    for folder in ["cases/scenes", "cases/calib", "cases/stress"] {
        let Some(path) = shared(folder) else { continue };
        for entry in std::fs::read_dir(path).expect(folder) {
            let path = entry.expect(folder).path();
            if path.extension().is_some_and(|extension| extension == "vdb") {
                let file = VdbFile::open(&path).expect("opens");
                for info in file.grids() {
                    let grid = file.read_grid(&info.name, Some(info.index)).expect("reads");
                    println!("{}: {} voxels, sum {}", path.display(), grid.active_voxel_count(), grid.sum());
                }
            }
        }
    }
}

/// NanoVDB files that come with NVIDIA Warp. Counts and sizes: what the files' own lists say, which is not what the
/// reader goes by.
#[test]
fn nano_files_of_warp_agree_with_their_lists() {
    let cases = [
        ("rocks", "surface", GridClass::LevelSet, 308_828, 1493),
        ("torus", "surface", GridClass::LevelSet, 3_001, 24),
        ("test_grid", "", GridClass::Unknown, 9_261, 64),
        ("test_int32_grid", "", GridClass::Unknown, 9_261, 64),
    ];
    for (file, name, class, active, n_leaves) in cases {
        let Some(path) = shared(&format!("data/warp_nvdb/{file}.nvdb")) else { continue };
        let grid = VdbFile::open(&path).and_then(|opened| opened.read_grid(name, None)).expect(file);
        assert_eq!(
            (grid.class, grid.active_voxel_count(), grid.leaves.len()),
            (class, active, n_leaves),
            "{file}"
        );
    }
    let Some(path) = shared("data/warp_nvdb/test_vec_grid.nvdb") else { return };
    let vectors =
        VdbFile::open(&path).and_then(|file| file.read_grid_as::<[f32; 3]>("", None)).expect("vectors");
    assert_eq!((vectors.active_voxel_count(), vectors.leaves.len()), (9_261, 64));
}

#[test]
fn nano_index_grids_are_named_as_such() {
    let Some(path) = shared("data/warp_nvdb/test_index_grid.nvdb") else { return };
    let file = VdbFile::open(&path).expect("index grids");
    let names: Vec<_> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
    assert_eq!(names, ["grid-0", "grid-1"]);
    let error = file.read_grid("grid-1", None).expect_err("no values").to_string();
    assert!(error.contains("NanoVDB OnIndex"), "{error}");
}

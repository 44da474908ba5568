//! The corpus: files in every storage form, against what OpenVDB 12 reads from them (`truth.json`, made by
//! `tests/vdb/make_corpus.py`).

mod common;

use common::{corpus_file, truth};
use serde_json::Value as Json;
use tyndall_vdb::{Grid, GridClass, GridInfo, Scalar, VdbError, VdbFile};

fn number(json: &Json) -> f64 {
    json.as_f64().expect("a number")
}

fn text(json: &Json) -> &str {
    json.as_str().expect("a string")
}

fn triple(json: &Json) -> [i32; 3] {
    std::array::from_fn(|axis| json[axis].as_i64().and_then(|c| i32::try_from(c).ok()).expect("a coordinate"))
}

/// Compares in the grid's own type, so doubles and integers must agree to the last bit.
fn compare<T: Scalar>(grid: &Grid<T>, entry: &Json, label: &str) {
    assert_eq!(grid.background.to_f64(), number(&entry["background"]), "{label}: background");
    assert_eq!(Some(grid.active_voxel_count()), entry["active"].as_u64(), "{label}: active voxels");
    assert_eq!(Some(grid.leaves.len() as u64), entry["leaves"].as_u64(), "{label}: leaves");
    // OpenVDB's values are summed exactly; 64-bit sums here err by at most n eps sum|v|, and n < 2^14 values.
    let tolerance = 1e-11 * number(&entry["absolute_sum"]);
    assert!((grid.sum() - number(&entry["sum"])).abs() <= tolerance, "{label}: sum {}", grid.sum());
    let bounds =
        (!entry["bounds"].is_null()).then(|| (triple(&entry["bounds"][0]), triple(&entry["bounds"][1])));
    assert_eq!(grid.active_bounds(), bounds, "{label}: bounds");
    for sample in entry["samples"].as_array().expect("samples") {
        let voxel = triple(sample);
        assert_eq!(grid.value(voxel).to_f64(), number(&sample[3]), "{label}: value at {voxel:?}");
        assert_eq!(Some(grid.is_active(voxel)), sample[4].as_bool(), "{label}: state of {voxel:?}");
    }
}

fn compare_transform<T: Scalar>(grid: &Grid<T>, info: &GridInfo, entry: &Json, label: &str) {
    let corners = entry["corners"].as_array().expect("corners");
    let index = [glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z];
    for (index, corner) in index.into_iter().zip(corners) {
        let expected = glam::DVec3::from_array(std::array::from_fn(|axis| number(&corner[axis])));
        let found = grid.file_from_index.transform_point3(index);
        // OpenVDB adds the terms of a matrix product in another order.
        assert!(
            found.distance(expected) <= 1e-14 * (1.0 + expected.length()),
            "{label}: {index} is at {found}"
        );
    }
    assert_eq!(info.file_from_index, Some(grid.file_from_index), "{label}");
}

fn class_name(class: GridClass) -> &'static str {
    match class {
        GridClass::Unknown => "unknown",
        GridClass::LevelSet => "level set",
        GridClass::FogVolume => "fog volume",
        GridClass::Staggered => "staggered",
    }
}

fn check_as<T: Scalar>(file: &VdbFile, info: &GridInfo, entry: &Json, label: &str) {
    let grid = file.read_grid_as::<T>(&info.name, Some(info.index)).expect(label);
    compare(&grid, entry, label);
    compare_transform(&grid, info, entry, label);
    let as_float = file.read_grid(&info.name, Some(info.index)).expect(label);
    assert_eq!(as_float.leaves.len(), grid.leaves.len(), "{label}");
    for (narrow, wide) in as_float.leaves.iter().zip(&grid.leaves) {
        assert_eq!(narrow.values, wide.values.map(T::to_f32), "{label}");
    }
}

#[test]
fn every_grid_agrees_with_openvdb() {
    let entries = truth();
    assert!(entries.len() >= 50, "only {} grids in the corpus", entries.len());
    for entry in &entries {
        let (name, index) = (text(&entry["name"]), entry["index"].as_u64().expect("an index") as usize);
        let label = format!("{} {name}[{index}]", text(&entry["file"]));
        let file = VdbFile::from_bytes(corpus_file(text(&entry["file"]))).expect(&label);
        let info = file.grids().iter().find(|g| g.name == name && g.index == index).expect(&label);
        assert_eq!(class_name(info.class), text(&entry["class"]), "{label}");
        if entry["corners"].is_null() {
            let error = file.read_grid(name, Some(index)).expect_err(&label);
            assert!(matches!(error, VdbError::UnsupportedGrid { .. }), "{label}: {error}");
            continue;
        }
        match text(&entry["type"]) {
            "float" => check_as::<f32>(&file, info, entry, &label),
            "double" => check_as::<f64>(&file, info, entry, &label),
            "int32" => check_as::<i32>(&file, info, entry, &label),
            "int64" => check_as::<i64>(&file, info, entry, &label),
            other => panic!("{label}: no check for {other}"),
        }
    }
}

#[test]
fn every_file_lists_all_its_grids() {
    let entries = truth();
    for entry in &entries {
        let name = text(&entry["file"]);
        let file = VdbFile::from_bytes(corpus_file(name)).expect(name);
        let expected = entries.iter().filter(|other| other["file"] == entry["file"]).count();
        assert_eq!((file.grids().len(), file.n_unlisted_grids()), (expected, 0), "{name}");
    }
}

#[test]
fn unsupported_grids_are_named_and_leave_the_others_readable() {
    let file = VdbFile::from_bytes(corpus_file("native_other_types.vdb")).expect("opens");
    for (name, kind) in [("other0", "bool"), ("other1", "vec3s"), ("other2", "points")] {
        let error = file.read_grid(name, None).expect_err(name).to_string();
        assert!(error.contains(name) && error.contains(kind), "{error}");
    }
    assert!(file.read_grid("density", None).is_ok());
    let vectors = file.read_grid_as::<[f32; 3]>("other1", None).expect("vectors");
    assert_eq!((vectors.active_voxel_count(), vectors.value([3, 3, 3])), (64, [1.0, 2.0, 3.0]));
    let frustum = VdbFile::from_bytes(corpus_file("native_transforms.vdb")).expect("opens");
    let error = frustum.read_grid("frustum", None).expect_err("frustum").to_string();
    assert!(error.contains("frustum transform"), "{error}");
}

#[test]
fn names_choose_grids() {
    let file = VdbFile::from_bytes(corpus_file("native_same_names.vdb")).expect("opens");
    let names: Vec<_> = file.grids().iter().map(|grid| (grid.name.as_str(), grid.index)).collect();
    assert_eq!(names, [("density", 0), ("heat", 0), ("density", 1)]);
    let count = |name, index| file.read_grid(name, index).expect(name).active_voxel_count();
    assert_eq!(count("density", None), count("density", Some(0)));
    assert_eq!(count("density[1]", None), count("density", Some(1)));
    assert_ne!(count("density", Some(0)), count("density", Some(1)));
    let error = file.read_grid("density", Some(2)).expect_err("no third").to_string();
    assert_eq!(error, "no grid named \"density\" with index 2; the file has density, heat, density[1]");
    assert!(matches!(file.read_grid("smoke", None), Err(VdbError::NoSuchGrid { .. })));
}

#[test]
fn instances_share_the_tree_but_not_the_transform() {
    let file = VdbFile::from_bytes(corpus_file("native_instance.vdb")).expect("opens");
    let original = file.read_grid("original", None).expect("original");
    let instance = file.read_grid("instance", None).expect("instance");
    assert!(file.grids()[1].is_instance && !file.grids()[0].is_instance);
    assert_eq!(original.leaves, instance.leaves);
    assert_eq!(instance.file_from_index.matrix3, glam::DMat3::from_diagonal(glam::DVec3::splat(0.125)));
}

/// The layouts of versions 219 and 220 differ from 221 by nothing (220) and by the missing compression flag (219).
#[test]
fn versions_219_and_220_read_like_221() {
    const VERSION_AT: usize = 8;
    const FLAG_AT: usize = 21;
    let bytes = corpus_file("version_221.vdb");
    let expected =
        VdbFile::from_bytes(bytes.clone()).and_then(|f| f.read_grid("density", None)).expect("221");
    let mut v220 = bytes.clone();
    v220[VERSION_AT] = 220;
    let mut v219 = bytes;
    v219[VERSION_AT] = 219;
    v219.remove(FLAG_AT);
    // The offsets in the descriptor move with the removed byte.
    let offsets_at =
        v219.windows(24).position(|w| w == b"\x10\0\0\0Tree_float_5_4_3\0\0\0\0").expect("type") + 24;
    for at in [offsets_at, offsets_at + 8, offsets_at + 16] {
        let offset = i64::from_le_bytes(v219[at..at + 8].try_into().expect("eight bytes")) - 1;
        v219[at..at + 8].copy_from_slice(&offset.to_le_bytes());
    }
    for (version, bytes) in [(220, v220), (219, v219)] {
        let file = VdbFile::from_bytes(bytes).expect("opens");
        assert_eq!(file.version(), version);
        assert_eq!(file.read_grid("density", None).expect("reads").leaves, expected.leaves, "{version}");
    }
}

#[test]
fn other_tree_shapes_are_refused_by_name() {
    let mut bytes = corpus_file("native_half.vdb");
    let at = bytes.windows(16).position(|w| w == b"Tree_float_5_4_3").expect("type");
    bytes[at + 15] = b'4';
    let file = VdbFile::from_bytes(bytes).expect("opens");
    let error = file.read_grid("density", None).expect_err("5_4_4").to_string();
    assert!(error.contains("tree shape 5_4_4"), "{error}");
}

/// Nothing tells how long a tree of unknown type is, so a stream file ends there.
#[test]
fn a_stream_file_is_listed_up_to_the_first_unknown_type() {
    let mut bytes = corpus_file("stream.vdb");
    assert_eq!(VdbFile::from_bytes(bytes.clone()).expect("opens").grids().len(), 3);
    let at = bytes.windows(10).position(|w| w == b"Tree_float").expect("type");
    bytes[at..at + 10].copy_from_slice(b"Tree_quark");
    let file = VdbFile::from_bytes(bytes).expect("opens");
    assert_eq!((file.grids().len(), file.n_unlisted_grids()), (1, 2));
    let error = file.read_grid("a", None).expect_err("quarks").to_string();
    assert!(error.contains("quark"), "{error}");
    let error = file.read_grid("c", None).expect_err("unreachable").to_string();
    assert!(error.contains("2 that cannot be reached"), "{error}");
}

//! The corpora: files in every storage form, against what OpenVDB 12 reads from them (`truth.json.gz`, made by
//! `tests/vdb/make_corpus.py`), and NanoVDB files against NVIDIA Warp (`tests/vdb/make_nano_corpus.py`).

mod common;

use common::{corpus_file, corpus_path};
use half::f16;
use serde_json::Value as Json;
use tyndall_vdb::{Grid, GridClass, GridInfo, Scalar, Value, VdbError, VdbFile};

/// The facts about each grid of each file: `corpus` are OpenVDB's files, `corpus_nano` NanoVDB's.
fn truth(corpus: &str) -> Vec<Json> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let packed = std::fs::read(format!("{path}/{corpus}/truth.json.gz")).expect(corpus);
    serde_json::from_reader(flate2::read::GzDecoder::new(&packed[..])).expect(corpus)
}

fn number(json: &Json) -> f64 {
    json.as_f64().expect("a number")
}

fn text(json: &Json) -> &str {
    json.as_str().expect("a string")
}

fn list(json: &Json) -> &[Json] {
    json.as_array().expect("a list")
}

fn triple(json: &Json) -> [i32; 3] {
    std::array::from_fn(|axis| json[axis].as_i64().and_then(|c| i32::try_from(c).ok()).expect("a coordinate"))
}

/// A value as the list of its numbers, as the truth has it.
trait Numbers: Value {
    fn numbers(self) -> Vec<f64>;
    /// Whether this is the value meant; 64-bit integers are compared as such.
    fn is(self, json: &[Json]) -> bool {
        self.numbers() == json.iter().map(number).collect::<Vec<_>>()
    }
}

macro_rules! numbers {
    ($($scalar:ty),*) => {
        $(impl Numbers for $scalar {
            fn numbers(self) -> Vec<f64> {
                vec![self.to_f64()]
            }
        })*
    };
}

numbers!(f32, f64, f16, i32, bool);

impl Numbers for i64 {
    fn numbers(self) -> Vec<f64> {
        vec![self.to_f64()]
    }
    fn is(self, json: &[Json]) -> bool {
        json.len() == 1 && json[0].as_i64() == Some(self)
    }
}

impl<T: Scalar> Numbers for [T; 3]
where
    [T; 3]: Value,
{
    fn numbers(self) -> Vec<f64> {
        self.iter().map(|c| c.to_f64()).collect()
    }
}

/// Each component's sum over all active voxels.
fn sums<T: Numbers>(grid: &Grid<T>) -> Vec<f64> {
    let mut sums = vec![0.0; grid.background.numbers().len()];
    let mut add = |value: T, count: f64| {
        sums.iter_mut().zip(value.numbers()).for_each(|(sum, number)| *sum += number * count);
    };
    for leaf in &grid.leaves {
        leaf.active_offsets().for_each(|offset| add(leaf.values[offset], 1.0));
    }
    for tile in grid.tiles.iter().filter(|tile| tile.active) {
        add(tile.value, tile.voxel_count() as f64);
    }
    sums
}

/// Compares in the grid's own type, so doubles and integers must agree to the last bit.
fn compare<T: Numbers>(grid: &Grid<T>, entry: &Json, label: &str) {
    assert!(grid.background.is(list(&entry["background"])), "{label}: background {:?}", grid.background);
    assert_eq!(Some(grid.active_voxel_count()), entry["active"].as_u64(), "{label}: active voxels");
    assert_eq!(Some(grid.leaves.len() as u64), entry["leaves"].as_u64(), "{label}: leaves");
    // OpenVDB's values are summed exactly; 64-bit sums here err by at most n eps sum|v|, and n < 2^14 values.
    let expected = list(&entry["sum"]).iter().zip(list(&entry["absolute_sum"]));
    for (found, (expected, absolute)) in sums(grid).into_iter().zip(expected) {
        assert!((found - number(expected)).abs() <= 1e-11 * number(absolute), "{label}: sum {found}");
    }
    let bounds =
        (!entry["bounds"].is_null()).then(|| (triple(&entry["bounds"][0]), triple(&entry["bounds"][1])));
    assert_eq!(grid.active_bounds(), bounds, "{label}: bounds");
    for sample in list(&entry["samples"]) {
        let (voxel, value) = (triple(sample), grid.value(triple(sample)));
        assert_eq!(Some(grid.is_active(voxel)), sample[3].as_bool(), "{label}: state of {voxel:?}");
        assert!(value.is(&list(sample)[4..]), "{label}: {value:?} at {voxel:?}");
    }
}

fn compare_transform<T: Value>(grid: &Grid<T>, info: &GridInfo, entry: &Json, label: &str) {
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

fn check<T: Numbers>(file: &VdbFile, info: &GridInfo, entry: &Json, label: &str) -> Grid<T> {
    let grid = file.read_grid_as::<T>(&info.name, Some(info.index)).expect(label);
    compare(&grid, entry, label);
    compare_transform(&grid, info, entry, label);
    grid
}

/// Also read as floats.
fn check_scalar<T: Scalar + Numbers>(file: &VdbFile, info: &GridInfo, entry: &Json, label: &str) {
    let grid = check::<T>(file, info, entry, label);
    let as_float = file.read_grid(&info.name, Some(info.index)).expect(label);
    assert_eq!(as_float.background, grid.background.to_f32(), "{label}");
    assert_eq!(
        (as_float.leaves.len(), as_float.tiles.len()),
        (grid.leaves.len(), grid.tiles.len()),
        "{label}"
    );
    for (narrow, wide) in as_float.leaves.iter().zip(&grid.leaves) {
        assert_eq!((narrow.origin, narrow.active), (wide.origin, wide.active), "{label}");
        assert_eq!(narrow.values, wide.values.map(T::to_f32), "{label}");
    }
    for (narrow, wide) in as_float.tiles.iter().zip(&grid.tiles) {
        assert_eq!((narrow.origin, narrow.value), (wide.origin, wide.value.to_f32()), "{label}");
    }
}

fn check_entry(file: &VdbFile, entry: &Json, label: &str) {
    let (name, index) = (text(&entry["name"]), entry["index"].as_u64().expect("an index") as usize);
    let info = file.grids().iter().find(|g| g.name == name && g.index == index).expect(label);
    assert_eq!(class_name(info.class), text(&entry["class"]), "{label}");
    if entry["corners"].is_null() {
        let error = file.read_grid(name, Some(index)).expect_err(label);
        assert!(matches!(error, VdbError::UnsupportedGrid { .. }), "{label}: {error}");
        return;
    }
    match text(&entry["type"]) {
        "float" => check_scalar::<f32>(file, info, entry, label),
        "double" => check_scalar::<f64>(file, info, entry, label),
        "half" => check_scalar::<f16>(file, info, entry, label),
        "int32" => check_scalar::<i32>(file, info, entry, label),
        "int64" => check_scalar::<i64>(file, info, entry, label),
        "bool" | "mask" => check_scalar::<bool>(file, info, entry, label),
        "vec3s" => drop(check::<[f32; 3]>(file, info, entry, label)),
        "vec3d" => drop(check::<[f64; 3]>(file, info, entry, label)),
        "vec3i" => drop(check::<[i32; 3]>(file, info, entry, label)),
        other => panic!("{label}: no check for {other}"),
    }
}

/// Every file twice: from memory, and from disk through positioned reads.
fn check_corpus(corpus: &str, least_grids: usize) {
    let entries = truth(corpus);
    let n_samples: usize = entries.iter().filter_map(|entry| entry["samples"].as_array()).map(Vec::len).sum();
    assert!(entries.len() >= least_grids && n_samples > 300 * entries.len(), "{n_samples} samples");
    for entry in &entries {
        let name = text(&entry["file"]);
        let label = format!("{name} {}[{}]", entry["name"], entry["index"]);
        check_entry(&VdbFile::from_bytes(corpus_file(name)).expect(&label), entry, &label);
        check_entry(&VdbFile::open(&corpus_path(name)).expect(&label), entry, &label);
    }
}

#[test]
fn every_grid_agrees_with_openvdb() {
    check_corpus("corpus", 100);
}

#[test]
fn every_nano_grid_agrees_with_nanovdb() {
    check_corpus("corpus_nano", 30);
}

#[test]
fn every_file_lists_all_its_grids() {
    let entries = [truth("corpus"), truth("corpus_nano")].concat();
    for entry in &entries {
        let name = text(&entry["file"]);
        let file = VdbFile::open(&corpus_path(name)).expect(name);
        let expected = entries.iter().filter(|other| other["file"] == entry["file"]).count();
        assert_eq!((file.grids().len(), file.n_unlisted_grids()), (expected, 0), "{name}");
    }
}

/// A grid that nobody asks for may be damaged: it is never read.
#[test]
fn only_the_grid_asked_for_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("density_and_velocity.vdb");
    let mut bytes = corpus_file("native_same_names.vdb");
    // The body of `heat`, which is larger than what opening the file reads of it.
    let heat = bytes.windows(8).position(|w| w == b"\x04\0\0\0heat").expect("heat");
    let offsets = heat + 8 + 4 + 16 + 4;
    let end = i64::from_le_bytes(bytes[offsets + 16..offsets + 24].try_into().expect("eight bytes")) as usize;
    bytes[end - 2000..end].fill(0xff);
    std::fs::write(&path, bytes).expect("writes");
    let file = VdbFile::open(&path).expect("opens");
    assert!(file.read_grid("heat", None).is_err());
    assert!(file.read_grid("density", Some(0)).is_ok() && file.read_grid("density", Some(1)).is_ok());
}

#[test]
fn unsupported_grids_are_named_and_leave_the_others_readable() {
    let file = VdbFile::from_bytes(corpus_file("native_other_types.vdb")).expect("opens");
    for (name, kind) in [("other1", "vec3s"), ("other2", "points")] {
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

#[test]
fn other_tree_shapes_are_refused_by_name() {
    let mut bytes = corpus_file("native_half.vdb");
    let at = bytes.windows(16).position(|w| w == b"Tree_float_5_4_3").expect("type");
    bytes[at + 15] = b'4';
    let file = VdbFile::from_bytes(bytes).expect("opens");
    let error = file.read_grid("density", None).expect_err("5_4_4").to_string();
    assert!(error.contains("tree shape 5_4_4"), "{error}");
}

#[test]
fn nano_types_that_are_not_read_are_named() {
    let mut bytes = corpus_file("raw.nvdb");
    // Behind the segment with the name "density" and its zero byte; the type is 636 bytes into the grid.
    let at = 16 + 176 + 8 + 636;
    assert_eq!(bytes[at], 1);
    for (kind, expected) in [(9, "NanoVDB Half"), (20, "NanoVDB OnIndex"), (200, "type 200")] {
        bytes[at] = kind;
        let file = VdbFile::from_bytes(bytes.clone()).expect("opens");
        assert_eq!(file.grids()[0].value_type.to_string(), expected);
        let error = file.read_grid("density", None).expect_err(expected).to_string();
        assert!(error.contains("density") && error.contains(expected), "{error}");
    }
}

#[test]
fn nano_files_that_are_not_read_say_why() {
    let refused = |at: usize, new: &[u8]| {
        let mut bytes = corpus_file("type_float_zip.nvdb");
        bytes[at..at + new.len()].copy_from_slice(new);
        VdbFile::from_bytes(bytes).expect_err("refused").to_string()
    };
    assert!(
        refused(8, &(33_u32 << 21).to_le_bytes()).contains("its version is 33.0.0, versions 32.x are read")
    );
    assert!(refused(14, &[3]).contains("codec 3"));
    assert!(refused(0, b"2BDVonaN").contains("big-endian"));
    assert!(refused(0, b"NanoVDB9").contains("magic number"));
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

//! Written files read back equal; OpenVDB's own verdict on them comes from `tests/vdb/check_written.py`.

mod common;

use std::path::{Path, PathBuf};

use common::corpus_file;
use glam::{DAffine3, DMat3, DVec3};
use proptest::prelude::*;
use tyndall_vdb::{
    FogGrid, Grid, GridBuilder, GridClass, Leaf, MetaValue, Tile, Value, ValueType, VdbError, VdbFile,
    WriteCompression, write_fog, write_grids,
};

const BOTH: [WriteCompression; 2] = [WriteCompression::None, WriteCompression::Zip];

fn read_back(path: &Path, name: &str) -> Grid {
    VdbFile::open(path).and_then(|file| file.read_grid(name, None)).expect("reads back")
}

/// Leaves and tiles in a fixed order: the writer sorts them.
fn sorted<T: Value>(mut grid: Grid<T>) -> (Vec<Leaf<T>>, Vec<Tile<T>>) {
    grid.leaves.sort_by_key(|leaf| leaf.origin);
    grid.tiles.sort_by_key(|tile| tile.origin);
    (grid.leaves, grid.tiles)
}

#[test]
fn trees_of_all_kinds_survive() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("copy.vdb");
    for (file, name) in [
        ("native_tiles.vdb", "tiles"),
        ("native_codes.vdb", "codes"),
        ("native_far.vdb", "far"),
        ("native_fog.vdb", "density"),
        ("native_empty.vdb", "nothing"),
        ("native_level_set.vdb", "surface"),
    ] {
        for compression in BOTH {
            let read =
                || VdbFile::from_bytes(corpus_file(file)).and_then(|f| f.read_grid(name, None)).expect(file);
            write_fog(&path, &[read()], compression).expect(file);
            let copy = read_back(&path, name);
            assert_eq!(copy.background, read().background, "{file}");
            let kept =
                if read().class == GridClass::LevelSet { GridClass::LevelSet } else { GridClass::FogVolume };
            assert_eq!(copy.class, kept, "{file}");
            assert_eq!(sorted(copy), sorted(read()), "{file} {compression:?}");
        }
    }
    let left_over: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left_over.len(), 1, "temporary files remain: {left_over:?}");
}

#[test]
fn floats_and_vectors_share_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mixed.vdb");
    let open = |file: &str| VdbFile::from_bytes(corpus_file(file)).expect(file);
    let density = open("native_tiles.vdb").read_grid("tiles", None).expect("tiles");
    let colour = open("type_vec3s.vdb").read_grid_as::<[f32; 3]>("vec3s", None).expect("vectors");
    let velocity = open("native_vectors.vdb").read_grid_as::<[f32; 3]>("v", None).expect("velocity");
    assert_eq!(velocity.class, GridClass::Staggered);
    for compression in BOTH {
        let grids: [FogGrid<'_>; 3] = [(&density).into(), (&colour).into(), (&velocity).into()];
        write_grids(&path, &grids, compression).expect("writes");
        let file = VdbFile::open(&path).expect("opens");
        let listed: Vec<_> = file.grids().iter().map(|grid| (&grid.value_type, grid.class)).collect();
        assert_eq!(
            listed,
            [
                (&ValueType::Float, GridClass::FogVolume),
                (&ValueType::Vec3s, GridClass::FogVolume),
                (&ValueType::Vec3s, GridClass::Staggered),
            ]
        );
        let vectors = |name| file.read_grid_as::<[f32; 3]>(name, None).expect(name);
        assert_eq!(vectors("vec3s").background, colour.background);
        assert_eq!(sorted(vectors("vec3s")), sorted(colour.clone()), "{compression:?}");
        assert_eq!(sorted(vectors("v")), sorted(velocity.clone()), "{compression:?}");
        assert_eq!(sorted(read_back(&path, "tiles")), sorted(density.clone()), "{compression:?}");
    }
}

#[test]
fn transforms_names_and_metadata_survive() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("several.vdb");
    let scale = DMat3::from_diagonal(DVec3::new(0.5, 0.25, 2.0));
    let maps = [
        DAffine3::from_scale(DVec3::splat(0.1)),
        DAffine3::from_mat3_translation(scale, DVec3::new(1.0, 2.0, 3.0)),
        DAffine3::from_mat3_translation(DMat3::from_rotation_y(0.7) * scale, DVec3::new(-1.0, 2.0, 3.0)),
    ];
    let build = |map| {
        let builder = GridBuilder::from_dense("same", [1, 1, 1], [5, 6, 7], &[2.0], map);
        builder.metadata("frame", MetaValue::Int32(12)).metadata("class", MetaValue::Bool(true)).build()
    };
    let grids: Vec<Grid> = maps.into_iter().map(|map| build(map).expect("valid")).collect();
    write_fog(&path, &grids, WriteCompression::None).expect("writes");
    let file = VdbFile::open(&path).expect("opens");
    for (index, map) in maps.into_iter().enumerate() {
        let info = &file.grids()[index];
        assert_eq!((info.name.as_str(), info.index, info.class), ("same", index, GridClass::FogVolume));
        assert_eq!(info.file_from_index, Some(map));
        assert_eq!(info.meta("frame"), Some(&MetaValue::Int32(12)));
        assert_eq!(info.meta("file_voxel_count"), Some(&MetaValue::Int64(1)));
        assert_eq!(info.meta("file_bbox_min"), Some(&MetaValue::Vec3i([5, 6, 7])));
        assert_eq!(info.metadata.iter().filter(|(key, _)| key == "class").count(), 1);
    }
}

#[test]
fn the_same_grids_give_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let values: Vec<f32> = (0..40 * 40 * 40).map(|i| (i % 97) as f32).collect();
    let grid =
        GridBuilder::from_dense("d", [40; 3], [-3; 3], &values, DAffine3::IDENTITY).build().expect("valid");
    let bytes = ["a.vdb", "b.vdb"].map(|name| {
        write_fog(&folder.path().join(name), std::slice::from_ref(&grid), WriteCompression::Zip)
            .expect("writes");
        std::fs::read(folder.path().join(name)).expect("reads")
    });
    assert_eq!(bytes[0], bytes[1]);
}

#[test]
fn what_cannot_be_written_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bad.vdb");
    let grid = |leaves: &[[i32; 3]], tiles: &[([i32; 3], u8)]| {
        let mut grid = Grid::new("bad", 0.0, DAffine3::IDENTITY);
        grid.leaves = leaves.iter().map(|&origin| Leaf::uniform(origin, 1.0)).collect();
        grid.tiles = tiles
            .iter()
            .map(|&(origin, size_log2)| Tile { origin, size_log2, value: 1.0, active: true })
            .collect();
        grid
    };
    let bad = [
        grid(&[[1, 0, 0]], &[]),
        grid(&[[0; 3], [0; 3]], &[]),
        grid(&[[8, 0, 0]], &[([0; 3], 7)]),
        grid(&[[8, 0, 0]], &[([0; 3], 12)]),
        grid(&[], &[([0; 3], 12), ([128, 0, 0], 7)]),
        grid(&[], &[([0; 3], 5)]),
        Grid::new("two\x1enames", 0.0, DAffine3::IDENTITY),
    ];
    for grid in bad {
        let result = write_fog(&path, &[grid], WriteCompression::None);
        assert!(matches!(result, Err(VdbError::InvalidGrid { .. })), "{result:?}");
    }
    assert!(!path.exists());
    let nowhere = folder.path().join("missing/folder.vdb");
    let error = write_fog(&nowhere, &[], WriteCompression::None).expect_err("no folder").to_string();
    assert!(error.contains("folder.vdb"), "{error}");
}

/// The value `tests/vdb/check_written.py` expects: exact in 32 bits, zero for two voxels in three.
fn formula(x: i32, y: i32, z: i32) -> f32 {
    if (x + y + z).rem_euclid(3) == 0 {
        1.0 + x as f32 * 0.5 + y as f32 * 0.25 + z as f32 * 0.125
    } else {
        0.0
    }
}

/// Leaves files for OpenVDB to judge in the build's folder for temporary files.
#[test]
fn files_for_the_referee() {
    let (dims, origin) = ([30_usize, 21, 17], [-11, 5, -140]);
    let mut values = Vec::new();
    for x in 0..30 {
        for y in 0..21 {
            values.extend((0..17).map(|z| formula(x + origin[0], y + origin[1], z + origin[2])));
        }
    }
    let map = DAffine3::from_mat3_translation(
        DMat3::from_diagonal(DVec3::new(0.5, 0.5, 0.25)),
        DVec3::new(1.0, 2.0, 3.0),
    );
    let build =
        |name: &str, map| GridBuilder::from_dense(name, dims, origin, &values, map).build().expect("valid");
    let rotated = DAffine3::from_rotation_z(0.5) * map;
    let vectors: Vec<[f32; 3]> = values.iter().map(|&v| [v, -2.0 * v, 0.0]).collect();
    let velocity = GridBuilder::from_dense("v", dims, origin, &vectors, map).build().expect("valid");
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("written");
    std::fs::create_dir_all(&folder).expect("a folder");
    for (compression, name) in BOTH.into_iter().zip(["none", "zip"]) {
        let grids = [build("density", map), build("density", rotated), build("heat", map)];
        let grids: Vec<FogGrid<'_>> = grids.iter().map(FogGrid::from).chain([(&velocity).into()]).collect();
        write_grids(&folder.join(format!("dense_{name}.vdb")), &grids, compression).expect("writes");
        for (file, grid) in
            [("native_tiles.vdb", "tiles"), ("native_codes.vdb", "codes"), ("native_far.vdb", "far")]
        {
            let read =
                VdbFile::from_bytes(corpus_file(file)).and_then(|f| f.read_grid(grid, None)).expect(file);
            write_fog(&folder.join(format!("{grid}_{name}.vdb")), &[read], compression).expect("writes");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any dense array comes back voxel by voxel.
    #[test]
    fn dense_arrays_survive(
        dims in prop::array::uniform3(1_usize..12),
        origin in prop::array::uniform3(-5000_i32..5000),
        seed in any::<u64>(),
        background in prop::sample::select(vec![0.0_f32, 1.0, -2.5]),
    ) {
        let n = dims[0] * dims[1] * dims[2];
        let mut state = seed | 1;
        let values: Vec<f32> = (0..n).map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            if state >> 62 == 0 { f32::from_bits((state >> 32) as u32) } else { background }
        }).collect();
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("dense.vdb");
        let builder = GridBuilder::from_dense("d", dims, origin, &values, DAffine3::IDENTITY);
        let grid = builder.background(background).build().expect("valid");
        write_fog(&path, &[grid], WriteCompression::Zip).expect("writes");
        let copy = read_back(&path, "d");
        prop_assert_eq!(copy.active_voxel_count(), values.iter().filter(|&&v| v != background).count() as u64);
        for (i, &value) in values.iter().enumerate() {
            let local = [i / (dims[1] * dims[2]), i / dims[2] % dims[1], i % dims[2]];
            let voxel = std::array::from_fn(|axis| origin[axis] + local[axis] as i32);
            prop_assert_eq!(copy.value(voxel).to_bits(), value.to_bits());
        }
    }
}

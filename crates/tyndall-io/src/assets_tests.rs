//! Caching, invalidation, sharing between threads.

use super::*;
use crate::{ViewTransform, write_png};
use glam::DAffine3;
use std::thread;
use std::time::Duration;
use tyndall_vdb::{GridBuilder, WriteCompression, write_fog};

fn write_grey(path: &Path, value: f32, width: usize) {
    write_png(path, width, 1, &[value, value, value, 1.0].repeat(width), ViewTransform::Srgb, &[]).unwrap();
}

#[test]
fn a_file_is_read_once_per_colour_space() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    write_grey(&path, 0.5, 1);
    let assets = FileAssets::new();
    let first = assets.image(&path, ColorSpace::Auto).unwrap();
    assert!(Arc::ptr_eq(&first, &assets.image(&path, ColorSpace::Auto).unwrap()));
    let raw = assets.image(&path, ColorSpace::Raw).unwrap();
    assert!(raw.pixels[0][0] > first.pixels[0][0] + 0.1);
    assets.clear();
    assert!(!Arc::ptr_eq(&first, &assets.image(&path, ColorSpace::Auto).unwrap()));
}

#[test]
fn what_nobody_asks_for_is_forgotten() {
    let folder = tempfile::tempdir().unwrap();
    let assets = FileAssets::new();
    let frames = ["a.png", "b.png"].map(|name| folder.path().join(name));
    let still = folder.path().join("still.png");
    frames.iter().chain([&still]).for_each(|path| write_grey(path, 0.5, 1));
    let first = assets.image(&still, ColorSpace::Auto).unwrap();
    for path in &frames {
        assets.image(path, ColorSpace::Auto).unwrap();
        assert!(Arc::ptr_eq(&first, &assets.image(&still, ColorSpace::Auto).unwrap()));
        assets.drop_unused();
        assert_eq!(assets.images.lock().len(), 2, "{path:?} and the one that stays");
    }
}

#[test]
fn a_changed_file_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let assets = FileAssets::new();
    write_grey(&path, 0.5, 1);
    let old = assets.image(&path, ColorSpace::Auto).unwrap();
    write_grey(&path, 0.1, 3);
    // Same length is told by the time.
    let file = fs::File::options().write(true).open(&path).unwrap();
    file.set_modified(SystemTime::now() + Duration::from_secs(10)).unwrap();
    let new = assets.image(&path, ColorSpace::Auto).unwrap();
    assert_eq!((old.width, new.width), (1, 3));
    assert_eq!(assets.images.lock().len(), 1, "the old content is forgotten");
}

#[test]
fn errors_name_the_file_and_are_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("late.png");
    let assets = FileAssets::new();
    let error = assets.image(&path, ColorSpace::Auto).unwrap_err();
    assert!(error.message.contains("late.png"), "{error}");
    write_grey(&path, 0.5, 1);
    assert!(assets.image(&path, ColorSpace::Auto).is_ok());
}

#[test]
fn threads_share_one_copy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    write_grey(&path, 0.5, 64);
    let assets = FileAssets::new();
    let images: Vec<_> = thread::scope(|scope| {
        let threads: Vec<_> =
            (0..8).map(|_| scope.spawn(|| assets.image(&path, ColorSpace::Auto).unwrap())).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    let cached = assets.image(&path, ColorSpace::Auto).unwrap();
    assert!(images.iter().all(|image| Arc::ptr_eq(image, &cached)));
}

#[test]
fn grids_are_read_once_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("smoke.vdb");
    let build = |name: &str, value: f32| {
        GridBuilder::from_dense(name, [1, 1, 2], [3, 4, 5], &[value, 0.0], DAffine3::IDENTITY)
            .build()
            .unwrap()
    };
    let grids = [build("density", 0.5), build("heat", 2.0)];
    write_fog(&path, &grids, WriteCompression::Zip).unwrap();
    let assets = FileAssets::new();
    let density = assets.vdb_grid(&path, "density", None).unwrap();
    let FieldGrid::Scalar(numbers) = &*density else { panic!("a float grid") };
    assert_eq!((numbers.value([3, 4, 5]), numbers.active_voxel_count()), (0.5, 1));
    assert!(Arc::ptr_eq(&density, &assets.vdb_grid(&path, "density", None).unwrap()));
    let FieldGrid::Scalar(heat) = &*assets.vdb_grid(&path, "heat", Some(0)).unwrap() else {
        panic!("a float grid")
    };
    assert_eq!(heat.value([3, 4, 5]), 2.0);
    let message = assets.vdb_grid(&path, "Density", None).unwrap_err().message;
    assert!(message.contains("smoke.vdb") && message.contains("density, heat"), "{message}");
}

#[test]
fn grid_errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("smoke.vdb");
    let assets = FileAssets::new();
    let message = |assets: &FileAssets| assets.vdb_grid(&path, "density", None).unwrap_err().message;
    assert!(message(&assets).contains("smoke.vdb"));
    fs::write(&path, "not a grid").unwrap();
    assert!(message(&assets).contains("smoke.vdb"));
}

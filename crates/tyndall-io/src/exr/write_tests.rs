//! What is written is what is read, and what cannot be written says why.

use super::*;
use crate::{ExrImage, read_exr};
use proptest::prelude::*;
use std::fs;
use std::path::PathBuf;

fn scratch(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

fn write(path: &Path, size: (usize, usize), layers: &[Layer]) -> Result<ExrImage, IoError> {
    write_exr(path, size.0, size.1, 1.0, layers, &[], ExrCompression::Zip)?;
    read_exr(path)
}

fn ramp(n: usize) -> Vec<f32> {
    (0..n).map(|i| (i as f32 * 0.37).sin() * 10f32.powi(i as i32 % 5)).collect()
}

fn plane(data: &[f32], n_channels: usize, i: usize) -> Vec<f32> {
    data.iter().skip(i).step_by(n_channels).copied().collect()
}

#[test]
fn layers_survive_at_any_size_and_compression() {
    let (_folder, path) = scratch("a.exr");
    use ExrCompression::{None, Piz, Zip, Zips};
    for (w, h) in [(1, 1), (1, 77), (77, 1), (3, 5), (64, 33), (131, 70)] {
        for compression in [None, Zips, Zip, Piz] {
            let rgba = ramp(w * h * 4);
            let depth = ramp(w * h);
            let layers = [
                Layer::new("rgba", "RGBA", rgba.clone(), SampleType::Float),
                Layer::new("depth", "Z", depth.clone(), SampleType::Float),
            ];
            write_exr(&path, w, h, 1.0, &layers, &[], compression).unwrap();
            let image = read_exr(&path).unwrap();
            assert_eq!((image.width, image.height), (w, h));
            for (i, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
                assert_eq!(
                    image.channel(name).unwrap(),
                    plane(&rgba, 4, i),
                    "{name} {w}x{h} {compression:?}"
                );
            }
            assert_eq!(image.channel("depth.Z").unwrap(), depth);
        }
    }
}

#[test]
fn channels_are_named_the_openexr_way() {
    let (_folder, path) = scratch("a.exr");
    let layer =
        |name: &str, channels: &str| Layer::new(name, channels, ramp(2 * channels.len()), SampleType::Half);
    let layers = [layer("", "RGBA"), layer("albedo", "RGB"), layer("normal", "XYZ"), layer("samples", "Y")];
    let image = write(&path, (2, 1), &layers).unwrap();
    let names: Vec<_> = image.channels.iter().map(|(n, _)| n.as_str()).collect();
    let expected = "A B G R albedo.B albedo.G albedo.R normal.X normal.Y normal.Z samples.Y";
    assert_eq!(names, expected.split(' ').collect::<Vec<_>>());
}

#[test]
fn half_layers_clamp_and_float_layers_do_not() {
    let (_folder, path) = scratch("a.exr");
    let values = vec![1e6, -1e6, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 65504.0, 1e-12, 0.5];
    let layers = [
        Layer::new("h", "Y", values.clone(), SampleType::Half),
        Layer::new("f", "Y", values.clone(), SampleType::Float),
    ];
    let image = write(&path, (8, 1), &layers).unwrap();
    let half = image.channel("h.Y").unwrap();
    assert_eq!(half[..4], [65504.0, -65504.0, 65504.0, -65504.0]);
    assert!(half[4].is_nan());
    assert_eq!(half[5..], [65504.0, 0.0, 0.5]);
    let float = image.channel("f.Y").unwrap();
    assert!(float.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn integers_saturate() {
    let (_folder, path) = scratch("a.exr");
    let layer = Layer::new("id", "Y", vec![0.9, 7.0, -3.0, 1e20, f32::NAN, 16_777_216.0], SampleType::Uint);
    let image = write(&path, (6, 1), &[layer]).unwrap();
    assert_eq!(image.channel("id.Y").unwrap(), [0.0, 7.0, 0.0, u32::MAX as f32, 0.0, 16_777_216.0]);
}

#[test]
fn metadata_and_pixel_aspect_survive() {
    let (_folder, path) = scratch("a.exr");
    let metadata = [
        ("software".to_owned(), MetaValue::Text("Tyndall 0.1".into())),
        ("tyndall:scene".to_owned(), MetaValue::Text("Wölkchen ☁".into())),
        ("tyndall:spp".to_owned(), MetaValue::Int(-256)),
        ("tyndall:seconds".to_owned(), MetaValue::Float(1.25)),
    ];
    let layer = Layer::new("", "Y", vec![1.0], SampleType::Float);
    write_exr(&path, 1, 1, 1.5, &[layer], &metadata, ExrCompression::Zip).unwrap();
    let image = read_exr(&path).unwrap();
    assert_eq!(image.pixel_aspect, 1.5);
    assert_eq!(image.metadata.len(), metadata.len());
    for (key, value) in &metadata {
        assert_eq!(image.meta(key), Some(value));
    }
}

#[test]
fn mistakes_are_named_and_keep_the_old_file() {
    let (folder, path) = scratch("a.exr");
    fs::write(&path, "old").unwrap();
    let layer =
        |name: &str, channels: &str, n: usize| Layer::new(name, channels, vec![0.0; n], SampleType::Half);
    let write = |w, h, aspect, layers: &[Layer], key: &str| {
        let metadata = [(key.to_owned(), MetaValue::Int(1))];
        write_exr(&path, w, h, aspect, layers, &metadata, ExrCompression::Zip).unwrap_err().to_string()
    };
    let good = [layer("x", "Y", 4)];
    for (error, part) in [
        (write(2, 2, 1.0, &[layer("x", "RGB", 4)], "k"), "not 2 x 2 x 3 channels"),
        (write(2, 2, 1.0, &[layer("x", "YY", 8)], "k"), "two channels are named \"x.Y\""),
        (write(2, 2, 1.0, &[layer("", "Y", 4), layer("rgba", "Y", 4)], "k"), "two channels are named \"Y\""),
        (write(2, 2, 1.0, &[], "k"), "no channels"),
        (write(0, 2, 1.0, &good, "k"), "0 x 2"),
        (write(usize::MAX, 2, 1.0, &good, "k"), "cannot be stored"),
        (write(2, 2, f32::NAN, &good, "k"), "pixel aspect"),
        (write(2, 2, 1.0, &good, ""), "metadata key"),
        (write(2, 2, 1.0, &good, "dataWindow"), "dataWindow"),
    ] {
        assert!(error.contains(part) && error.contains("a.exr"), "{error}");
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let missing = write_exr(&folder.path().join("b/c.exr"), 2, 2, 1.0, &good, &[], ExrCompression::Zip);
    assert!(matches!(missing, Err(IoError::FolderMissing { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn any_floats_survive_bit_for_bit(w in 1usize..40, h in 1usize..40, seed in any::<u32>()) {
        let (_folder, path) = scratch("a.exr");
        let bits = |i: usize| (i as u32).wrapping_mul(2_654_435_761).wrapping_add(seed).rotate_left(13);
        let data: Vec<_> = (0..w * h).map(|i| f32::from_bits(bits(i))).collect();
        let image = write(&path, (w, h), &[Layer::new("p", "X", data.clone(), SampleType::Float)]).unwrap();
        let read = image.channel("p.X").unwrap();
        prop_assert!(read.iter().zip(&data).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

//! The curve against the specification's landmarks, and files read back by the decoder.

use super::*;
use proptest::prelude::*;
use std::fs;
use std::io::Cursor;

fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    ViewTransform::KhronosNeutral.apply(rgb)
}

#[test]
fn dark_and_mid_colours_only_lose_the_reflection() {
    // Above 0.08 the offset is 0.04 exactly, below it is x - 6.25 x^2 (specification, "Fresnel compensation").
    let [r, g, b] = neutral([0.5, 0.3, 0.1]);
    assert!((r - 0.46).abs() < 1e-6 && (g - 0.26).abs() < 1e-6 && (b - 0.06).abs() < 1e-6);
    let [r, _, b] = neutral([0.5, 0.3, 0.04]);
    assert!((r - 0.47).abs() < 1e-6 && (b - 0.01).abs() < 1e-6);
    assert_eq!(neutral([0.0; 3]), [0.0; 3]);
}

#[test]
fn greys_are_compressed_as_specified_and_stay_grey() {
    // Peak p = 2 - 0.04: 1 - 0.24^2 / (p + 0.24 - 0.76) = 0.96.
    let [r, g, b] = neutral([2.0; 3]);
    assert!((r - 0.96).abs() < 1e-6 && r == g && g == b, "{r}");
}

#[test]
fn highlights_roll_off_to_white() {
    let [r, g, b] = neutral([1e6, 10.0, 10.0]);
    assert!(r > 0.999 && g > 0.99 && b > 0.99);
    for bad in [f32::INFINITY, 3e38] {
        assert_eq!(neutral([bad; 3]), [1.0; 3]);
    }
    assert_eq!(neutral([f32::NAN, -1.0, f32::NEG_INFINITY]), [0.0; 3]);
}

proptest! {
    #[test]
    fn the_curve_is_monotone_for_greys_and_bounded(a in 0f32..50.0, step in 0f32..1.0, tint in 0f32..50.0) {
        prop_assert!(neutral([a + step; 3])[0] >= neutral([a; 3])[0] - 1e-6);
        for view in [ViewTransform::Srgb, ViewTransform::KhronosNeutral] {
            prop_assert!(view.apply([a, tint, step]).iter().all(|v| (0.0..=1.0).contains(v)));
        }
    }
}

fn decode(path: &Path) -> (png::OutputInfo, Vec<u8>, png::Info<'static>) {
    let mut reader = png::Decoder::new(Cursor::new(fs::read(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    reader.finish().unwrap();
    (frame, bytes, reader.info().clone())
}

#[test]
fn opaque_images_are_rgb_with_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let rgba = [0.0, 0.214_041_14, 1.0, 1.0].repeat(77);
    let metadata = [
        ("Software".to_owned(), MetaValue::Text("Tyndall".into())),
        ("Title".to_owned(), MetaValue::Text("Wölkchen ☁".into())),
        ("spp".to_owned(), MetaValue::Int(64)),
    ];
    write_png(&path, 1, 77, &rgba, ViewTransform::Srgb, &metadata).unwrap();
    let (frame, bytes, info) = decode(&path);
    assert_eq!((frame.width, frame.height, frame.color_type), (1, 77, ColorType::Rgb));
    assert_eq!(bytes, [0, 128, 255].repeat(77));
    assert_eq!(info.srgb, Some(SrgbRenderingIntent::Perceptual));
    let text: Vec<_> = info.uncompressed_latin1_text.iter().map(|t| (&*t.keyword, &*t.text)).collect();
    assert_eq!(text, [("Software", "Tyndall"), ("spp", "64")]);
    assert_eq!(info.utf8_text[0].get_text().unwrap(), "Wölkchen ☁");
}

#[test]
fn alpha_is_straight_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let rgba = [0.5, 0.25, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, f32::NAN, 2.0, -1.0, 1.0];
    write_png(&path, 3, 1, &rgba, ViewTransform::Srgb, &[]).unwrap();
    let (frame, bytes, _) = decode(&path);
    assert_eq!(frame.color_type, ColorType::Rgba);
    assert_eq!(bytes, [255, 188, 0, 128, 0, 0, 0, 0, 0, 255, 0, 255]);
}

#[test]
fn mistakes_are_named_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let write = |w, h, n: usize, key: &str| {
        let metadata = [(key.to_owned(), MetaValue::Int(1))];
        write_png(&path, w, h, &vec![0.5; n], ViewTransform::Srgb, &metadata).unwrap_err().to_string()
    };
    let long_key = "k".repeat(80);
    for (error, part) in [
        (write(0, 1, 0, "k"), "0 x 1"),
        (write(1 << 40, 1, 4, "k"), "choose another resolution"),
        (write(2, 2, 4, "k"), "not 2 x 2 x 4"),
        (write(1, 1, 4, ""), "a.png"),
        (write(1, 1, 4, &long_key), "a.png"),
    ] {
        assert!(error.contains(part) && error.contains("a.png"), "{error}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

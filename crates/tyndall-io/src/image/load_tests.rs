//! Colour spaces, formats, and damaged files.

use super::*;
use crate::{ExrCompression, Layer, SampleType, ViewTransform, write_exr, write_png};
use image::{ExtendedColorType, ImageEncoder};
use proptest::prelude::*;
use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

fn scratch(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

fn encoded(format: ImageFormat, size: (u32, u32), color: ExtendedColorType, bytes: &[u8]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    match format {
        ImageFormat::Png => {
            image::codecs::png::PngEncoder::new(&mut out).write_image(bytes, size.0, size.1, color).unwrap();
        }
        _ => image::write_buffer_with_format(&mut out, bytes, size.0, size.1, color, format).unwrap(),
    }
    out.into_inner()
}

fn load(name: &str, bytes: &[u8], color_space: ColorSpace) -> Result<ImageData, IoError> {
    let (_folder, path) = scratch(name);
    fs::write(&path, bytes).unwrap();
    load_image(&path, color_space)
}

fn close(a: [f32; 4], b: [f32; 4]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-6)
}

#[test]
fn auto_follows_bits_and_channels() {
    use ExtendedColorType::{L8, La8, Rgb8, Rgb16, Rgba8};
    let g = 188.0 / 255.0;
    let linear = rec709_from_srgb(g);
    let wide = f32::from(0x1234u16) / 65535.0;
    let rgb16: Vec<u8> = [0x1234u16; 3].iter().flat_map(|v| v.to_ne_bytes()).collect();
    for (color, bytes, auto, srgb, raw) in [
        (Rgb8, vec![188, 188, 0], [linear, linear, 0., 1.], [linear, linear, 0., 1.], [g, g, 0., 1.]),
        (Rgba8, vec![0, 188, 0, 188], [0., linear, 0., g], [0., linear, 0., g], [0., g, 0., g]),
        (L8, vec![188], [g, g, g, 1.], [linear, linear, linear, 1.], [g, g, g, 1.]),
        (La8, vec![188, 188], [g, g, g, g], [linear, linear, linear, g], [g, g, g, g]),
        (
            Rgb16,
            rgb16,
            [wide, wide, wide, 1.],
            [rec709_from_srgb(wide); 3].map_alpha(),
            [wide, wide, wide, 1.],
        ),
    ] {
        let file = encoded(ImageFormat::Png, (1, 1), color, &bytes);
        for (space, expected) in [(ColorSpace::Auto, auto), (ColorSpace::Srgb, srgb), (ColorSpace::Raw, raw)]
        {
            let image = load("a.png", &file, space).unwrap();
            assert!(
                close(image.pixels[0], expected),
                "{color:?} {space:?}: {:?} not {expected:?}",
                image.pixels[0]
            );
        }
    }
}

trait WithAlpha {
    fn map_alpha(self) -> [f32; 4];
}

impl WithAlpha for [f32; 3] {
    fn map_alpha(self) -> [f32; 4] {
        [self[0], self[1], self[2], 1.0]
    }
}

#[test]
fn every_raster_format_loads_at_odd_sizes() {
    for (w, h) in [(1, 1), (1, 77), (13, 3)] {
        let bytes: Vec<u8> = (0..w * h * 3).map(|i| (i * 5 % 251) as u8).collect();
        for (format, name) in
            [(ImageFormat::Png, "a.png"), (ImageFormat::Bmp, "a.BMP"), (ImageFormat::Tga, "a.tga")]
        {
            let file = encoded(format, (w, h), ExtendedColorType::Rgb8, &bytes);
            let image = load(name, &file, ColorSpace::Raw).unwrap();
            assert_eq!((image.width, image.height), (w as usize, h as usize));
            for (pixel, b) in image.pixels.iter().zip(bytes.chunks(3)) {
                assert!(close(*pixel, [b[0], b[1], b[2], 255].map(|v| f32::from(v) / 255.0)), "{name}");
            }
        }
    }
    // JPEG is lossy, and is recognised under a wrong name.
    let file = encoded(ImageFormat::Jpeg, (16, 8), ExtendedColorType::Rgb8, &[200; 16 * 8 * 3]);
    let image = load("a.png", &file, ColorSpace::Raw).unwrap();
    assert!((image.pixels[77][1] - 200.0 / 255.0).abs() < 0.01);
}

fn hdr_file() -> Vec<u8> {
    let pixels: Vec<u8> =
        [[0.25f32, 4.0, 1000.0], [0.0, 0.5, 1.0]].iter().flatten().flat_map(|v| v.to_ne_bytes()).collect();
    let mut out = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut out)
        .write_image(&pixels, 2, 1, ExtendedColorType::Rgb32F)
        .unwrap();
    out
}

#[test]
fn radiance_files_keep_their_range() {
    let image = load("sky.hdr", &hdr_file(), ColorSpace::Auto).unwrap();
    assert_eq!((image.width, image.height), (2, 1));
    assert!((image.pixels[0][2] - 1000.0).abs() < 4.0 && (image.pixels[1][1] - 0.5).abs() < 0.01);
}

fn exr_pixels(layers: &[Layer], space: ColorSpace) -> Vec<[f32; 4]> {
    let (_folder, path) = scratch("a.exr");
    write_exr(&path, 2, 1, 1.0, layers, &[], ExrCompression::Zip).unwrap();
    load_image(&path, space).unwrap().pixels
}

#[test]
fn exr_layers_are_chosen_by_name() {
    let layer = |name: &str, channels: &str, data: &[f32]| {
        Layer::new(name, channels, data.to_vec(), SampleType::Float)
    };
    let rgb = layer("", "RGB", &[1., 2., 3., 4., 5., 6.]);
    let albedo = layer("albedo", "RGBA", &[7., 8., 9., 0.5, 7., 8., 9., 0.5]);
    let depth = layer("depth", "Z", &[3., 4.]);
    let auto = ColorSpace::Auto;
    assert_eq!(exr_pixels(&[albedo.clone(), rgb], auto), [[1., 2., 3., 1.], [4., 5., 6., 1.]]);
    assert_eq!(exr_pixels(&[depth.clone(), albedo], auto), [[7., 8., 9., 0.5]; 2]);
    assert_eq!(exr_pixels(&[depth], auto), [[3., 3., 3., 1.], [4., 4., 4., 1.]]);
    let grey = layer("", "Y", &[0.5, 1.0]);
    assert!((exr_pixels(std::slice::from_ref(&grey), ColorSpace::Srgb)[0][0] - 0.214_041).abs() < 1e-5);
}

#[test]
fn numbers_that_are_none_do_not_reach_the_renderer() {
    let data = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0, -2.0, 3e38];
    let pixels = exr_pixels(&[Layer::new("", "RGB", data, SampleType::Float)], ColorSpace::Raw);
    assert_eq!(pixels, [[0.0, 65504.0, -65504.0, 1.0], [1.0, -2.0, 3e38, 1.0]]);
}

#[test]
fn unknown_formats_name_the_known_ones() {
    for (name, bytes) in
        [("a.webp", &b"RIFF\x10\0\0\0WEBPVP8 "[..]), ("a.txt", b"hello"), ("noextension", b"x")]
    {
        let error = load(name, bytes, ColorSpace::Auto).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, IoError::Unsupported { .. }), "{text}");
        assert!(text.contains(name) && text.contains("exr, hdr, png, jpg, bmp, tga"), "{text}");
    }
    assert!(matches!(load("a.png", b"hello", ColorSpace::Auto), Err(IoError::Damaged { .. })));
    assert!(matches!(load("a.png", b"", ColorSpace::Auto), Err(IoError::Damaged { .. })));
    assert!(matches!(load_image("no/such.png".as_ref(), ColorSpace::Auto), Err(IoError::Read { .. })));
}

#[test]
fn headers_announcing_gigabytes_are_refused() {
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n\x02\x02\x01\x01".to_vec();
    let mut tga = vec![0u8; 18];
    (tga[2], tga[16]) = (10, 32);
    tga[12..16].fill(0xff);
    let mut bmp = encoded(ImageFormat::Bmp, (1, 1), ExtendedColorType::Rgb8, &[0; 3]);
    bmp[18..22].copy_from_slice(&60_000i32.to_le_bytes());
    bmp[22..26].copy_from_slice(&60_000i32.to_le_bytes());
    for (name, bytes) in [("a.hdr", hdr), ("a.tga", tga), ("a.bmp", bmp)] {
        let error = load(name, &bytes, ColorSpace::Auto).unwrap_err();
        assert!(matches!(error, IoError::TooLarge { .. } | IoError::Damaged { .. }), "{error}");
    }
}

fn sample_files() -> Vec<(&'static str, Vec<u8>)> {
    let bytes: Vec<u8> = (0..16 * 16 * 3).map(|i| (i * 7 % 256) as u8).collect();
    let make = |format| encoded(format, (16, 16), ExtendedColorType::Rgb8, &bytes);
    vec![
        ("a.png", make(ImageFormat::Png)),
        ("a.jpg", make(ImageFormat::Jpeg)),
        ("a.bmp", make(ImageFormat::Bmp)),
        ("a.tga", make(ImageFormat::Tga)),
        ("a.hdr", hdr_file()),
    ]
}

#[test]
fn truncated_files_are_errors() {
    for (name, bytes) in sample_files() {
        for len in [0, 1, 2, 10, bytes.len() / 4, bytes.len() / 2] {
            let result = load(name, &bytes[..len], ColorSpace::Auto);
            // A JPEG decoder may show the part of the picture that is there.
            assert!(result.is_err() || name == "a.jpg", "{name} cut at {len} of {}", bytes.len());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn mutated_files_never_panic(
        kind in 0usize..5,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        in_header in any::<bool>(),
    ) {
        let (name, mut bytes) = sample_files().swap_remove(kind);
        let len = if in_header { 60.min(bytes.len()) } else { bytes.len() };
        for (index, value) in edits {
            bytes[index.index(len)] = value;
        }
        if let Ok(image) = load(name, &bytes, ColorSpace::Auto) {
            prop_assert_eq!(image.pixels.len(), image.width * image.height);
            prop_assert!(image.pixels.iter().flatten().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn our_own_previews_come_back() {
    let (_folder, path) = scratch("a.png");
    let rgba = [0.5, 0.25, 0.0, 1.0, 1.0, 0.125, 0.03, 1.0];
    write_png(&path, 2, 1, &rgba, ViewTransform::Srgb, &[]).unwrap();
    let image = load_image(&path, ColorSpace::Auto).unwrap();
    assert!(image.pixels.iter().flatten().zip(rgba).all(|(a, b)| (a - b).abs() < 0.004));
}

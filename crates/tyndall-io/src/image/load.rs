//! Reads a texture into linear f32 RGBA.
//!
//! The format is recognised by content, so a PNG called `.jpg` loads; only TGA, which has no signature, goes by name.

use crate::limits::{check_decoded_bytes, decoded_limit, guard_decoder, image_bytes};
use crate::{IoError, read_exr};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use tyndall_math::rec709_from_srgb;
use tyndall_scene::{ColorSpace, ImageData};

/// The texture formats [`load_image`] reads, for messages and file dialogs.
pub const SUPPORTED_TEXTURES: &[&str] = &["exr", "hdr", "png", "jpg", "bmp", "tga"];

const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// The image at `path`, linear, row 0 at the top.
///
/// [`ColorSpace::Auto`] takes 8-bit files of three or more channels as sRGB and everything else as it is. Grey is spread
/// to RGB, alpha is never converted and 1 where missing. NaN becomes 0 and infinities the largest half (65504): a
/// clipped sun in a dome texture is common and must not poison a render.
/// Of an EXR file the bare `R G B A` are taken, else those of its first layer, else its first channel as grey.
///
/// # Errors
/// The file is missing, damaged, larger than its bytes can account for, or of an unknown format.
pub fn load_image(path: &Path, color_space: ColorSpace) -> Result<ImageData, IoError> {
    let file = File::open(path).map_err(|e| IoError::read(path, e))?;
    let file_bytes = file.metadata().map_err(|e| IoError::read(path, e))?.len();
    let mut reader = BufReader::new(file);
    let start = reader.fill_buf().map_err(|e| IoError::read(path, e))?;
    let mut image = if start.starts_with(&EXR_MAGIC) {
        load_exr(path, color_space)
    } else {
        let format = recognise(path, start)?;
        guard_decoder(path, || load_raster(path, reader, format, file_bytes, color_space))
    }?;
    image.pixels.par_iter_mut().for_each(|pixel| *pixel = pixel.map(finite));
    Ok(image)
}

fn finite(value: f32) -> f32 {
    match value {
        v if v.is_nan() => 0.0,
        v if v.is_infinite() => 65504f32.copysign(v),
        v => v,
    }
}

fn recognise(path: &Path, start: &[u8]) -> Result<ImageFormat, IoError> {
    if start.is_empty() {
        return Err(IoError::damaged(path, "it is empty"));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match image::guess_format(start) {
        Ok(f @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Hdr | ImageFormat::Bmp)) => Ok(f),
        Err(_) if extension == "tga" => Ok(ImageFormat::Tga),
        Err(_) if SUPPORTED_TEXTURES.contains(&extension.as_str()) || extension == "jpeg" => {
            Err(IoError::damaged(path, format!("it does not begin like a .{extension} file")))
        }
        other => {
            let kind = other.map(|f| format!("{f:?} images are")).unwrap_or("this kind of file is".into());
            let known = SUPPORTED_TEXTURES.join(", ");
            Err(IoError::unsupported(path, format!("{kind} not supported; convert it to one of {known}")))
        }
    }
}

fn load_raster(
    path: &Path,
    reader: BufReader<File>,
    format: ImageFormat,
    file_bytes: u64,
    color_space: ColorSpace,
) -> Result<ImageData, IoError> {
    let mut reader = ImageReader::with_format(reader, format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(decoded_limit(file_bytes));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| decode_error(path, e))?;
    let (width, height) = decoder.dimensions();
    // Counts the decoder's own buffer and ours of four floats.
    let per_pixel = 16 + usize::from(decoder.color_type().bytes_per_pixel());
    check_decoded_bytes(path, image_bytes(width as usize, height as usize, per_pixel), file_bytes)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|e| decode_error(path, e))?;

    let mut pixels = rgba_pixels(&decoded);
    let is_8_bit_colour = matches!(decoded, DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_));
    if color_space == ColorSpace::Srgb || (color_space == ColorSpace::Auto && is_8_bit_colour) {
        linearise(&mut pixels);
    }
    Ok(ImageData { width: width as usize, height: height as usize, pixels })
}

fn decode_error(path: &Path, error: ImageError) -> IoError {
    match error {
        ImageError::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            IoError::read(path, source)
        }
        ImageError::Unsupported(what) => {
            IoError::unsupported(path, format!("{what}; save it as 8-bit or 16-bit PNG, or as EXR"))
        }
        other => IoError::damaged(path, other),
    }
}

/// Integers are scaled to [0, 1]; nothing else is changed.
fn rgba_pixels(image: &DynamicImage) -> Vec<[f32; 4]> {
    let from_u8 = |v: u8| f32::from(v) / 255.0;
    let from_u16 = |v: u16| f32::from(v) / 65535.0;
    match image {
        DynamicImage::ImageLuma8(i) => spread::<1, _>(i, from_u8),
        DynamicImage::ImageLumaA8(i) => spread::<2, _>(i, from_u8),
        DynamicImage::ImageRgb8(i) => spread::<3, _>(i, from_u8),
        DynamicImage::ImageRgba8(i) => spread::<4, _>(i, from_u8),
        DynamicImage::ImageLuma16(i) => spread::<1, _>(i, from_u16),
        DynamicImage::ImageLumaA16(i) => spread::<2, _>(i, from_u16),
        DynamicImage::ImageRgb16(i) => spread::<3, _>(i, from_u16),
        DynamicImage::ImageRgba16(i) => spread::<4, _>(i, from_u16),
        DynamicImage::ImageRgb32F(i) => spread::<3, _>(i, |v: f32| v),
        // The remaining kind, and any the library may add.
        other => spread::<4, _>(&other.to_rgba32f(), |v: f32| v),
    }
}

/// `N` interleaved channels to four: grey is spread, missing alpha is 1.
fn spread<const N: usize, T: Copy + Sync>(samples: &[T], to_f32: impl Fn(T) -> f32 + Sync) -> Vec<[f32; 4]> {
    let pixel = |c: &[T; N]| match N {
        1 | 2 => {
            let grey = to_f32(c[0]);
            [grey, grey, grey, if N == 2 { to_f32(c[N - 1]) } else { 1.0 }]
        }
        // The remainder only keeps the indices of the unused cases in bounds.
        _ => [to_f32(c[0]), to_f32(c[1 % N]), to_f32(c[2 % N]), if N == 4 { to_f32(c[N - 1]) } else { 1.0 }],
    };
    samples.as_chunks::<N>().0.par_iter().map(pixel).collect()
}

fn linearise(pixels: &mut [[f32; 4]]) {
    pixels.par_iter_mut().for_each(|[r, g, b, _]| {
        for value in [r, g, b] {
            *value = rec709_from_srgb(*value);
        }
    });
}

fn load_exr(path: &Path, color_space: ColorSpace) -> Result<ImageData, IoError> {
    let image = read_exr(path)?;
    let name_is = |name: &str| image.channels.iter().any(|(n, _)| n == name);
    // "" for the main layer, else "layer.".
    let prefix = match image.channels.iter().find_map(|(n, _)| n.strip_suffix(".R")) {
        Some(layer) if !name_is("R") => format!("{layer}."),
        _ => String::new(),
    };
    let grey = || image.channel("Y").unwrap_or(&image.channels[0].1);
    let channel = |c: &str| image.channel(&format!("{prefix}{c}"));
    let red = channel("R").unwrap_or_else(grey);
    let (green, blue, alpha) = (channel("G").unwrap_or(red), channel("B").unwrap_or(red), channel("A"));
    let pixel = |i: usize| [red[i], green[i], blue[i], alpha.map_or(1.0, |a| a[i])];
    let mut pixels: Vec<_> = (0..red.len()).into_par_iter().map(pixel).collect();
    if color_space == ColorSpace::Srgb {
        linearise(&mut pixels);
    }
    Ok(ImageData { width: image.width, height: image.height, pixels })
}

#[cfg(test)]
#[path = "load_tests.rs"]
mod tests;

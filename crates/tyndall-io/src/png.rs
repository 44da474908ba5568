//! 8-bit previews out.

use crate::{IoError, MetaValue, write_atomically};
use png::{BitDepth, ColorType, EncodingError, SrgbRenderingIntent};
use rayon::prelude::*;
use std::path::Path;
use tyndall_math::srgb_from_rec709;

/// How scene-referred light becomes display values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ViewTransform {
    /// Clips at 1 and encodes as sRGB: what data and already graded images need.
    Srgb,
    /// Khronos PBR Neutral: leaves colours below 0.76 nearly untouched, rolls highlights off to white
    /// (Khronos Group 2024, <https://github.com/KhronosGroup/ToneMapping>).
    #[default]
    KhronosNeutral,
}

impl ViewTransform {
    /// Linear display values in [0, 1] of a linear Rec.709 colour; negative and NaN channels count as 0.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // The bound keeps infinities out of the curve.
        let rgb = rgb.map(|v| if v.is_nan() { 0.0 } else { v.clamp(0.0, 1e9) });
        match self {
            Self::Srgb => rgb.map(|v| v.min(1.0)),
            Self::KhronosNeutral => khronos_neutral(rgb).map(|v| v.clamp(0.0, 1.0)),
        }
    }
}

/// The curve of the specification. Fresnel reflection of a dielectric adds 0.04 to every colour; the curve takes it off
/// again, compresses peaks above 0.8 - 0.04 hyperbolically towards 1 and desaturates them as they are compressed.
fn khronos_neutral(rgb: [f32; 3]) -> [f32; 3] {
    const START_COMPRESSION: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let lowest = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if lowest < 0.08 { lowest - 6.25 * lowest * lowest } else { 0.04 };
    let rgb = rgb.map(|v| v - offset);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < START_COMPRESSION {
        return rgb;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let towards_white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    rgb.map(|v| {
        let v = v * (new_peak / peak);
        v + (new_peak - v) * towards_white
    })
}

/// Writes an 8-bit sRGB file to `path`, atomically (see [`write_atomically`]).
///
/// `rgba` is linear Rec.709, premultiplied, row-major with row 0 at the top: `4 * width * height` numbers. An opaque
/// image is stored as RGB, any other as RGBA with straight alpha, which is what PNG means; light without coverage
/// (alpha 0) keeps its colour but viewers do not show it. `metadata` becomes text chunks.
///
/// # Errors
/// The folder is missing, the disk refused, the buffer's size does not fit, or a metadata key is not a PNG keyword
/// (1 to 79 Latin-1 letters).
pub fn write_png(
    path: &Path,
    width: usize,
    height: usize,
    rgba: &[f32],
    view: ViewTransform,
    metadata: &[(String, MetaValue)],
) -> Result<(), IoError> {
    let invalid = |reason: String| IoError::invalid_image(path, reason);
    let dimension = |n: usize| u32::try_from(n).ok().filter(|&n| n > 0 && n <= i32::MAX as u32);
    let (Some(w), Some(h)) = (dimension(width), dimension(height)) else {
        return Err(invalid(format!(
            "a PNG of {width} x {height} pixels is not possible; choose another resolution"
        )));
    };
    if width.checked_mul(height).and_then(|n| n.checked_mul(4)) != Some(rgba.len()) {
        return Err(invalid(format!("the image has {} numbers, not {width} x {height} x 4", rgba.len())));
    }
    let pixels = rgba.as_chunks::<4>().0;
    let is_opaque = pixels.par_iter().all(|p| p[3] >= 1.0);
    let bytes = encode(pixels, view, is_opaque);

    write_atomically(path, |file| {
        let error = |e: EncodingError| match e {
            EncodingError::IoError(source) => IoError::write(path, source),
            other => IoError::invalid_image(path, other),
        };
        let mut encoder = png::Encoder::new(file, w, h);
        encoder.set_color(if is_opaque { ColorType::Rgb } else { ColorType::Rgba });
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
        for (key, value) in metadata {
            let text = value.to_string();
            let added = if text.is_ascii() {
                encoder.add_text_chunk(key.clone(), text)
            } else {
                encoder.add_itxt_chunk(key.clone(), text)
            };
            added.map_err(error)?;
        }
        let mut writer = encoder.write_header().map_err(error)?;
        writer.write_image_data(&bytes).map_err(error)?;
        writer.finish().map_err(error)
    })
}

/// Display bytes, three or four a pixel.
fn encode(pixels: &[[f32; 4]], view: ViewTransform, is_opaque: bool) -> Vec<u8> {
    let n = if is_opaque { 3 } else { 4 };
    let mut bytes = vec![0; pixels.len() * n];
    bytes.par_chunks_mut(n).zip(pixels).for_each(|(target, &[r, g, b, a])| {
        // Straight colour: what covers the pixel, as bright as it is.
        let coverage = if a > 0.0 && a < 1.0 { a } else { 1.0 };
        let display = view.apply([r / coverage, g / coverage, b / coverage]);
        let values =
            [srgb_from_rec709(display[0]), srgb_from_rec709(display[1]), srgb_from_rec709(display[2]), a];
        // `as` saturates and turns NaN into 0.
        target.iter_mut().zip(values).for_each(|(t, v)| *t = (v * 255.0 + 0.5) as u8);
    });
    bytes
}

#[cfg(test)]
#[path = "png_tests.rs"]
mod tests;

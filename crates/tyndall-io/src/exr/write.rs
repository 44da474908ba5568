//! Multi-layer OpenEXR files out.

use crate::{IoError, MetaValue, write_atomically};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, FlatSamples, Image, LayerAttributes, LineOrder,
    Text, WritableImage,
};
use half::f16;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

/// How the numbers of a layer are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleType {
    /// 16-bit float: values beyond ±65504 and infinities are stored as ±65504, NaN as NaN.
    Half,
    /// 32-bit float, exactly as given.
    #[default]
    Float,
    /// 32-bit unsigned integer: rounded down, negative and NaN as 0, too large as `u32::MAX`.
    Uint,
}

/// How the pixels are packed; all are lossless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ExrCompression {
    /// None: fastest, for checkpoints.
    None,
    /// Deflate over one row.
    Zips,
    /// Deflate over sixteen rows.
    #[default]
    Zip,
    /// Wavelets: smaller than deflate for grainy halves.
    Piz,
}

/// One layer (AOV) of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// `""` or `"rgba"` is the main layer, whose channels have no prefix; else `"albedo"`, `"depth"`, …
    pub name: String,
    /// `R G B A`, `X Y Z`, `Z`, … in the order of `data`.
    pub channels: Vec<String>,
    /// Row-major, channels interleaved, row 0 at the top: `width * height * channels` numbers.
    pub data: Vec<f32>,
    /// How the numbers are stored.
    pub sample_type: SampleType,
}

impl Layer {
    /// A layer of `channels`, one letter each (`"RGBA"`, `"XYZ"`, `"Z"`).
    pub fn new(name: impl Into<String>, channels: &str, data: Vec<f32>, sample_type: SampleType) -> Self {
        Self { name: name.into(), channels: channels.chars().map(String::from).collect(), data, sample_type }
    }

    fn channel_name(&self, channel: &str) -> String {
        match self.name.as_str() {
            "" | "rgba" => channel.to_owned(),
            name => format!("{name}.{channel}"),
        }
    }
}

/// Writes one part holding all `layers` to `path`, atomically (see [`write_atomically`]).
///
/// `pixel_aspect` is a pixel's width over its height, 1 for square ones. Keys of `metadata` become attributes;
/// `software`, `comments`, `owner` and `capDate` become the standard ones (text only).
///
/// # Errors
/// The folder is missing, the disk refused, a layer's size is not `width * height * channels`, two channels have the
/// same name, or a metadata key is one of OpenEXR's own.
pub fn write_exr(
    path: &Path,
    width: usize,
    height: usize,
    pixel_aspect: f32,
    layers: &[Layer],
    metadata: &[(String, MetaValue)],
    compression: ExrCompression,
) -> Result<(), IoError> {
    check(width, height, pixel_aspect, layers).map_err(|reason| IoError::invalid_image(path, reason))?;
    let channels: Vec<_> = layers.par_iter().flat_map(planar_channels).collect();
    let encoding = exr::image::Encoding {
        compression: match compression {
            ExrCompression::None => Compression::Uncompressed,
            ExrCompression::Zips => Compression::ZIP1,
            ExrCompression::Zip => Compression::ZIP16,
            ExrCompression::Piz => Compression::PIZ,
        },
        blocks: exr::image::Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let attributes = attributes(metadata).map_err(|reason| IoError::invalid_image(path, reason))?;
    let part =
        exr::image::Layer::new((width, height), attributes, encoding, AnyChannels::sort(channels.into()));
    let mut image = Image::from_layer(part);
    image.attributes.pixel_aspect = pixel_aspect;

    write_atomically(path, |file| image.write().to_buffered(file).map_err(|e| write_error(path, e)))
}

fn write_error(path: &Path, error: exr::error::Error) -> IoError {
    match error {
        exr::error::Error::Io(source) => IoError::write(path, source),
        other => IoError::invalid_image(path, other),
    }
}

/// What the encoder would panic at or write unreadably.
fn check(width: usize, height: usize, pixel_aspect: f32, layers: &[Layer]) -> Result<(), String> {
    // OpenEXR stores windows as i32 and keeps them below half of its range.
    let largest = i32::MAX as usize / 2;
    if width == 0 || height == 0 || width >= largest || height >= largest {
        return Err(format!(
            "an image of {width} x {height} pixels cannot be stored; choose a resolution above zero"
        ));
    }
    if !(1e-6..=1e6).contains(&pixel_aspect) {
        return Err(format!("pixel aspect {pixel_aspect} is not between 1e-6 and 1e6"));
    }
    let mut names = BTreeSet::new();
    for layer in layers {
        let expected = width.checked_mul(height).and_then(|n| n.checked_mul(layer.channels.len()));
        if expected != Some(layer.data.len()) {
            return Err(format!(
                "layer {:?} has {} numbers, not {width} x {height} x {} channels",
                layer.name,
                layer.data.len(),
                layer.channels.len()
            ));
        }
        for name in layer.channels.iter().map(|c| layer.channel_name(c)) {
            if layer.channels.iter().any(String::is_empty) || name.len() > 255 || name.contains('\0') {
                return Err(format!("channel name {name:?} is empty, too long or contains a zero byte"));
            }
            if !names.insert(name.clone()) {
                return Err(format!("two channels are named {name:?}; give the layers different names"));
            }
        }
    }
    if names.is_empty() { Err("it has no channels; ask for at least one AOV".into()) } else { Ok(()) }
}

/// One plane per channel, narrowed to the layer's sample type.
fn planar_channels(layer: &Layer) -> Vec<AnyChannel<FlatSamples>> {
    let n_channels = layer.channels.len();
    let plane = |(i, name): (usize, &String)| {
        let values = layer.data.iter().skip(i).step_by(n_channels).copied();
        let samples = match layer.sample_type {
            SampleType::Half => FlatSamples::F16(values.map(to_half).collect()),
            SampleType::Float => FlatSamples::F32(values.collect()),
            // `as` saturates and turns NaN into 0.
            SampleType::Uint => FlatSamples::U32(values.map(|v| v as u32).collect()),
        };
        AnyChannel::new(text(&layer.channel_name(name)), samples)
    };
    layer.channels.iter().enumerate().map(plane).collect()
}

fn to_half(value: f32) -> f16 {
    // NaN stays NaN: `clamp` hands it on.
    f16::from_f32(value.clamp(-65504.0, 65504.0))
}

/// UTF-8 bytes as OpenEXR text, which is bytes of unspecified encoding.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn attributes(metadata: &[(String, MetaValue)]) -> Result<LayerAttributes, String> {
    let mut attributes = LayerAttributes::default();
    for (key, value) in metadata {
        if key.is_empty() || key.len() > 255 || key.contains('\0') {
            return Err(format!("metadata key {key:?} is empty, too long or contains a zero byte"));
        }
        match (key.as_str(), value) {
            ("software", MetaValue::Text(value)) => attributes.software_name = Some(text(value)),
            ("comments", MetaValue::Text(value)) => attributes.comments = Some(text(value)),
            ("owner", MetaValue::Text(value)) => attributes.owner = Some(text(value)),
            ("capDate", MetaValue::Text(value)) => attributes.capture_date = Some(text(value)),
            (_, value) => {
                let value = match value {
                    MetaValue::Text(value) => AttributeValue::Text(text(value)),
                    MetaValue::Int(value) => AttributeValue::I32(*value),
                    MetaValue::Float(value) => AttributeValue::F32(*value),
                };
                attributes.other.insert(text(key), value);
            }
        }
    }
    Ok(attributes)
}

#[cfg(test)]
#[path = "write_tests.rs"]
mod tests;

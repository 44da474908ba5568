//! OpenEXR files in: any mix of half, float and uint, one or many parts, scan lines or tiles.

use crate::limits::{check_decoded_bytes, guard_decoder, image_bytes};
use crate::{IoError, MetaValue};
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::reader::ChunksReader;
use exr::io::PeekRead;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{AttributeValue, IntegerBounds, SampleType, Vec2};
use half::f16;
use rayon::prelude::*;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

/// Chunks decompressed at a time, a compromise between memory and idle threads.
const BATCH: usize = 64;

/// A flat image read from an EXR file.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrImage {
    /// Pixels in a row of the display window.
    pub width: usize,
    /// Rows of the display window.
    pub height: usize,
    /// A pixel's width over its height.
    pub pixel_aspect: f32,
    /// Full channel name (`R`, `albedo.R`, `normal.X`) and `width * height` numbers, row 0 at the top. Sorted as in the
    /// file; channels of a named part carry the part's name as prefix.
    pub channels: Vec<(String, Vec<f32>)>,
    /// Text, integer and float attributes of the first part, sorted by name.
    pub metadata: Vec<(String, MetaValue)>,
}

impl ExrImage {
    /// The numbers of the channel called `name`.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }

    /// The metadata value called `key`.
    pub fn meta(&self, key: &str) -> Option<&MetaValue> {
        self.metadata.iter().find(|(k, _)| k == key).map(|(_, value)| value)
    }
}

/// Reads the full-resolution level of all parts of the EXR file at `path`.
///
/// The image is the display window: pixels outside the data window are 0, overscan is dropped.
/// Integers above 2^24 lose their last digits.
///
/// # Errors
/// The file is missing, damaged, or holds deep or subsampled channels.
pub fn read_exr(path: &Path) -> Result<ExrImage, IoError> {
    let file = File::open(path).map_err(|e| IoError::read(path, e))?;
    let file_bytes = file.metadata().map_err(|e| IoError::read(path, e))?.len();
    guard_decoder(path, || read_from(path, BufReader::new(file), file_bytes))
}

fn read_from(path: &Path, mut file: impl Read + Seek, file_bytes: u64) -> Result<ExrImage, IoError> {
    let damaged = |e: exr::error::Error| decode_error(path, e);
    let meta = exr::block::read(&mut file, false).map_err(damaged)?.into_meta_data();
    check_headers(path, &meta.headers, file_bytes)?;
    let has_table = has_table(&mut file, &meta).map_err(damaged)?;
    file.rewind().map_err(|e| IoError::read(path, e))?;
    let reader = exr::block::read(file, false).map_err(damaged)?;
    let mut image = empty_image(reader.headers());
    let first_channel = first_channels(reader.headers());
    let insert = |headers: &[Header], block: UncompressedBlock| {
        let (header, first) = (&headers[block.index.layer], first_channel[block.index.layer]);
        copy_block(&mut image, header, first, block);
    };
    if has_table {
        let chunks = reader.filter_chunks(false, |_, tile, _| tile.level_index == Vec2(0, 0));
        chunks.and_then(|chunks| read_pixels(chunks, insert))
    } else {
        reader.all_chunks(false).and_then(|chunks| read_pixels(chunks, insert))
    }
    .map_err(damaged)?;
    Ok(image)
}

/// Whether the offset table, which begins where `file` is after the headers, was ever written.
///
/// Programs reserve it as zeros and fill it in at the end; those that cannot go back leave the zeros (Blender 5.2 does
/// so in files that it packs). Chunks then follow one another in the file and say themselves where they belong.
fn has_table(file: &mut impl Read, meta: &MetaData) -> exr::error::Result<bool> {
    let tables = MetaData::read_offset_tables(&mut PeekRead::new(file), &meta.headers)?;
    Ok(tables.iter().flatten().any(|&place| place != 0))
}

fn decode_error(path: &Path, error: exr::error::Error) -> IoError {
    match error {
        exr::error::Error::NotSupported(what) => {
            IoError::unsupported(path, format!("{what} is not supported; save it as a flat, lossless EXR"))
        }
        other => IoError::damaged(path, other),
    }
}

/// Refuses what cannot be shown, and sizes that the file cannot hold, before anything is allocated.
fn check_headers(path: &Path, headers: &[Header], file_bytes: u64) -> Result<(), IoError> {
    let first = headers.first().ok_or_else(|| IoError::damaged(path, "no parts"))?;
    let Vec2(width, height) = first.shared_attributes.display_window.size;
    let mut n_channels = 0usize;
    for header in headers {
        if header.deep {
            return Err(IoError::unsupported(path, "deep pixels are not supported; flatten the image first"));
        }
        if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err(IoError::unsupported(
                path,
                "subsampled (luminance/chroma) channels are not supported; save it as RGB",
            ));
        }
        n_channels += header.channels.list.len();
        let Vec2(w, h) = header.layer_size;
        check_decoded_bytes(path, image_bytes(w, h, header.channels.bytes_per_pixel), file_bytes)?;
    }
    if width == 0 || height == 0 || n_channels == 0 {
        return Err(IoError::damaged(path, "no pixels"));
    }
    check_decoded_bytes(
        path,
        n_channels.checked_mul(4).and_then(|b| image_bytes(width, height, b)),
        file_bytes,
    )
}

/// All channels of all parts, filled with zeros, and the metadata.
fn empty_image(headers: &[Header]) -> ExrImage {
    let shared = &headers[0].shared_attributes;
    let Vec2(width, height) = shared.display_window.size;
    let channels = headers.iter().flat_map(|header| {
        let names = header.channels.list.iter().map(|c| full_name(header, headers.len(), c.name.as_slice()));
        names.map(|name| (name, vec![0.0; width * height])).collect::<Vec<_>>()
    });
    let channels = channels.collect();
    ExrImage { width, height, pixel_aspect: shared.pixel_aspect, channels, metadata: metadata(&headers[0]) }
}

/// `R` of the part `diffuse` is `diffuse.R`; parts of a single-part file, the main part and names that already carry
/// their prefix are left alone.
fn full_name(header: &Header, n_parts: usize, channel: &[u8]) -> String {
    let channel = String::from_utf8_lossy(channel).into_owned();
    let part =
        header.own_attributes.layer_name.as_ref().map(|t| String::from_utf8_lossy(t.as_slice()).into_owned());
    match part {
        Some(part) if n_parts > 1 && !matches!(part.as_str(), "" | "rgba" | "RGBA") => {
            let has_prefix = channel.strip_prefix(&part).is_some_and(|rest| rest.starts_with('.'));
            if has_prefix { channel } else { format!("{part}.{channel}") }
        }
        _ => channel,
    }
}

fn metadata(header: &Header) -> Vec<(String, MetaValue)> {
    const TECHNICAL: [&str; 6] =
        ["name", "type", "chunkCount", "pixelAspectRatio", "screenWindowWidth", "maxSamplesPerPixel"];
    let mut metadata: Vec<_> = header
        .all_named_attributes()
        .filter_map(|(key, value)| {
            let value = match value {
                AttributeValue::Text(text) => {
                    MetaValue::Text(String::from_utf8_lossy(text.as_slice()).into_owned())
                }
                AttributeValue::I32(value) => MetaValue::Int(value),
                AttributeValue::F32(value) => MetaValue::Float(value),
                _ => return None,
            };
            Some((String::from_utf8_lossy(key).into_owned(), value))
        })
        .filter(|(key, _)| !TECHNICAL.contains(&key.as_str()))
        .collect();
    metadata.sort_by(|a, b| a.0.cmp(&b.0));
    metadata
}

/// Where each part's channels begin in the list of all channels.
fn first_channels(headers: &[Header]) -> Vec<usize> {
    let counts = headers.iter().map(|h| h.channels.list.len());
    counts.scan(0, |sum, n| Some(std::mem::replace(sum, *sum + n))).collect()
}

/// Hands every full-resolution block to `insert`.
///
/// Decompresses with rayon's `par_iter` and not with the crate's own pool: a codec that panics on a hostile file would
/// abort the process there, while `par_iter` brings the panic back to [`guard_decoder`].
fn read_pixels(
    mut chunks: impl ChunksReader,
    mut insert: impl FnMut(&[Header], UncompressedBlock),
) -> exr::error::UnitResult {
    let meta: MetaData = chunks.meta_data().clone();
    loop {
        let batch: Vec<Chunk> = chunks.by_ref().take(BATCH).collect::<Result<_, _>>()?;
        if batch.is_empty() {
            return Ok(());
        }
        let blocks: Vec<_> = batch
            .into_par_iter()
            .filter(is_of_full_resolution)
            .map(|chunk| UncompressedBlock::decompress_chunk(chunk, &meta, false))
            .collect::<Result<_, _>>()?;
        blocks.into_iter().for_each(|block| insert(&meta.headers, block));
    }
}

fn is_of_full_resolution(chunk: &Chunk) -> bool {
    match &chunk.compressed_block {
        CompressedBlock::Tile(tile) => tile.coordinates.level_index == Vec2(0, 0),
        _ => true,
    }
}

/// Copies the part of a block that lies in the display window.
fn copy_block(image: &mut ExrImage, header: &Header, first_channel: usize, block: UncompressedBlock) {
    let window: IntegerBounds = header.shared_attributes.display_window;
    // Display-window pixel = block pixel + offset.
    let offset_x = i64::from(header.own_attributes.layer_position.0) - i64::from(window.position.0);
    let offset_y = i64::from(header.own_attributes.layer_position.1) - i64::from(window.position.1);
    for line in block.lines(&header.channels) {
        let y = line.location.position.1 as i64 + offset_y;
        let x = line.location.position.0 as i64 + offset_x;
        let begin = x.clamp(0, image.width as i64);
        let end = (x + line.location.sample_count as i64).clamp(begin, image.width as i64);
        if y < 0 || y >= image.height as i64 || begin == end {
            continue;
        }
        let row = y as usize * image.width;
        let target = &mut image.channels[first_channel + line.location.channel].1
            [row + begin as usize..row + end as usize];
        let skipped = (begin - x) as usize;
        decode_line(header.channels.list[line.location.channel].sample_type, line.value, skipped, target);
    }
}

/// Decodes native-endian samples, leaving out the first `skipped` ones.
fn decode_line(sample_type: SampleType, bytes: &[u8], skipped: usize, target: &mut [f32]) {
    match sample_type {
        SampleType::F16 => {
            let samples = bytes.as_chunks::<2>().0[skipped..].iter();
            target.iter_mut().zip(samples).for_each(|(t, s)| *t = f16::from_ne_bytes(*s).to_f32());
        }
        SampleType::F32 => {
            let samples = bytes.as_chunks::<4>().0[skipped..].iter();
            target.iter_mut().zip(samples).for_each(|(t, s)| *t = f32::from_ne_bytes(*s));
        }
        SampleType::U32 => {
            let samples = bytes.as_chunks::<4>().0[skipped..].iter();
            target.iter_mut().zip(samples).for_each(|(t, s)| *t = u32::from_ne_bytes(*s) as f32);
        }
    }
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;

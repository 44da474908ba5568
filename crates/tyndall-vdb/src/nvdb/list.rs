//! The grids of a file, without unpacking them.

use super::image::HEAD_BYTES;
use super::packing::{self, Codec};
use super::{MAJOR_VERSION, StoredGrid};
use crate::VdbError;
use crate::cursor::Cursor;
use crate::source::Source;

/// Files and, in old files, grids.
const MAGIC_OLD: [u8; 8] = *b"NanoVDB0";
/// Grids since 32.6.
const MAGIC_GRID: [u8; 8] = *b"NanoVDB1";
/// Files since 32.6.
const MAGIC_FILE: [u8; 8] = *b"NanoVDB2";

pub(super) fn read(source: &Source) -> Result<Vec<StoredGrid>, VdbError> {
    let is_bare = source.parse(0..source.len(), starts_with_a_grid)?.0;
    if is_bare { read_bare_grids(source) } else { read_segments(source) }
}

/// Whether the file begins with a grid instead of a segment. Old grids have the magic number of files; they differ in
/// where the version is.
fn starts_with_a_grid(cursor: &mut Cursor<'_>) -> Result<bool, VdbError> {
    let magic: [u8; 8] = cursor.array("magic number")?;
    if magic != MAGIC_OLD {
        return Ok(magic == MAGIC_GRID);
    }
    let is_segment = is_supported(cursor.u32("version")?);
    cursor.u32("version")?;
    Ok(!is_segment && cursor.u32("version").is_ok_and(is_supported))
}

/// Major version, minor version and patch in 11, 11 and 10 bits.
pub(super) fn is_supported(version: u32) -> bool {
    version >> 21 == MAJOR_VERSION
}

pub(super) fn check_version(version: u32) -> Result<(), VdbError> {
    if is_supported(version) {
        return Ok(());
    }
    let numbers = format!("{}.{}.{}", version >> 21, version >> 10 & 0x7ff, version & 0x3ff);
    Err(unsupported(format!("its version is {numbers}, versions {MAJOR_VERSION}.x are read")))
}

fn unsupported(what: impl Into<String>) -> VdbError {
    VdbError::UnsupportedNanoVdb { what: what.into() }
}

fn read_segments(source: &Source) -> Result<Vec<StoredGrid>, VdbError> {
    let mut grids = Vec::new();
    let mut at = 0;
    while at < source.len() {
        let (segment, mut body_at) = source.parse(at..source.len(), read_segment)?;
        for Entry { unpacked, stored, name } in segment.entries {
            let end = packing::end(source, body_at, segment.codec, unpacked, stored)?;
            grids.push(StoredGrid { bytes: body_at..end, codec: segment.codec, unpacked, name });
            body_at = end;
        }
        at = body_at;
    }
    Ok(grids)
}

struct Segment {
    codec: Codec,
    entries: Vec<Entry>,
}

/// What a segment says about a grid.
struct Entry {
    unpacked: u64,
    stored: u64,
    name: String,
}

fn read_segment(cursor: &mut Cursor<'_>) -> Result<Segment, VdbError> {
    let at = cursor.offset();
    let magic: [u8; 8] = cursor.array("segment")?;
    if magic != MAGIC_OLD && magic != MAGIC_FILE {
        if magic.ends_with(b"BDVonaN") {
            return Err(unsupported("it was written on a big-endian machine"));
        }
        return Err(VdbError::corrupt(at, "a NanoVDB segment without its magic number"));
    }
    check_version(cursor.u32("version")?)?;
    let n_grids = cursor.u16("grid count")?;
    let codec = cursor.u16("codec")?;
    let codec = Codec::from_number(codec).ok_or_else(|| unsupported(format!("codec {codec} is unknown")))?;
    let entries = (0..n_grids).map(|_| read_entry(cursor)).collect::<Result<_, _>>()?;
    Ok(Segment { codec, entries })
}

/// 176 bytes and the name. Type, class, boxes and counts are repeated in the grid itself.
fn read_entry(cursor: &mut Cursor<'_>) -> Result<Entry, VdbError> {
    let unpacked = cursor.u64("grid size")?;
    let stored = cursor.u64("grid size")?;
    cursor.take(120, "grid entry")?;
    let name_bytes = cursor.u32("grid name")?;
    cursor.take(36, "grid entry")?;
    let name = text(cursor.take(name_bytes as usize, "grid name")?);
    Ok(Entry { unpacked, stored, name })
}

/// Up to the first zero byte; bytes that are not UTF-8 become U+FFFD.
pub(super) fn text(bytes: &[u8]) -> String {
    let name = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(name).into_owned()
}

/// Grids one after the other; each states its size, and the first how many there are.
fn read_bare_grids(source: &Source) -> Result<Vec<StoredGrid>, VdbError> {
    let mut grids = Vec::new();
    let (mut at, mut n_grids) = (0, 1);
    while grids.len() < n_grids {
        let ((entry, count), _) = source.parse(at..source.len(), read_bare_head)?;
        if grids.is_empty() {
            n_grids = count as usize;
        }
        if entry.stored < HEAD_BYTES as u64 {
            // Otherwise a few bytes could stand for thousands of millions of grids.
            return Err(VdbError::corrupt(at, "a NanoVDB grid is smaller than its first structure"));
        }
        let end = packing::end(source, at, Codec::Raw, entry.unpacked, entry.stored)?;
        let (bytes, unpacked, name) = (at..end, entry.unpacked, entry.name);
        grids.push(StoredGrid { bytes, codec: Codec::Raw, unpacked, name });
        at = end;
    }
    Ok(grids)
}

/// The grid and the number of grids.
fn read_bare_head(cursor: &mut Cursor<'_>) -> Result<(Entry, u32), VdbError> {
    cursor.take(16, "grid")?;
    check_version(cursor.u32("version")?)?;
    cursor.take(8, "grid")?;
    let n_grids = cursor.u32("grid count")?;
    let size = cursor.u64("grid size")?;
    let name = text(cursor.take(256, "grid name")?);
    Ok((Entry { unpacked: size, stored: size, name }, n_grids))
}

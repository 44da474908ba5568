//! From stored bytes to a grid's image.

use std::borrow::Cow;

use super::StoredGrid;
use super::image::HEAD_BYTES;
use crate::VdbError;
use crate::codec::{blosc, zip};
use crate::cursor::Cursor;
use crate::source::Source;

/// How a grid is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    Raw,
    /// One zlib stream behind its 64-bit size.
    Zip,
    /// Blosc containers of up to [`BLOSC_CHUNK`] unpacked bytes, each behind its 64-bit size.
    Blosc,
}

impl Codec {
    pub(super) fn from_number(number: u16) -> Option<Self> {
        [Self::Raw, Self::Zip, Self::Blosc].get(usize::from(number)).copied()
    }
}

const BLOSC_CHUNK: usize = 1 << 30;
/// No deflate stream expands further (RFC 1951: 258 bytes from two bits), and no LZ4 block as far.
const MOST_EXPANSION: u64 = 1032;
const TOO_LARGE: &str = "a NanoVDB grid claims more bytes than its packed ones can hold";
/// Headers and rounding.
const SLACK: u64 = 1 << 16;

/// Where a grid that begins at `at` ends. Packed grids are walked like NanoVDB's own reader does it: NVIDIA Warp states
/// eight bytes too few in the segment, having forgotten the size in front.
pub(super) fn end(
    source: &Source,
    at: usize,
    codec: Codec,
    unpacked: u64,
    stored: u64,
) -> Result<usize, VdbError> {
    if codec == Codec::Raw {
        return skip(source, at, stored);
    }
    let most = ((source.len() - at) as u64).saturating_mul(MOST_EXPANSION).saturating_add(SLACK);
    if unpacked > most {
        return Err(VdbError::corrupt(at, TOO_LARGE));
    }
    let n_runs = if codec == Codec::Blosc { unpacked.div_ceil(BLOSC_CHUNK as u64) } else { 1 };
    (0..n_runs).try_fold(at, |at, _| {
        let (size, run_at) = source.parse(at..source.len(), |cursor| cursor.u64("packed size"))?;
        skip(source, run_at, size)
    })
}

fn skip(source: &Source, at: usize, size: u64) -> Result<usize, VdbError> {
    let end = usize::try_from(size).ok().and_then(|size| at.checked_add(size));
    end.filter(|&end| end <= source.len()).ok_or_else(|| {
        let available = source.len().saturating_sub(at);
        VdbError::Truncated { what: "NanoVDB grid", offset: at, needed: size, available }
    })
}

/// A whole grid.
pub(super) fn unpack<'a>(packed: Cow<'a, [u8]>, grid: &StoredGrid) -> Result<Cow<'a, [u8]>, VdbError> {
    let corrupt = |what: &str| VdbError::corrupt(grid.bytes.start, what);
    let most = (packed.len() as u64).saturating_mul(MOST_EXPANSION).saturating_add(SLACK);
    if grid.codec == Codec::Raw {
        return Ok(packed);
    }
    let size = usize::try_from(grid.unpacked).ok().filter(|_| grid.unpacked <= most);
    let size =
        size.ok_or_else(|| corrupt("a NanoVDB grid claims more bytes than its packed ones can hold"))?;
    let mut out = Vec::new();
    out.try_reserve_exact(size).map_err(|_| VdbError::OutOfMemory { bytes: grid.unpacked })?;
    out.resize(size, 0);
    let mut cursor = Cursor::new(&packed, grid.bytes.start);
    if grid.codec == Codec::Zip {
        zip::Inflater::default().unzip(next_run(&mut cursor)?, &mut out).map_err(corrupt)?;
        return Ok(Cow::Owned(out));
    }
    let mut shuffled = Vec::new();
    for chunk in out.chunks_mut(BLOSC_CHUNK) {
        blosc::unpack(next_run(&mut cursor)?, chunk, &mut shuffled).map_err(corrupt)?;
    }
    Ok(Cow::Owned(out))
}

/// The first bytes of a grid, enough for its [`super::GridHead`], from the first bytes of the packed ones.
pub(super) fn unpack_head(cursor: &mut Cursor<'_>, codec: Codec) -> Result<Vec<u8>, VdbError> {
    if codec == Codec::Raw {
        return Ok(cursor.take(HEAD_BYTES, "grid")?.to_vec());
    }
    let mut head = vec![0; HEAD_BYTES];
    let size = cursor.u64("packed size")?;
    let at = cursor.offset();
    let seen = cursor.take(cursor.remaining().min(usize::try_from(size).unwrap_or(usize::MAX)), "grid")?;
    let unpacked = match codec {
        Codec::Blosc => blosc::unpack_front(seen, &mut head),
        _ => zip::unzip_front(seen, &mut head),
    };
    match unpacked {
        Ok(()) => Ok(head),
        // Perhaps more bytes help.
        Err(_) if (seen.len() as u64) < size => {
            let needed = size.min(4 * seen.len() as u64 + 64);
            Err(VdbError::Truncated { what: "packed grid", offset: at, needed, available: seen.len() })
        }
        Err(what) => Err(VdbError::corrupt(at, what)),
    }
}

fn next_run<'a>(cursor: &mut Cursor<'a>) -> Result<&'a [u8], VdbError> {
    let size = cursor.u64("packed size")?;
    cursor.require(size, "packed grid")?;
    cursor.take(size as usize, "packed grid")
}

//! From packed bytes to values: none, zip or Blosc, behind a signed 64-bit size.
//!
//! A size of zero or less means "stored as is"; its magnitude must equal the unpacked size.

pub(crate) mod block;
pub(crate) mod blosc;
pub(crate) mod zip;

use crate::VdbError;
use crate::cursor::Cursor;
use crate::header::{COMPRESS_BLOSC, COMPRESS_ZIP};

/// How a grid packs its blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packing {
    Raw,
    Zip,
    Blosc,
}

impl Packing {
    /// From the compression word; Blosc wins if both bits are set, as in OpenVDB.
    pub(crate) fn from_flags(flags: u32) -> Self {
        if flags & COMPRESS_BLOSC != 0 {
            Self::Blosc
        } else if flags & COMPRESS_ZIP != 0 {
            Self::Zip
        } else {
            Self::Raw
        }
    }
}

/// A located but not yet unpacked run of bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chunk<'a> {
    bytes: &'a [u8],
    packing: Packing,
    unpacked_bytes: usize,
    offset: usize,
}

impl<'a> Chunk<'a> {
    /// Steps over a chunk that unpacks to `unpacked_bytes`.
    pub(crate) fn locate(
        cursor: &mut Cursor<'a>,
        packing: Packing,
        unpacked_bytes: usize,
    ) -> Result<Self, VdbError> {
        let offset = cursor.offset();
        if packing == Packing::Raw {
            let bytes = cursor.take(unpacked_bytes, "voxel values")?;
            return Ok(Self { bytes, packing, unpacked_bytes, offset });
        }
        let size = cursor.i64("packed size")?;
        let stored = size.unsigned_abs();
        cursor.require(stored, "packed voxel values")?;
        let packing = if size > 0 { packing } else { Packing::Raw };
        if packing == Packing::Raw && stored != unpacked_bytes as u64 {
            return Err(VdbError::corrupt(
                offset,
                format!("{stored} bytes of values instead of {unpacked_bytes}"),
            ));
        }
        Ok(Self {
            bytes: cursor.take(stored as usize, "packed voxel values")?,
            packing,
            unpacked_bytes,
            offset,
        })
    }

    /// The unpacked bytes, in `scratch` unless they are stored as is.
    pub(crate) fn unpack<'s>(&self, scratch: &'s mut Scratch) -> Result<&'s [u8], VdbError>
    where
        'a: 's,
    {
        if self.packing == Packing::Raw || self.unpacked_bytes == 0 {
            return Ok(&self.bytes[..self.unpacked_bytes.min(self.bytes.len())]);
        }
        scratch.unpacked.clear();
        scratch.unpacked.resize(self.unpacked_bytes, 0);
        let result = match self.packing {
            Packing::Blosc => blosc::unpack(self.bytes, &mut scratch.unpacked, &mut scratch.shuffled),
            _ => scratch.inflater.unzip(self.bytes, &mut scratch.unpacked),
        };
        result.map_err(|what| VdbError::corrupt(self.offset, what))?;
        Ok(&scratch.unpacked)
    }
}

/// Buffers reused from chunk to chunk; never larger than one node's values.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    unpacked: Vec<u8>,
    shuffled: Vec<u8>,
    inflater: zip::Inflater,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked_before_use() {
        let mut bytes = i64::MAX.to_le_bytes().to_vec();
        bytes.extend([0; 8]);
        assert!(matches!(
            Chunk::locate(&mut Cursor::new(&bytes, 0), Packing::Zip, 8),
            Err(VdbError::Truncated { .. })
        ));
        let mut bytes = (-7_i64).to_le_bytes().to_vec();
        bytes.extend([0; 8]);
        assert!(matches!(
            Chunk::locate(&mut Cursor::new(&bytes, 0), Packing::Zip, 8),
            Err(VdbError::Corrupt { .. })
        ));
        let min = i64::MIN.to_le_bytes();
        assert!(Chunk::locate(&mut Cursor::new(&min, 0), Packing::Blosc, 8).is_err());
    }
}

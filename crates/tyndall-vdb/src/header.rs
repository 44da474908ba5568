//! The first bytes of a file: magic number, versions, flags.

use crate::VdbError;
use crate::cursor::Cursor;

/// " BDV" and four zero bytes.
pub(crate) const MAGIC: [u8; 8] = [0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0];
/// Length of the UUID in text form.
pub(crate) const UUID_BYTES: usize = 36;

/// From here on a grid's transform is one of the maps of `transform.rs`.
pub(crate) const VERSION_MAPS: u32 = 219;
/// From here on the header says whether values are zipped.
const VERSION_SELECTIVE_COMPRESSION: u32 = 220;
/// From here on a frustum's box is stored as doubles.
pub(crate) const VERSION_FLOAT_FRUSTUM: u32 = 221;
/// From here on each grid states its compression and each node its inactive values.
pub(crate) const VERSION_NODE_MASKS: u32 = 222;
const VERSION_OLDEST: u32 = 218;
const VERSION_NEWEST: u32 = 225;

/// Bits of a grid's compression word.
pub(crate) const COMPRESS_ZIP: u32 = 1;
pub(crate) const COMPRESS_ACTIVE_MASK: u32 = 2;
pub(crate) const COMPRESS_BLOSC: u32 = 4;

/// What the rest of the file is read with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Header {
    pub(crate) version: u32,
    /// False for stream files, which have to be walked from the start to find a grid.
    pub(crate) has_grid_offsets: bool,
    /// Of all grids, in files before [`VERSION_NODE_MASKS`].
    pub(crate) compression: u32,
}

impl Header {
    pub(crate) fn read(cursor: &mut Cursor<'_>) -> Result<Self, VdbError> {
        if cursor.take(MAGIC.len(), "magic number").ok() != Some(&MAGIC) {
            return Err(VdbError::NotVdb);
        }
        let version = cursor.u32("file version")?;
        if !(VERSION_OLDEST..=VERSION_NEWEST).contains(&version) {
            return Err(VdbError::UnsupportedVersion { version });
        }
        cursor.take(8, "library version")?;
        let has_grid_offsets = cursor.u8("grid offset flag")? != 0;
        let compression = Self::read_compression(cursor, version)?;
        cursor.take(UUID_BYTES, "UUID")?;
        Ok(Self { version, has_grid_offsets, compression })
    }

    fn read_compression(cursor: &mut Cursor<'_>, version: u32) -> Result<u32, VdbError> {
        if (VERSION_SELECTIVE_COMPRESSION..VERSION_NODE_MASKS).contains(&version) {
            return Ok(if cursor.u8("compression flag")? != 0 { COMPRESS_ZIP } else { 0 });
        }
        // Before the flag existed, everything was zipped; after it, each grid has its own word.
        Ok(COMPRESS_ZIP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(version: u32) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend([0; 8 + 1 + 1 + UUID_BYTES]);
        bytes
    }

    #[test]
    fn versions_outside_the_range_are_named() {
        for version in [0, 217, 226, u32::MAX] {
            let error = Header::read(&mut Cursor::new(&header(version), 0)).err();
            assert!(matches!(error, Some(VdbError::UnsupportedVersion { version: v }) if v == version));
        }
        for version in 218..=225 {
            assert!(Header::read(&mut Cursor::new(&header(version), 0)).is_ok());
        }
    }

    #[test]
    fn other_files_are_not_vdb() {
        for bytes in [&b""[..], b" BDV", b"NanoVDB0aaaaaaaaaaaaaaaa"] {
            assert!(matches!(Header::read(&mut Cursor::new(bytes, 0)), Err(VdbError::NotVdb)));
        }
    }
}

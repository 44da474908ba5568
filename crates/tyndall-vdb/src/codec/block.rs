//! The values of one node: mask compression on top of packing.
//!
//! With mask compression only active values are stored; a code byte says what the inactive ones are (0 to 6), up
//! to two inactive values and a selection mask follow. Reading happens in two steps so that leaves can be unpacked
//! in parallel: [`Block::locate`] walks over the bytes, [`Block::decode`] produces values.

use super::{Chunk, Packing, Scratch};
use crate::VdbError;
use crate::cursor::Cursor;
use crate::header::VERSION_NODE_MASKS;
use crate::mask::{Mask, fill_off, spread};
use crate::value::{Value, ValueLayout};

/// Code bytes (OpenVDB's names in quotes).
mod code {
    /// "no mask or inactive values": all inactive values are the background.
    pub(super) const BACKGROUND: u8 = 0;
    /// "no mask and one inactive value".
    pub(super) const ONE_VALUE: u8 = 2;
    /// "mask and no inactive values": the mask selects between -background and background.
    pub(super) const MASK: u8 = 3;
    /// "mask and one inactive value".
    pub(super) const MASK_ONE_VALUE: u8 = 4;
    /// "mask and two inactive values".
    pub(super) const MASK_TWO_VALUES: u8 = 5;
    /// "no mask and all values": nothing is left out.
    pub(super) const ALL_VALUES: u8 = 6;
}

/// How the blocks of one grid are stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockFormat {
    pub(crate) version: u32,
    pub(crate) packing: Packing,
    pub(crate) mask_compressed: bool,
    pub(crate) values: ValueLayout,
}

impl BlockFormat {
    /// A packed run of `n_values`. Half blocks without values have no packed size either.
    pub(crate) fn chunk<'a>(&self, cursor: &mut Cursor<'a>, n_values: usize) -> Result<Chunk<'a>, VdbError> {
        let packing = if self.values.is_half && n_values == 0 { Packing::Raw } else { self.packing };
        // A node has at most 32³ values of at most 24 bytes: no overflow.
        Chunk::locate(cursor, packing, n_values * self.values.stored_bytes)
    }
}

/// A located node block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block<'a> {
    chunk: Chunk<'a>,
    n_stored: usize,
    code: u8,
    inactive: [Option<&'a [u8]>; 2],
    selection: Option<Mask<'a>>,
}

impl<'a> Block<'a> {
    /// Steps over the block of a node with `n_values` values, of which those in `active` are stored for sure.
    pub(crate) fn locate(
        cursor: &mut Cursor<'a>,
        format: &BlockFormat,
        active: Mask<'_>,
        n_values: usize,
    ) -> Result<Self, VdbError> {
        let at = cursor.offset();
        let code =
            if format.version >= VERSION_NODE_MASKS { cursor.u8("node code")? } else { code::ALL_VALUES };
        if code > code::ALL_VALUES {
            return Err(VdbError::corrupt(at, format!("unknown node code {code}")));
        }
        let mut inactive = [None; 2];
        if matches!(code, code::ONE_VALUE | code::MASK_ONE_VALUE | code::MASK_TWO_VALUES) {
            inactive[0] = Some(cursor.take(format.values.full_bytes, "inactive value")?);
        }
        if code == code::MASK_TWO_VALUES {
            inactive[1] = Some(cursor.take(format.values.full_bytes, "inactive value")?);
        }
        let selection = match code {
            code::MASK..=code::MASK_TWO_VALUES => {
                Some(Mask(cursor.take(active.len() / 8, "selection mask")?))
            }
            _ => None,
        };
        let leaves_out = format.mask_compressed && code != code::ALL_VALUES;
        let n_stored = if leaves_out { active.count_on() } else { n_values };
        let chunk = format.chunk(cursor, n_stored)?;
        Ok(Self { chunk, n_stored, code, inactive, selection })
    }

    /// Fills `out` (as many values as given to [`Self::locate`]).
    pub(crate) fn decode<T: Value>(
        &self,
        is_half: bool,
        active: Mask<'_>,
        background: T,
        out: &mut [T],
        scratch: &mut Scratch,
    ) -> Result<(), VdbError> {
        let bytes = self.chunk.unpack(scratch)?;
        let read = if is_half { T::read_half } else { T::read_full };
        let n_stored = self.n_stored.min(out.len());
        read(bytes, &mut out[..n_stored]);
        // Values are left out only where there is one per bit of the mask.
        if n_stored < out.len() {
            spread(active, out);
            self.fill_inactive(active, background, out);
        }
        Ok(())
    }

    fn fill_inactive<T: Value>(&self, active: Mask<'_>, background: T, out: &mut [T]) {
        let unselected = match (self.code, self.inactive[0]) {
            (code::BACKGROUND, _) => background,
            (_, Some(bytes)) => T::from_full(bytes),
            (_, None) => background.negated(),
        };
        fill_off(active, out, unselected);
        if let Some(selection) = self.selection {
            let selected = self.inactive[1].map_or(background, T::from_full);
            let is_inactive = |index: &usize| !active.is_on(*index);
            selection.on_indices().filter(is_inactive).for_each(|index| out[index] = selected);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::LeafLayout;

    const FORMAT: BlockFormat = BlockFormat {
        version: 224,
        packing: Packing::Raw,
        mask_compressed: true,
        values: ValueLayout { full_bytes: 4, stored_bytes: 4, is_half: false, leaf: LeafLayout::Block },
    };

    /// Decodes a 64-value node in which voxel 0 is active with value 9 and the selection holds voxel 1.
    fn decode(code: u8, inactive: &[f32]) -> Option<Vec<f32>> {
        let active = 1_u64.to_le_bytes();
        let mut bytes = vec![code];
        bytes.extend(inactive.iter().flat_map(|v| v.to_le_bytes()));
        if (3..=5).contains(&code) {
            bytes.extend(2_u64.to_le_bytes());
        }
        bytes.extend(9.0_f32.to_le_bytes());
        let mut cursor = Cursor::new(&bytes, 0);
        let block = Block::locate(&mut cursor, &FORMAT, Mask(&active), 64).ok()?;
        assert_eq!(cursor.remaining(), 0);
        let mut out = vec![0.0; 64];
        block.decode(false, Mask(&active), 0.5_f32, &mut out, &mut Scratch::default()).ok()?;
        out.truncate(3);
        Some(out)
    }

    #[test]
    fn inactive_values_follow_the_code() {
        assert_eq!(decode(0, &[]), Some(vec![9.0, 0.5, 0.5]));
        assert_eq!(decode(1, &[]), Some(vec![9.0, -0.5, -0.5]));
        assert_eq!(decode(2, &[3.0]), Some(vec![9.0, 3.0, 3.0]));
        assert_eq!(decode(3, &[]), Some(vec![9.0, 0.5, -0.5]));
        assert_eq!(decode(4, &[3.0]), Some(vec![9.0, 0.5, 3.0]));
        assert_eq!(decode(5, &[3.0, 4.0]), Some(vec![9.0, 4.0, 3.0]));
        assert_eq!(decode(7, &[]), None);
        assert_eq!(decode(6, &[]), None, "one value where sixty-four are needed");
    }
}

//! Floats stored as codes of 1 to 16 bits: `value = code * step + offset`, with offset and step per leaf.

use crate::grid::LEAF_VOXELS;

/// The values of a leaf; `bits` is 1, 2, 4, 8 or 16, and `codes` has one code per voxel, least significant bits first.
pub(super) fn dequantize(codes: &[u8], bits: usize, step: f32, offset: f32) -> [f32; LEAF_VOXELS] {
    let mask = ((1_u32 << bits) - 1) as u16;
    std::array::from_fn(|voxel| {
        let (byte, shift) = (voxel * bits / 8, voxel * bits % 8);
        let low = codes.get(byte).copied().unwrap_or(0);
        // Only codes of sixteen bits reach into a second byte.
        let high = if bits > 8 { codes.get(byte + 1).copied().unwrap_or(0) } else { 0 };
        let code = u16::from_le_bytes([low, high]) >> shift & mask;
        f32::from(code) * step + offset
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_come_out_in_order() {
        for bits in [1, 2, 4, 8, 16] {
            let code = |voxel: usize| (voxel * 40_503 + 7) as u16 & ((1_u32 << bits) - 1) as u16;
            let mut stored = vec![0_u8; bits * 64];
            for voxel in 0..LEAF_VOXELS {
                for bit in 0..bits {
                    let at = voxel * bits + bit;
                    stored[at / 8] |= ((code(voxel) >> bit & 1) as u8) << (at % 8);
                }
            }
            let values = dequantize(&stored, bits, 0.5, -3.0);
            for (voxel, value) in values.iter().enumerate() {
                assert_eq!(*value, f32::from(code(voxel)) * 0.5 - 3.0, "{bits} bits, voxel {voxel}");
            }
        }
    }
}

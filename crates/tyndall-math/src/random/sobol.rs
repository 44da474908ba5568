//! Owen-scrambled Sobol points (Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4)): the numbers of
//! `sobol_burley::sample_4d`, from its parts, with the index shuffled once a path and its bits taken four at a time.

use sobol_burley::parts::{Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev, sobol_int4_rev};
use std::sync::LazyLock;

/// Sets of four dimensions that are tabulated.
const SETS: usize = 4;
/// Bits of the index per table, and tables: the index has 16 bits.
const BITS: u32 = 4;
const TABLES: usize = 4;

/// What each group of index bits contributes to a point before scrambling, bits reversed.
static TABLE: LazyLock<[[[Int4; 1 << BITS]; TABLES]; SETS]> = LazyLock::new(|| {
    std::array::from_fn(|set| {
        std::array::from_fn(|table| {
            std::array::from_fn(|bits| sobol_int4_rev((bits as u32) << shift(table), set as u32))
        })
    })
});

/// Where the bits of a table are in a reversed index.
const fn shift(table: usize) -> u32 {
    u32::BITS - BITS * (table as u32 + 1)
}

/// The index below 2^16 of a point in the sequence of `seed`, shuffled, bits reversed.
#[inline]
pub(super) fn shuffled_index(index: u32, seed: u32) -> u32 {
    owen_scramble_rev(index.reverse_bits(), hash(seed ^ 0x79c6_8e4a))
}

/// Four dimensions of the point at a [`shuffled_index`]; `set` is below 4.
#[inline]
pub(super) fn sample_4d(shuffled_index: u32, set: usize, seed: u32) -> [f32; 4] {
    let tables = &TABLE[set];
    let part = |table: usize| tables[table][(shuffled_index >> shift(table)) as usize % (1 << BITS)];
    let sobol = part(0) ^ part(1) ^ part(2) ^ part(3);
    let seed = [seed.wrapping_mul(0x9c8f_2d3b) ^ set as u32; 4].into();
    let dimensions: Int4 = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].into();
    owen_scramble_int4_rev(sobol, hash_int4(dimensions ^ seed)).reverse_bits().to_f32_norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn are_the_numbers_of_the_library() {
        for (set, seed) in (0..SETS).flat_map(|set| [0, 1, 77, u32::MAX].map(|seed| (set, seed))) {
            for index in (0..1 << 16).step_by(37) {
                let expected = sobol_burley::sample_4d(index, set as u32, seed);
                assert_eq!(sample_4d(shuffled_index(index, seed), set, seed), expected);
            }
        }
    }
}

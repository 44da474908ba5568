//! Compression in blocks that are worked on in parallel.
//!
//! Stored is the size of each block, four bytes each, and then the blocks. The bytes of a block's four-byte words are
//! sorted by significance before they are compressed: neighbouring numbers seldom share their last digits, but often
//! their exponent. A block that would not get smaller is stored as it is.

use super::error::{CacheError, Result};
use rayon::prelude::*;

/// Bytes of a block before compression; the last one may be shorter.
const BLOCK: usize = 1 << 18;
/// LZ4 makes no more than this out of a byte.
const MOST_PER_BYTE: u64 = 255;
const BAD: CacheError = CacheError::Malformed("a compressed block cannot be unpacked");

pub(super) fn compress(raw: &[u8]) -> Vec<u8> {
    let blocks: Vec<Vec<u8>> = raw.par_chunks(BLOCK).map(compress_block).collect();
    let sizes = blocks.iter().flat_map(|block| (block.len() as u32).to_le_bytes());
    sizes.chain(blocks.iter().flatten().copied()).collect()
}

/// What `raw_len` bytes were compressed to `stored`. Allocates only what `stored` can hold.
pub(super) fn decompress(stored: &[u8], raw_len: u64) -> Result<Vec<u8>> {
    if raw_len > MOST_PER_BYTE * stored.len() as u64 {
        return Err(BAD);
    }
    let raw_len = usize::try_from(raw_len).map_err(|_| BAD)?;
    let blocks = split(stored, raw_len)?;
    let mut raw = vec![0; raw_len];
    let room = || vec![0; BLOCK.min(raw_len)];
    let unpack =
        |sorted: &mut Vec<u8>, (raw, block): (&mut [u8], &[u8])| decompress_block(block, sorted, raw);
    raw.par_chunks_mut(BLOCK).zip(blocks).try_for_each_init(room, unpack)?;
    Ok(raw)
}

/// The blocks; their sizes add up exactly.
fn split(stored: &[u8], raw_len: usize) -> Result<Vec<&[u8]>> {
    let n_blocks = raw_len.div_ceil(BLOCK);
    let (sizes, mut rest) = stored.split_at_checked(4 * n_blocks).ok_or(BAD)?;
    let mut blocks = Vec::with_capacity(n_blocks);
    for &size in sizes.as_chunks::<4>().0 {
        let (block, after) = rest.split_at_checked(u32::from_le_bytes(size) as usize).ok_or(BAD)?;
        blocks.push(block);
        rest = after;
    }
    if rest.is_empty() { Ok(blocks) } else { Err(BAD) }
}

fn compress_block(raw: &[u8]) -> Vec<u8> {
    let compressed = lz4_flex::block::compress(&by_significance(raw));
    if compressed.len() < raw.len() { compressed } else { raw.to_vec() }
}

/// `sorted` is room for no less than there is in `raw`.
fn decompress_block(block: &[u8], sorted: &mut [u8], raw: &mut [u8]) -> Result<()> {
    if block.len() == raw.len() {
        raw.copy_from_slice(block);
        return Ok(());
    }
    let sorted = &mut sorted[..raw.len()];
    match lz4_flex::block::decompress_into(block, sorted) {
        Ok(n) if n == raw.len() => {
            to_words(sorted, raw);
            Ok(())
        }
        _ => Err(BAD),
    }
}

/// The first bytes of all words, then the second ones, and so on; what is no whole word comes last.
fn by_significance(raw: &[u8]) -> Vec<u8> {
    let (words, tail) = raw.as_chunks::<4>();
    let digit = |k: usize| words.iter().map(move |word| word[k]);
    (0..4).flat_map(digit).chain(tail.iter().copied()).collect()
}

/// The inverse of [`by_significance`].
fn to_words(sorted: &[u8], raw: &mut [u8]) {
    let (words, tail) = raw.as_chunks_mut::<4>();
    let n = words.len();
    let digit = |k: usize| &sorted[k * n..][..n];
    for ((((word, a), b), c), d) in words.iter_mut().zip(digit(0)).zip(digit(1)).zip(digit(2)).zip(digit(3)) {
        *word = [*a, *b, *c, *d];
    }
    tail.copy_from_slice(&sorted[4 * n..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn blocks_of_any_length_come_back() {
        for n in [0, 1, 3, 4, 7, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 5] {
            let smooth: Vec<u8> = (0..n).flat_map(|i| (i as f32).to_le_bytes()).take(n).collect();
            let noise: Vec<u8> = (0..n as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
            for raw in [smooth, noise] {
                let stored = compress(&raw);
                assert!(stored.len() <= raw.len() + 4 * n.div_ceil(BLOCK));
                assert_eq!(decompress(&stored, n as u64).unwrap(), raw);
            }
        }
    }

    proptest! {
        #[test]
        fn bytes_of_strangers_are_refused_or_unpacked(stored in prop::collection::vec(any::<u8>(), 0..64), n: u64) {
            if let Ok(raw) = decompress(&stored, n) {
                prop_assert_eq!(raw.len() as u64, n);
            }
            let _ = decompress(&stored, n % 300);
        }
    }
}

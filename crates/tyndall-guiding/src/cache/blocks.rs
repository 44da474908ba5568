//! Compression in blocks that are worked on in parallel.
//!
//! Stored is the size of each block, four bytes each, and then the blocks. The bytes of a block's four-byte words are
//! sorted by significance before they are compressed: neighbouring numbers seldom share their last digits, but often
//! their exponent. A block that would not get smaller is stored as it is.

use super::error::{CacheError, Result};
use super::words::Reader;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::Range;

/// Bytes of a block before compression; the last one may be shorter.
const BLOCK: usize = 1 << 18;
/// Blocks that a thread unpacks before they are read: with what they are unpacked from, 2 MB.
const BLOCKS_PER_THREAD: usize = 4;
/// LZ4 makes no more than this out of a byte.
const MOST_PER_BYTE: u64 = 255;
const BAD: CacheError = CacheError::Malformed("a compressed block cannot be unpacked");

pub(super) fn compress(raw: &[u8]) -> Vec<u8> {
    let blocks: Vec<Vec<u8>> = raw.par_chunks(BLOCK).map(compress_block).collect();
    let sizes = blocks.iter().flat_map(|block| (block.len() as u32).to_le_bytes());
    sizes.chain(blocks.iter().flatten().copied()).collect()
}

/// Bytes that are unpacked when they are asked for, a few blocks a thread at a time: what reads them finds them in its
/// processor's cache, and there is no second copy of everything in memory.
pub(crate) struct Unpacking<'a> {
    blocks: VecDeque<&'a [u8]>,
    /// What is still to be unpacked of all.
    packed: usize,
    buffer: Vec<u8>,
    /// What is unpacked of the buffer, and not yet taken.
    at_hand: Range<usize>,
    sorted: Vec<u8>,
}

impl<'a> Unpacking<'a> {
    /// What `raw_len` bytes were compressed to.
    pub(super) fn new(stored: &'a [u8], raw_len: u64) -> Result<Self> {
        // Nothing is allocated that `stored` cannot hold.
        if raw_len > MOST_PER_BYTE * stored.len() as u64 {
            return Err(BAD);
        }
        let packed = usize::try_from(raw_len).map_err(|_| BAD)?;
        let blocks = split(stored, packed)?.into();
        Ok(Self { blocks, packed, buffer: Vec::new(), at_hand: 0..0, sorted: Vec::new() })
    }

    /// Bytes not yet taken.
    pub(crate) fn left(&self) -> usize {
        self.at_hand.len() + self.packed
    }

    /// Numbers of the next `n` bytes.
    pub(crate) fn take(&mut self, n: usize) -> Result<Reader<'_>> {
        if n > self.left() {
            return Err(CacheError::Malformed("a section announces more than it holds"));
        }
        self.unpack(n)?;
        let begin = self.at_hand.start;
        self.at_hand.start += n;
        Ok(Reader::new(&self.buffer[begin..begin + n]))
    }

    /// Bytes that come next, at least `least` of them unless fewer are left. [`Self::skip`] takes them.
    pub(crate) fn peek(&mut self, least: usize) -> Result<&[u8]> {
        self.unpack(least.min(self.left()))?;
        Ok(&self.buffer[self.at_hand.clone()])
    }

    /// Takes `n` of the bytes at hand.
    pub(crate) fn skip(&mut self, n: usize) {
        self.at_hand.start += n.min(self.at_hand.len());
    }

    /// Nothing may be left at the end of a section.
    pub(crate) fn finish(self) -> Result<()> {
        if self.left() == 0 {
            Ok(())
        } else {
            Err(CacheError::Malformed("a section is longer than its content"))
        }
    }

    /// Puts at least `least` bytes at hand; there are as many.
    fn unpack(&mut self, least: usize) -> Result<()> {
        let rest = self.at_hand.len();
        let Some(missing) = least.checked_sub(rest).filter(|&missing| missing > 0) else { return Ok(()) };
        let batch = BLOCKS_PER_THREAD * rayon::current_num_threads() * BLOCK;
        let more = missing.next_multiple_of(BLOCK).max(batch).min(self.packed);
        self.buffer.copy_within(self.at_hand.clone(), 0);
        self.at_hand = 0..rest + more;
        self.packed -= more;
        grow_to(&mut self.buffer, rest + more);
        grow_to(&mut self.sorted, more);
        let blocks: Vec<_> = self.blocks.drain(..more.div_ceil(BLOCK)).collect();
        let raw = self.buffer[rest..rest + more].par_chunks_mut(BLOCK);
        let unpack = |((raw, sorted), block)| decompress_block(block, sorted, raw);
        raw.zip(self.sorted[..more].par_chunks_mut(BLOCK)).zip(blocks).try_for_each(unpack)
    }
}

fn grow_to(buffer: &mut Vec<u8>, n: usize) {
    if buffer.len() < n {
        buffer.resize(n, 0);
    }
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

/// `sorted` is room for what there is in `raw`.
fn decompress_block(block: &[u8], sorted: &mut [u8], raw: &mut [u8]) -> Result<()> {
    if block.len() == raw.len() {
        raw.copy_from_slice(block);
        return Ok(());
    }
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
    let [first, second, third, fourth] = std::array::from_fn(|k| &sorted[k * n..][..n]);
    // In this form it compiles to vector code.
    for (i, word) in words.iter_mut().enumerate() {
        let digits = [first[i], second[i], third[i], fourth[i]].map(u32::from);
        *word = (digits[0] | digits[1] << 8 | digits[2] << 16 | digits[3] << 24).to_le_bytes();
    }
    tail.copy_from_slice(&sorted[4 * n..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn decompress(stored: &[u8], raw_len: u64) -> Result<Vec<u8>> {
        let mut unpacking = Unpacking::new(stored, raw_len)?;
        let raw = unpacking.take(raw_len as usize)?.rest().to_vec();
        unpacking.finish()?;
        Ok(raw)
    }

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

    #[test]
    fn bytes_come_in_order_however_they_are_taken() {
        let raw: Vec<u8> = (0..9 * BLOCK as u32 + 77).map(|i| (i.wrapping_mul(i) >> 17) as u8).collect();
        let stored = compress(&raw);
        for step in [1000, BLOCK - 3, 5 * BLOCK + 1] {
            let mut unpacking = Unpacking::new(&stored, raw.len() as u64).unwrap();
            let mut back: Vec<u8> = Vec::new();
            while unpacking.left() > 0 {
                let n = step.min(unpacking.left());
                assert!(unpacking.peek(n).unwrap().len() >= n);
                if back.len().is_multiple_of(2) {
                    back.extend(unpacking.take(n).unwrap().rest());
                } else {
                    back.extend(&unpacking.peek(n).unwrap()[..n]);
                    unpacking.skip(n);
                }
            }
            assert!(back == raw && unpacking.take(1).is_err());
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

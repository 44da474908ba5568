//! Bit sets as stored: bit `i` is bit `i % 8` of byte `i / 8` (little-endian 64-bit words).

/// A node's child or value mask, borrowed from the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask<'a>(pub(crate) &'a [u8]);

impl<'a> Mask<'a> {
    /// Bits past the end are off.
    pub(crate) fn is_on(self, index: usize) -> bool {
        self.0.get(index / 8).is_some_and(|byte| byte >> (index % 8) & 1 == 1)
    }

    pub(crate) fn count_on(self) -> usize {
        self.words().map(|word| word.count_ones() as usize).sum()
    }

    /// Number of bits, set or not.
    pub(crate) fn len(self) -> usize {
        self.0.len() * 8
    }

    /// Indices of the set bits, ascending.
    pub(crate) fn on_indices(self) -> impl Iterator<Item = usize> + 'a {
        self.words().enumerate().flat_map(|(i, word)| on_bits(word).map(move |bit| i * 64 + bit))
    }

    /// The mask as 64-bit words; a partial last word does not occur (all VDB masks are multiples of 64 bits).
    pub(crate) fn words(self) -> impl Iterator<Item = u64> + 'a {
        self.0.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes))
    }
}

/// Positions of the set bits of one word, ascending.
pub(crate) fn on_bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        word &= word.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_agree_with_single_bits() {
        let bytes: Vec<u8> = (0..64).map(|i: u8| i.wrapping_mul(37) ^ 0x5a).collect();
        let mask = Mask(&bytes);
        let slow: Vec<usize> = (0..mask.len()).filter(|&i| mask.is_on(i)).collect();
        assert_eq!(mask.on_indices().collect::<Vec<_>>(), slow);
        assert_eq!(mask.count_on(), slow.len());
        assert!(!mask.is_on(512));
    }
}

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
    pub(crate) fn words(self) -> impl DoubleEndedIterator<Item = u64> + ExactSizeIterator + 'a {
        self.0.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes))
    }
}

/// Puts the first values, one per set bit, at the positions of the set bits, without a second buffer. The other
/// positions are left with anything. Mask and values must have the same length.
pub(crate) fn spread<T: Copy>(mask: Mask<'_>, values: &mut [T]) {
    debug_assert_eq!(mask.len(), values.len());
    // From the end, so that a value moves before its place is taken: the k-th set bit is never before position k.
    let mut from = mask.count_on();
    for (base, word) in mask.words().enumerate().rev().map(|(i, word)| (i * 64, word)) {
        from -= word.count_ones() as usize;
        if word == u64::MAX {
            values.copy_within(from..from + 64, base);
        } else {
            spread_word(word, base, from, values);
        }
    }
}

fn spread_word<T: Copy>(mut word: u64, base: usize, first: usize, values: &mut [T]) {
    let mut from = first + word.count_ones() as usize;
    while word != 0 {
        let bit = 63 - word.leading_zeros() as usize;
        word &= !(1 << bit);
        from -= 1;
        values[base + bit] = values[from];
    }
}

/// Gives all positions whose bit is off a value.
pub(crate) fn fill_off<T: Copy>(mask: Mask<'_>, values: &mut [T], value: T) {
    for (word, slots) in mask.words().zip(values.chunks_mut(64)) {
        let n_slots = slots.len();
        if word == 0 {
            slots.fill(value);
        } else {
            on_bits(!word).take_while(|&bit| bit < n_slots).for_each(|bit| slots[bit] = value);
        }
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

    /// Masks with full, empty and mixed words.
    fn masks() -> impl Iterator<Item = Vec<u8>> {
        (0_u64..200).map(|seed| {
            let word =
                |i: u64| match (seed >> (2 * (i % 4)) & 3, (seed + i).wrapping_mul(0x9e37_79b9_7f4a_7c15)) {
                    (0, _) => 0,
                    (1, _) => u64::MAX,
                    (2, random) => random,
                    (_, random) => random & random.rotate_left(17),
                };
            (0..8).flat_map(|i| word(i).to_le_bytes()).collect()
        })
    }

    #[test]
    fn spreading_in_place_agrees_with_a_second_buffer() {
        for bytes in masks() {
            let mask = Mask(&bytes);
            let packed: Vec<usize> = (0..mask.count_on()).map(|k| 1000 + k).collect();
            let mut slow = vec![7; 512];
            mask.on_indices().zip(&packed).for_each(|(index, value)| slow[index] = *value);
            let mut fast = packed;
            fast.resize(512, 0);
            spread(mask, &mut fast);
            fill_off(mask, &mut fast, 7);
            assert_eq!(fast, slow);
        }
    }
}

//! Sums over samples that belong softly to lobes.

use super::lanes::{Lanes, PerLobe};

/// `N` sums per lobe over softly assigned samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LobeSums<const N: usize>(pub(crate) [PerLobe; N]);

impl<const N: usize> Default for LobeSums<N> {
    fn default() -> Self {
        Self([PerLobe::ZERO; N])
    }
}

impl<const N: usize> LobeSums<N> {
    /// Sums of each lobe.
    pub(crate) const ROWS: usize = N;

    /// Adds to each lobe its share of `values`.
    #[inline]
    pub(crate) fn add(&mut self, shares: &PerLobe, n_groups: usize, values: &[f32; N]) {
        for (g, share) in shares.0.iter().enumerate().take(n_groups) {
            for (sums, value) in self.0.iter_mut().zip(values) {
                sums.0[g] = sums.0[g] + *share * *value;
            }
        }
    }

    /// Σ share · sum over the lobes.
    #[inline]
    pub(crate) fn blend(&self, shares: &PerLobe, n_groups: usize) -> [f32; N] {
        self.0.each_ref().map(|sums| {
            let products = sums.0.iter().zip(&shares.0).take(n_groups).map(|(sum, share)| *sum * *share);
            products.fold(Lanes::splat(0.0), |a, b| a + b).sum()
        })
    }

    /// Adds the samples of `other`, assigned to the same lobes.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (sums, others) in self.0.iter_mut().zip(&other.0) {
            sums.0.iter_mut().zip(others.0).for_each(|(sum, other)| *sum = *sum + other);
        }
    }

    /// Weakens every sum to `factor` of itself.
    pub(crate) fn scale(&mut self, factor: f32) {
        self.0.iter_mut().for_each(|sums| sums.scale(factor));
    }

    /// Gives one half of lobe `from`'s samples to the empty lobe `to`.
    pub(crate) fn halve(&mut self, from: usize, to: usize) {
        for sums in &mut self.0 {
            sums[from] *= 0.5;
            sums[to] = sums[from];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::groups_of;
    use super::*;

    #[test]
    fn sums_are_shared_blended_and_halved() {
        let mut sums = LobeSums::<2>::default();
        let mut shares = PerLobe::ZERO;
        (shares[0], shares[6]) = (0.25, 0.75);
        sums.add(&shares, groups_of(7), &[4.0, 8.0]);
        assert_eq!((sums.0[0][0], sums.0[1][6]), (1.0, 6.0));
        assert_eq!(sums.blend(&shares, 1), [0.25 + 0.75 * 3.0, 0.5 + 0.75 * 6.0]);
        sums.halve(6, 7);
        assert_eq!((sums.0[0][6], sums.0[0][7]), (1.5, 1.5));
    }
}

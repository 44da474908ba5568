//! One number per lobe, in groups of eight whose arithmetic compiles to vector code without `unsafe`.

use std::ops::{Add, Div, Index, IndexMut, Mul, Sub};

/// Lobes a mixture can hold. More are hardly better, and each vertex pays for them (kitchen, 32 samples: .197 of error with
/// up to 32 lobes, .204 with 8, at 1.5 times the time).
pub const MAX_LOBES: usize = 8;
/// Lobes per group.
pub(crate) const LANES: usize = 8;
const GROUPS: usize = MAX_LOBES / LANES;

/// Groups that hold `n` lobes.
#[inline]
pub(crate) fn groups_of(n: usize) -> usize {
    n.div_ceil(LANES).min(GROUPS)
}

/// The numbers of a group, calculated with lane by lane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

impl Lanes {
    #[inline(always)]
    pub(crate) const fn splat(value: f32) -> Self {
        Self([value; LANES])
    }

    /// `value` of every lane. A plain loop: closures within those of the standard library are not always inlined.
    #[inline(always)]
    fn from_lanes(value: impl Fn(usize) -> f32) -> Self {
        let mut lanes = Self([0.0; LANES]);
        for (l, lane) in lanes.0.iter_mut().enumerate() {
            *lane = value(l);
        }
        lanes
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self::from_lanes(|l| f(self.0[l], other.0[l]))
    }

    /// The larger one; `other` where this is NaN.
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// The smaller one; `other` where this is NaN.
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self::from_lanes(|l| self.0[l].sqrt())
    }

    /// `yes` where this is greater than `bound`, else `no`; `no` where this is NaN.
    #[inline(always)]
    pub(crate) fn if_above(self, bound: f32, yes: Self, no: Self) -> Self {
        Self::from_lanes(|l| if self.0[l] > bound { yes.0[l] } else { no.0[l] })
    }

    /// Sum of the lanes, in the order of a vector reduction.
    #[inline(always)]
    pub(crate) fn sum(self) -> f32 {
        let v = self.0;
        ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]))
    }

    /// e^x for x ≤ 0 to 2e-7, and 0 below -86 and for NaN. Plain arithmetic, the same on every machine.
    ///
    /// Cody–Waite reduction to |r| ≤ ln2/2 and the minimax polynomial of Moshier's Cephes library.
    #[inline(always)]
    pub(crate) fn exp_nonpositive(self) -> Self {
        const LOWEST: f32 = -86.0;
        /// Adding 1.5·2²³ rounds to an integer, which is then in the lowest bits.
        const ROUND: f32 = 12_582_912.0;
        const LN_2: (f32, f32) = (0.693_359_4, -2.121_944_4e-4);
        const POLYNOMIAL: [f32; 5] = [1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5];
        let inside = self.max(Self::splat(LOWEST));
        let rounded = inside * std::f32::consts::LOG2_E + ROUND;
        let n = rounded - Self::splat(ROUND);
        let r = (inside - n * LN_2.0) - n * LN_2.1;
        let p = POLYNOMIAL.iter().fold(Self::splat(1.987_569_1e-4), |p, c| p * r + *c);
        let y = p * r * r + r + 1.0;
        let scale = |y: f32, rounded: f32| f32::from_bits(y.to_bits().wrapping_add(rounded.to_bits() << 23));
        self.if_above(LOWEST, y.zip(rounded, scale), Self::splat(0.0))
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Add<f32> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f32) -> Self {
        self + Self::splat(other)
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Mul<f32> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f32) -> Self {
        self * Self::splat(other)
    }
}

impl Div for Lanes {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}

/// One number per lobe; indexed by lobe, or group by group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PerLobe(pub(crate) [Lanes; GROUPS]);

impl PerLobe {
    pub(crate) const ZERO: Self = Self::splat(0.0);

    #[inline]
    pub(crate) const fn splat(value: f32) -> Self {
        Self([Lanes::splat(value); GROUPS])
    }

    /// Multiplies the number of every lobe.
    #[inline]
    pub(crate) fn scale(&mut self, factor: f32) {
        self.0.iter_mut().for_each(|group| *group = *group * factor);
    }

    /// The numbers of the first `n` lobes.
    pub(crate) fn first(&self, n: usize) -> impl Iterator<Item = f32> + '_ {
        self.0.iter().flat_map(|group| group.0).take(n)
    }

    /// These numbers for the first lobes, 0 for the others.
    #[inline]
    pub(crate) fn from_first(values: impl Iterator<Item = f32>) -> Self {
        let mut all = Self::ZERO;
        let places = all.0.iter_mut().flat_map(|group| &mut group.0);
        places.zip(values).for_each(|(place, value)| *place = value);
        all
    }

    /// The numbers of all lobes, 0 for those that there are not.
    #[inline]
    pub(crate) fn from_array(values: [f32; MAX_LOBES]) -> Self {
        Self(std::array::from_fn(|g| Lanes(std::array::from_fn(|l| values[g * LANES + l]))))
    }

    /// Whether all numbers of these rows are.
    #[inline]
    pub(crate) fn are_finite<'a>(rows: impl Iterator<Item = &'a Self>) -> bool {
        // 0·v is 0 for finite numbers and NaN for all others.
        let mut sum = Lanes::splat(0.0);
        rows.for_each(|row| row.0.iter().for_each(|group| sum = sum + *group * 0.0));
        sum.0 == [0.0; LANES]
    }

    /// Whether all numbers of these rows are, those that are NaN left out.
    #[inline]
    pub(crate) fn are_nonnegative<'a>(rows: impl Iterator<Item = &'a Self>) -> bool {
        let mut least = Lanes::splat(0.0);
        rows.for_each(|row| row.0.iter().for_each(|group| least = group.min(least)));
        least.0 == [0.0; LANES]
    }

    /// Sum over all lobes, in f64 and in order.
    pub(crate) fn total(&self) -> f64 {
        self.0.iter().flat_map(|group| group.0).map(f64::from).sum()
    }
}

impl Index<usize> for PerLobe {
    type Output = f32;

    #[inline]
    fn index(&self, lobe: usize) -> &f32 {
        &self.0[lobe / LANES].0[lobe % LANES]
    }
}

impl IndexMut<usize> for PerLobe {
    #[inline]
    fn index_mut(&mut self, lobe: usize) -> &mut f32 {
        &mut self.0[lobe / LANES].0[lobe % LANES]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exp(x: f32) -> f32 {
        Lanes::splat(x).exp_nonpositive().0[3]
    }

    #[test]
    fn one_bad_number_among_rows_is_found() {
        let mut rows = [PerLobe::splat(1.0), PerLobe::splat(f32::MAX), PerLobe::splat(-0.0)];
        assert!(PerLobe::are_finite(rows.iter()) && PerLobe::are_nonnegative(rows.iter()));
        rows[1][6] = -1e-45;
        assert!(PerLobe::are_finite(rows.iter()) && !PerLobe::are_nonnegative(rows.iter()));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            rows[1][6] = bad;
            assert!(!PerLobe::are_finite(rows.iter()));
        }
    }

    #[test]
    fn the_exponential_is_precise_and_total() {
        for i in 0..=860_000 {
            let x = -1e-4 * i as f32;
            let (got, want) = (f64::from(exp(x)), f64::from(x).exp());
            assert!((got / want - 1.0).abs() < 2e-7 || x <= -86.0, "e^{x} = {got}");
        }
        assert_eq!(exp(0.0), 1.0);
        for x in [-86.0, -1e30, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(exp(x), 0.0);
        }
    }
}

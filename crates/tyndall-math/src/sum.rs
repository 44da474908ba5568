//! Sums that do not drift.

/// Neumaier's compensated sum in f64: a million samples of value 1 are 1 to the last digit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CompensatedSum {
    sum: f64,
    compensation: f64,
}

impl CompensatedSum {
    /// Adds `value`.
    #[inline]
    pub fn add(&mut self, value: f64) {
        let total = self.sum + value;
        self.compensation += if self.sum.abs() >= value.abs() {
            (self.sum - total) + value
        } else {
            (value - total) + self.sum
        };
        self.sum = total;
    }

    /// The sum so far.
    #[inline]
    pub fn value(&self) -> f64 {
        self.sum + self.compensation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_terms_survive_a_large_one() {
        let mut sum = CompensatedSum::default();
        sum.add(1e17);
        for _ in 0..1000 {
            sum.add(1.0);
        }
        sum.add(-1e17);
        assert_eq!(sum.value(), 1000.0);
    }
}

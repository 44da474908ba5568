//! Piecewise-constant distributions over [0, 1) and [0, 1)^2, tabulated in f64.

use glam::Vec2;

/// A draw from [`PiecewiseConstant1D`].
#[derive(Debug, Clone, Copy)]
pub struct Sample1D {
    /// Position in [0, 1).
    pub x: f32,
    /// Density at `x` with respect to length.
    pub pdf: f32,
    /// Index of the cell.
    pub cell: usize,
}

/// A draw from [`PiecewiseConstant2D`].
#[derive(Debug, Clone, Copy)]
pub struct Sample2D {
    /// Position in [0, 1)^2; x runs along a row.
    pub p: Vec2,
    /// Density at `p` with respect to area.
    pub pdf: f32,
}

/// A density that is constant on each of `n` equal cells of [0, 1).
#[derive(Debug, Clone)]
pub struct PiecewiseConstant1D {
    /// `cdf[i]` = probability of the cells before `i`; n + 1 entries, the last is 1.
    cdf: Vec<f32>,
    /// Sum of the weights / n: the integral of the unnormalised function.
    integral: f64,
}

impl PiecewiseConstant1D {
    /// From non-negative weights. All-zero (or empty) weights give the uniform distribution with integral 0.
    pub fn new(weights: &[f32]) -> Self {
        let n = weights.len().max(1);
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        let mut cdf = Vec::with_capacity(n + 1);
        cdf.push(0.0);
        let mut running = 0.0;
        let uniform = 1.0 / n as f64;
        for cell in 0..n {
            running += weights
                .get(cell)
                .map_or(uniform, |&w| if total > 0.0 { f64::from(w) / total } else { uniform });
            cdf.push(running.min(1.0) as f32);
        }
        cdf[n] = 1.0;
        Self { cdf, integral: total / n as f64 }
    }

    /// The integral of the weights seen as a function on [0, 1).
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cdf.len() - 1
    }

    /// Never true: there is at least one cell.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Probability of a cell.
    #[inline]
    pub fn probability(&self, cell: usize) -> f32 {
        self.cdf[cell + 1] - self.cdf[cell]
    }

    /// Maps `u` in [0, 1) to a position.
    #[inline]
    pub fn sample(&self, u: f32) -> Sample1D {
        let cell = self.cdf.partition_point(|&c| c <= u).clamp(1, self.len()) - 1;
        let probability = self.probability(cell);
        let within = if probability > 0.0 { (u - self.cdf[cell]) / probability } else { 0.5 };
        let n = self.len() as f32;
        let x = ((cell as f32 + within.clamp(0.0, 1.0)) / n).min(ONE_MINUS_EPSILON);
        Sample1D { x, pdf: probability * n, cell }
    }

    /// Density at `x`.
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        let n = self.len();
        let cell = ((x * n as f32) as usize).min(n - 1);
        self.probability(cell) * n as f32
    }
}

/// A density that is constant on each cell of a `width` x `height` grid over [0, 1)^2.
#[derive(Debug, Clone)]
pub struct PiecewiseConstant2D {
    rows: Vec<PiecewiseConstant1D>,
    marginal: PiecewiseConstant1D,
}

impl PiecewiseConstant2D {
    /// From row-major non-negative weights, `width * height` of them.
    pub fn new(weights: &[f32], width: usize) -> Self {
        let rows: Vec<_> = weights.chunks(width.max(1)).map(PiecewiseConstant1D::new).collect();
        let row_integrals: Vec<f32> = rows.iter().map(|r| r.integral() as f32).collect();
        Self { marginal: PiecewiseConstant1D::new(&row_integrals), rows }
    }

    /// The integral of the weights seen as a function on [0, 1)^2.
    pub fn integral(&self) -> f64 {
        self.marginal.integral()
    }

    /// Maps `u` to a position.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Sample2D {
        let y = self.marginal.sample(u.y);
        let x = self.rows[y.cell].sample(u.x);
        Sample2D { p: Vec2::new(x.x, y.x), pdf: x.pdf * y.pdf }
    }

    /// Density at `p`.
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        let n = self.rows.len();
        let row = ((p.y * n as f32) as usize).min(n - 1);
        self.marginal.pdf(p.y) * self.rows[row].pdf(p.x)
    }
}

/// The largest f32 below one.
const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg;

    #[test]
    fn sampled_pdf_equals_evaluated_pdf_and_frequencies_match() {
        let weights = [0.0, 1.0, 3.0, 0.0, 2.0, 2.0];
        let d = PiecewiseConstant2D::new(&weights, 3);
        let mut rng = Pcg::new(&[1]);
        let mut counts = [0u32; 6];
        let n = 80_000;
        for _ in 0..n {
            let s = d.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
            assert!((s.pdf - d.pdf(s.p)).abs() < 1e-4);
            counts[(s.p.y * 2.0) as usize * 3 + (s.p.x * 3.0) as usize] += 1;
        }
        for (count, weight) in counts.iter().zip(weights) {
            let p = weight / 8.0;
            let sigma = (p * (1.0 - p) / n as f32).sqrt().max(1e-9);
            assert!((*count as f32 / n as f32 - p).abs() <= 4.0 * sigma, "{counts:?}");
        }
    }

    #[test]
    fn black_and_single_cells_are_defined() {
        assert_eq!(PiecewiseConstant1D::new(&[0.0; 4]).pdf(0.3), 1.0);
        assert_eq!(PiecewiseConstant1D::new(&[5.0]).sample(0.999).pdf, 1.0);
        assert!(PiecewiseConstant1D::new(&[1e38, 1e38]).pdf(0.1).is_finite());
    }
}

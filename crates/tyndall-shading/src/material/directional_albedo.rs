//! How much a GGX reflection lobe reflects in total.
//!
//! With Schlick's Fresnel term the directional albedo is `f0 * A + f90 * B` (Karis 2013, "Real Shading in Unreal Engine
//! 4"); A and B are tabulated once over cosine and roughness. Used to couple layers and to give back the energy that a
//! single bounce between microfacets loses (Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks").

use super::fresnel::schlick_weight;
use super::microfacet::{Roughness, reflect};
use glam::{Vec2, Vec3A};
use std::sync::LazyLock;

const N_COS: usize = 32;
const N_ROUGHNESS: usize = 32;
/// Cosine of the first table row; below it the value is that of the row.
const MIN_COS: f32 = 1e-4;

/// A and B.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SplitSum {
    pub f0: f32,
    pub f90: f32,
}

impl SplitSum {
    /// The lobe's albedo where every microfacet reflects everything.
    #[inline]
    pub(super) fn total(self) -> f32 {
        (self.f0 + self.f90).min(1.0)
    }

    fn lerp(self, other: Self, t: f32) -> Self {
        Self { f0: self.f0 + (other.f0 - self.f0) * t, f90: self.f90 + (other.f90 - self.f90) * t }
    }
}

struct Table {
    /// Rows of equal roughness, columns of equal sqrt(cos).
    values: [[SplitSum; N_COS]; N_ROUGHNESS],
    /// Cosine-weighted averages over each row.
    averages: [SplitSum; N_ROUGHNESS],
}

static TABLE: LazyLock<Box<Table>> = LazyLock::new(tabulate);

/// A and B for a view at cosine `cos`.
pub(super) fn split_sum(cos: f32, roughness: Roughness) -> SplitSum {
    if roughness.is_smooth() {
        let f90 = schlick_weight(cos);
        return SplitSum { f0: 1.0 - f90, f90 };
    }
    let (row, row_t) = cell(roughness.value(), N_ROUGHNESS);
    let (column, t) = cell(cos.clamp(0.0, 1.0).sqrt(), N_COS);
    let at = |r: usize| TABLE.values[r][column].lerp(TABLE.values[r][column + 1], t);
    at(row).lerp(at(row + 1), row_t)
}

/// Cosine-weighted hemispherical averages of [`split_sum`].
pub(super) fn average(roughness: Roughness) -> SplitSum {
    let (row, t) = cell(roughness.value(), N_ROUGHNESS);
    TABLE.averages[row].lerp(TABLE.averages[row + 1], t)
}

#[inline]
fn cell(x: f32, n: usize) -> (usize, f32) {
    let scaled = x * (n - 1) as f32;
    let index = (scaled as usize).min(n - 2);
    (index, scaled - index as f32)
}

fn tabulate() -> Box<Table> {
    let zero = SplitSum::default();
    let mut table = Box::new(Table { values: [[zero; N_COS]; N_ROUGHNESS], averages: [zero; N_ROUGHNESS] });
    for row in 0..N_ROUGHNESS {
        let roughness = Roughness::new(row as f32 / (N_ROUGHNESS - 1) as f32);
        for column in 0..N_COS {
            let root = column as f32 / (N_COS - 1) as f32;
            table.values[row][column] = integrate((root * root).max(MIN_COS), roughness);
        }
        table.averages[row] = hemispherical_average(&table.values[row]);
    }
    table
}

/// One entry: visible normals leave G_2 / G_1 times Fresnel, a smooth integrand for the midpoint rule.
fn integrate(cos: f32, roughness: Roughness) -> SplitSum {
    let Some(ggx) = roughness.ggx() else {
        let f90 = schlick_weight(cos);
        return SplitSum { f0: 1.0 - f90, f90 };
    };
    let wo = Vec3A::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let n = 24;
    let mut sum = [0.0f64; 2];
    for i in 0..n * n {
        let u = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
        let h = ggx.sample_visible(wo, u);
        let wi = reflect(wo, h);
        if wi.z > 0.0 {
            let weight = ggx.masking_shadowing(wo, wi) / ggx.masking(wo);
            let s = schlick_weight(wo.dot(h));
            sum[0] += f64::from(weight * (1.0 - s));
            sum[1] += f64::from(weight * s);
        }
    }
    let n2 = f64::from(n * n);
    SplitSum { f0: (sum[0] / n2) as f32, f90: (sum[1] / n2) as f32 }
}

/// The integral of 2 mu over the piecewise linear function of t = sqrt(mu): 4 t^3 dt, by Simpson's rule on each piece.
fn hemispherical_average(row: &[SplitSum; N_COS]) -> SplitSum {
    let step = 1.0 / (N_COS - 1) as f32;
    let mut sum = SplitSum::default();
    for (i, pair) in row.windows(2).enumerate() {
        for (t, weight) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)] {
            let value = pair[0].lerp(pair[1], t);
            let root = (i as f32 + t) * step;
            let w = weight * step / 6.0 * 4.0 * root.powi(3);
            sum.f0 += w * value.f0;
            sum.f90 += w * value.f90;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_lobes_reflect_schlick() {
        let s = split_sum(0.3, Roughness::new(0.0));
        assert!((s.total() - 1.0).abs() < 1e-6 && (s.f90 - 0.7f32.powi(5)).abs() < 1e-6);
        let average = average(Roughness::new(0.0));
        assert!((average.f90 - 1.0 / 21.0).abs() < 1e-3, "{}", average.f90);
    }

    #[test]
    fn the_table_agrees_with_a_finer_integral_between_its_nodes() {
        for roughness in [0.27, 0.55, 0.83, 0.99] {
            for cos in [0.013f32, 0.11, 0.47, 0.93] {
                let exact = integrate(cos, Roughness::new(roughness));
                let table = split_sum(cos, Roughness::new(roughness));
                assert!((exact.total() - table.total()).abs() < 6e-3, "roughness {roughness} cos {cos}");
            }
        }
    }
}

//! `variance`.

use super::{Aov, PixelStatistics, Precision, Source};

pub(super) const AOV: Aov = Aov {
    name: "variance",
    channels: &["R", "G", "B"],
    doc: "Estimated variance of the pixel's mean radiance, per channel; its root is the standard error.",
    precision: Precision::Float,
    source: Source::Pixel(variance_of_mean),
};

/// Sample variance / n; zero below two samples, where it is unknown.
fn variance_of_mean(pixel: &PixelStatistics) -> [f32; 4] {
    let n = f64::from(pixel.count);
    if pixel.count < 2 {
        return [0.0; 4];
    }
    let of_channel = |c: usize| {
        let mean = pixel.sum[c] / n;
        ((pixel.sum_of_squares[c] / n - mean * mean).max(0.0) / (n - 1.0)) as f32
    };
    [of_channel(0), of_channel(1), of_channel(2), 0.0]
}

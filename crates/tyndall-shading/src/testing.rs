//! What the tests of this crate share.

use glam::Vec3A;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::collections::HashMap;
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tyndall_math::Frame;
use tyndall_math::random::Pcg;
use tyndall_scene::{AssetError, AssetLoader, ColorSpace, Diagnostics, ImageData};

/// Images in memory.
#[derive(Default)]
pub(crate) struct Images(HashMap<PathBuf, Arc<ImageData>>);

impl Images {
    pub(crate) fn with(name: &str, width: usize, pixels: Vec<[f32; 4]>) -> Self {
        let image = ImageData { width, height: pixels.len() / width, pixels };
        Self(HashMap::from([(PathBuf::from(name), Arc::new(image))]))
    }
}

impl AssetLoader for Images {
    fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
        let missing = || AssetError { message: format!("{} does not exist", path.display()) };
        self.0.get(path).cloned().ok_or_else(missing)
    }
}

/// The texts of all messages.
pub(crate) fn messages(diags: &Diagnostics) -> Vec<String> {
    diags.as_slice().iter().map(ToString::to_string).collect()
}

/// A cap of the sphere of directions cut into bins of equal solid angle.
pub(crate) struct Cap {
    pub(crate) frame: Frame,
    /// 1 - cos of the cap's half angle; 2 is the whole sphere.
    pub(crate) height: f32,
}

const N_COS: usize = 16;
const N_PHI: usize = 24;
/// Sub-cells along each side of a bin: pdfs may have edges inside a bin.
const N_SUB: usize = 24;

impl Cap {
    pub(crate) fn sphere() -> Self {
        Self { frame: Frame::from_normal(Vec3A::new(0.36, 0.48, 0.8)), height: 2.0 }
    }

    fn bin(&self, direction: Vec3A) -> Option<usize> {
        let d = self.frame.local_from_world(direction);
        let row = (1.0 - d.z) / self.height * N_COS as f32;
        let column = (d.y.atan2(d.x) / TAU).rem_euclid(1.0) * N_PHI as f32;
        (row < N_COS as f32).then(|| row.max(0.0) as usize * N_PHI + (column as usize).min(N_PHI - 1))
    }

    /// The midpoint rule over the cap, bin by bin, of `f` in f64.
    fn integrate(&self, f: impl Fn(Vec3A) -> f64) -> Vec<f64> {
        let (rows, columns) = (N_COS * N_SUB, N_PHI * N_SUB);
        let mut bins = vec![0.0; N_COS * N_PHI];
        let area = f64::from(TAU * self.height) / (rows * columns) as f64;
        for i in 0..rows {
            let h = self.height * (i as f32 + 0.5) / rows as f32;
            let r = (h * (2.0 - h)).max(0.0).sqrt();
            for j in 0..columns {
                let (s, c) = (TAU * (j as f32 + 0.5) / columns as f32).sin_cos();
                let d = self.frame.world_from_local(Vec3A::new(r * c, r * s, 1.0 - h)).normalize();
                bins[(i / N_SUB) * N_PHI + j / N_SUB] += f(d) * area;
            }
        }
        bins
    }

    /// The integral of `f` over the cap.
    pub(crate) fn integral(&self, f: impl Fn(Vec3A) -> f64) -> f64 {
        self.integrate(f).iter().sum()
    }

    /// The probability of differences as large as those between the sampled directions and the density, if they agree
    /// (Pearson's test; directions that are not drawn, or lie outside the cap, are one bin).
    pub(crate) fn chi_square(
        &self,
        seed: u64,
        n: usize,
        mut sample: impl FnMut(&mut Pcg) -> Option<Vec3A>,
        pdf: impl Fn(Vec3A) -> f32,
    ) -> f64 {
        let mut expected = self.integrate(|d| f64::from(pdf(d)));
        expected.push((1.0 - expected.iter().sum::<f64>()).max(0.0));
        let mut observed = vec![0u32; expected.len()];
        let mut rng = Pcg::new(&[seed]);
        for _ in 0..n {
            let bin = sample(&mut rng).and_then(|d| self.bin(d)).unwrap_or(observed.len() - 1);
            observed[bin] += 1;
        }
        p_value(&observed, &expected, n)
    }
}

fn p_value(observed: &[u32], expected: &[f64], n: usize) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut few_observed, mut few_expected) = (0.0, 0.0);
    for (&o, &p) in observed.iter().zip(expected) {
        let e = p * n as f64;
        if e < 20.0 {
            few_observed += f64::from(o);
            few_expected += e;
        } else {
            statistic += (f64::from(o) - e).powi(2) / e;
            cells += 1;
        }
    }
    // Cells with small expectations are pooled; the quadrature's own error is about 1 sample there.
    if few_expected > 5.0 || few_observed > 5.0 {
        statistic += (few_observed - few_expected).powi(2) / (few_expected + 1.0);
        cells += 1;
    }
    match cells {
        0 | 1 => 1.0,
        _ => 1.0 - ChiSquared::new(f64::from(cells - 1)).map_or(0.0, |d| d.cdf(statistic)),
    }
}

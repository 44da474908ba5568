//! Importance sampling of a lat-long image.
//!
//! Rows, then cells of a row, are drawn by tables; inside a cell directions are uniform in solid angle. A cell's weight
//! is the integral of the *bilinear* image over it, so it is positive wherever the image is.

use super::dome::direction_of;
use glam::{DVec2, Vec2, Vec3A};
use std::f64::consts::{PI, TAU};
use tyndall_math::sampling::PiecewiseConstant1D;
use tyndall_scene::ImageData;

/// Cells that are not black are drawn at least this often compared with uniform directions: keeps tables of f32
/// from rounding dim cells beside a sun to zero.
const FLOOR: f64 = 1.0 / 64.0;

#[derive(Debug, Clone)]
pub(super) struct DomeTable {
    rows: Vec<PiecewiseConstant1D>,
    marginal: PiecewiseConstant1D,
    /// sin of the latitude at the row borders, top first.
    sin_latitude: Vec<f64>,
}

impl DomeTable {
    /// `None` for a black image.
    pub(super) fn new(image: &ImageData) -> Option<Self> {
        let height = image.height;
        let sin_latitude: Vec<f64> =
            (0..=height).map(|j| (PI * (0.5 - j as f64 / height as f64)).sin()).collect();
        let largest = image.pixels.iter().flat_map(|p| &p[..3]).fold(0.0f32, |a, b| a.max(*b));
        if largest == 0.0 {
            return None;
        }
        let mut rows = Vec::with_capacity(height);
        let mut means = Vec::with_capacity(height);
        for j in 0..height {
            let mut weights = row_weights(image, j, largest);
            let mean = weights.iter().map(|w| f64::from(*w)).sum::<f64>() / weights.len() as f64;
            raise_to_floor(&mut weights, mean);
            rows.push(PiecewiseConstant1D::new(&weights));
            means.push(mean);
        }
        let share = |j: usize| 0.5 * (sin_latitude[j] - sin_latitude[j + 1]);
        let overall: f64 = means.iter().enumerate().map(|(j, m)| m * share(j)).sum();
        let marginal: Vec<f32> = means
            .iter()
            .enumerate()
            .map(|(j, &m)| if m > 0.0 { (m.max(FLOOR * overall) * share(j)) as f32 } else { 0.0 })
            .collect();
        Some(Self { rows, marginal: PiecewiseConstant1D::new(&marginal), sin_latitude })
    }

    /// Solid angle of a cell of row `j`.
    fn cell_solid_angle(&self, j: usize) -> f64 {
        TAU / self.rows[j].len() as f64 * (self.sin_latitude[j] - self.sin_latitude[j + 1])
    }

    fn density(&self, row: usize, cell: usize) -> f32 {
        let p = f64::from(self.marginal.probability(row)) * f64::from(self.rows[row].probability(cell));
        (p / self.cell_solid_angle(row)) as f32
    }

    /// A direction in the dome's space, its image coordinates (from the top left) and its density per steradian.
    pub(super) fn sample(&self, u: Vec2) -> (Vec3A, Vec2, f32) {
        let row = self.marginal.sample(u.y);
        let column = self.rows[row.cell].sample(u.x);
        // f64: near the poles the sines of neighbouring rows agree in all digits of an f32.
        let within = (f64::from(row.x) * self.rows.len() as f64 - row.cell as f64).clamp(0.0, 1.0);
        let (top, bottom) = (self.sin_latitude[row.cell], self.sin_latitude[row.cell + 1]);
        let sin = top + (bottom - top) * within;
        let cos = ((1.0 - sin) * (1.0 + sin)).max(0.0).sqrt();
        let v = (0.5 - sin.atan2(cos) / PI) as f32;
        let direction = direction_of(f64::from(column.x), DVec2::new(cos, sin));
        (direction, Vec2::new(column.x, v), self.density(row.cell, column.cell))
    }

    /// Density per steradian at image coordinates `uv`.
    pub(super) fn pdf(&self, uv: Vec2) -> f32 {
        let n_rows = self.rows.len();
        let row = ((uv.y * n_rows as f32) as usize).min(n_rows - 1);
        let n_cells = self.rows[row].len();
        self.density(row, ((uv.x * n_cells as f32) as usize).min(n_cells - 1))
    }
}

fn raise_to_floor(weights: &mut [f32], mean: f64) {
    let floor = (FLOOR * mean) as f32;
    for w in weights.iter_mut().filter(|w| **w > 0.0) {
        *w = w.max(floor);
    }
}

/// Integrals over the cells of row `j` of the bilinear image divided by `largest`: texel centres lie in the middle of
/// the cells, so along each axis the neighbours have the weights 1/8, 6/8, 1/8.
fn row_weights(image: &ImageData, j: usize, largest: f32) -> Vec<f32> {
    let (w, h) = (image.width, image.height);
    let brightness = |row: usize, i: usize| {
        let [r, g, b, _] = image.pixels[row * w + i];
        f64::from(r.max(g).max(b) / largest)
    };
    let (above, below) = (j.saturating_sub(1), (j + 1).min(h - 1));
    let column = |i: usize| 0.125 * (brightness(above, i) + brightness(below, i)) + 0.75 * brightness(j, i);
    (0..w)
        .map(|i| {
            let weight = 0.125 * (column((i + w - 1) % w) + column((i + 1) % w)) + 0.75 * column(i);
            if weight > 0.0 { (weight as f32).max(f32::MIN_POSITIVE) } else { 0.0 }
        })
        .collect()
}

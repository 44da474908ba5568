//! Whether directional guiding pays, by trying it.
//!
//! The field learns from a part of the first passes, which nothing guides. Then one pass guides one pixel in sixteen.
//! Both kinds of pixels take their samples in two halves, each as stratified as a pass is; the squared difference of the
//! halves is the variance that an image has, stratification counted in (a guide that lowers the variance of single
//! samples may well lose that). Guiding stays if error times cost is lower with it, and is forgotten if not.
//!
//! Costs are counts of rays and vertices, not seconds: the same settings give the same image on any machine.

use crate::film::{Film, Tile};
use crate::path::{PathSample, PathStatistics};
use serde::Serialize;
use tyndall_math::mean_component;

/// Samples a pixel that teach before the trial, which is the pass after them.
pub(super) const FIRST_SAMPLE: u32 = 16;
/// Renders of fewer samples a pixel end before a guide could return what it cost.
pub(super) const FEWEST_SAMPLES: u32 = 128;
/// Of every 4 x 4 pixels one is guided.
const SPACING: u32 = 4;
/// What asking the field at an event costs, in rays.
const VERTEX_COST: f64 = 1.0;
/// Error times cost must surely fall to this.
const WORTH_IT: f64 = 0.9;
/// "Surely": by so many standard errors of the error's ratio.
const CERTAINTY: f64 = 2.0;
/// Guided pixels without which nothing is sure: the standard error of a few heavy-tailed numbers means nothing.
const FEWEST_PIXELS: usize = 256;
/// Pixels with the largest errors, of a thousand, that no arm counts: fireflies would decide.
const OUTLIERS_PER_MILLE: usize = 5;

/// What a trial found; both are guided over unguided.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct TrialResult {
    /// Ratio of the squared errors after equally many samples.
    pub error: f64,
    /// Standard error of that ratio, relative to it.
    pub uncertainty: f64,
    /// Ratio of the costs of a sample.
    pub cost: f64,
    /// Whether the rest is guided.
    pub guided: bool,
}

/// Whether the trial guides this pixel.
pub(super) fn is_guided(x: u32, y: u32) -> bool {
    x % SPACING == 1 && y % SPACING == 2
}

/// What the pixels of one tile gave in the trial's pass.
pub(super) struct TileTrial {
    /// Sums of both halves of the pass, a pixel.
    halves: Vec<[f64; 2]>,
    /// Where the second half begins, and how many samples each has.
    middle: u32,
    half: f64,
    /// Unguided and guided.
    costs: [Cost; 2],
    /// Rays and guided events of the tile before the sample at hand.
    before: [u64; 2],
}

#[derive(Debug, Clone, Copy, Default)]
struct Cost {
    paths: u64,
    rays: u64,
    guided_events: u64,
}

impl TileTrial {
    /// Of a pass that takes every pixel of a tile from `first` to `end` samples.
    pub(super) fn new(tile: &Tile, first: u32, end: u32) -> Self {
        let half = (end - first) / 2;
        Self {
            halves: vec![[0.0; 2]; tile.len()],
            middle: first + half,
            half: f64::from(half),
            costs: [Cost::default(); 2],
            before: [0; 2],
        }
    }

    /// Adds sample number `sample` of pixel `index`; `statistics` are those of the tile in this pass so far.
    pub(super) fn add(
        &mut self,
        index: usize,
        sample: u32,
        path: &PathSample,
        is_guided: bool,
        statistics: &PathStatistics,
    ) {
        let radiance = f64::from(mean_component(path.record.radiance));
        if radiance.is_finite() {
            self.halves[index][usize::from(sample >= self.middle)] += radiance;
        }
        let counts = [statistics.rays(), statistics.guided_events];
        let cost = &mut self.costs[usize::from(is_guided)];
        cost.paths += 1;
        cost.rays += counts[0] - self.before[0];
        cost.guided_events += counts[1] - self.before[1];
        self.before = counts;
    }

    /// Appends the squared relative differences of the halves, to the unguided and to the guided pixels'. Relative to the
    /// tile: a pixel's own mean is part of its error.
    fn differences(&self, tile: &Tile, into: &mut [Vec<f64>; 2]) {
        let total: f64 = self.halves.iter().map(|[a, b]| a + b).sum();
        if total <= 0.0 {
            return;
        }
        let mean = total / (2.0 * self.half * self.halves.len() as f64);
        for (index, [a, b]) in self.halves.iter().enumerate() {
            let (x, y) = tile.pixel(index);
            let difference = (a - b) / (self.half * mean);
            into[usize::from(is_guided(x, y))].push(difference * difference);
        }
    }
}

/// What the tiles of `film` found, one entry a tile in its order. Guiding loses if there is nothing to compare.
pub(super) fn decide<'a>(film: &Film, trials: impl Iterator<Item = &'a TileTrial>) -> TrialResult {
    let mut differences = [Vec::new(), Vec::new()];
    let mut costs = [Cost::default(); 2];
    for (tile, trial) in film.tiles().iter().zip(trials) {
        trial.differences(tile, &mut differences);
        for (sum, cost) in costs.iter_mut().zip(trial.costs) {
            sum.paths += cost.paths;
            sum.rays += cost.rays;
            sum.guided_events += cost.guided_events;
        }
    }
    let has_enough = differences[1].len() >= FEWEST_PIXELS;
    let [unguided, guided] = differences.map(trimmed);
    let [plain, with_guide] =
        costs.map(|c| (c.rays as f64 + VERTEX_COST * c.guided_events as f64) / c.paths.max(1) as f64);
    let (error, cost) = (guided.value / unguided.value, with_guide / plain);
    let uncertainty = guided.relative_error.hypot(unguided.relative_error);
    let is_worth_it = error * (1.0 + CERTAINTY * uncertainty) * cost < WORTH_IT;
    TrialResult { error, uncertainty, cost, guided: has_enough && is_worth_it }
}

/// A mean, and its standard error relative to it.
struct Mean {
    value: f64,
    relative_error: f64,
}

/// The mean without the largest values.
fn trimmed(mut values: Vec<f64>) -> Mean {
    values.sort_unstable_by(f64::total_cmp);
    values.truncate(values.len() - values.len() * OUTLIERS_PER_MILLE / 1000);
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - value) * (v - value)).sum::<f64>() / (n - 1.0);
    Mean { value, relative_error: (variance / n).sqrt() / value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pixel_in_sixteen_is_guided() {
        let guided = (0..64).flat_map(|y| (0..64).map(move |x| (x, y))).filter(|&(x, y)| is_guided(x, y));
        assert_eq!(guided.count(), 64 * 64 / 16);
    }

    #[test]
    fn the_largest_values_do_not_count() {
        let mut values = vec![1.0; 1000];
        values[3] = 1e9;
        assert_eq!(trimmed(values).value, 1.0);
    }

    #[test]
    fn nothing_to_compare_means_no_guiding() {
        let film = Film::new(3, 1, &[]).unwrap();
        let trial = TileTrial::new(&film.tiles()[0], 16, 32);
        assert!(!decide(&film, std::iter::once(&trial)).guided);
    }
}

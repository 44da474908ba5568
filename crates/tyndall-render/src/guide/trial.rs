//! Which guides pay, by trying them.
//!
//! The guides learn from the first passes, which the plainest arm guides (nothing, if nothing was asked for by name). Then
//! one pass gives every other arm one pixel in sixteen. All pixels take their samples in two halves, each as stratified as
//! a pass is; the squared difference of the halves is the variance that an image has, stratification counted in (a guide
//! that lowers the variance of single samples may well lose that). The arm with the least error times cost stays, if that
//! is surely less than the plainest's, and guides that it does not use are forgotten.
//!
//! Costs are counts of rays, vertices and candidates, not seconds: the same settings give the same image on any machine.

use super::Arm;
use crate::film::{Film, Tile};
use crate::path::{PathSample, PathStatistics};
use serde::{Deserialize, Serialize};
use tyndall_math::mean_component;

/// Samples a pixel that teach before the trial, which is the pass after them.
pub(super) const FIRST_SAMPLE: u32 = 16;
/// Of every 4 x 4 pixels these try the arms after the first.
const PLACES: [[u32; 2]; 3] = [[1, 2], [3, 0], [1, 0]];
/// What asking the field for directions at an event costs, in rays, with what it takes to learn them: in the kitchen, the
/// jungle and underwater 1.36 to 1.39 explain the time.
const VERTEX_COST: f64 = 1.4;
/// What choosing by odds costs on a segment, in rays, the camera's included (the jungle says more, underwater less).
const ODDS_COST: f64 = 0.4;
/// What a candidate collision costs, in rays.
const CANDIDATE_COST: f64 = 0.1;
/// Error times cost must surely fall to this.
const WORTH_IT: f64 = 0.95;
/// "Surely": by so many standard errors of the error's ratio.
const CERTAINTY: f64 = 1.0;
/// Guided pixels without which nothing is sure: the standard error of a few heavy-tailed numbers means nothing.
const FEWEST_PIXELS: usize = 256;
/// Pixels with the largest errors, of a thousand, that no arm counts: fireflies would decide.
const OUTLIERS_PER_MILLE: usize = 5;

/// What a trial found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TrialResult {
    /// All arms but the plainest.
    pub arms: Vec<ArmResult>,
    /// What guides the rest of the render.
    pub chosen: Arm,
}

/// How an arm compares to the plainest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct ArmResult {
    /// What it is.
    pub arm: Arm,
    /// Ratio of the squared errors after equally many samples.
    pub error: f64,
    /// Standard error of that ratio, relative to it.
    pub uncertainty: f64,
    /// Ratio of the costs of a sample.
    pub cost: f64,
}

/// The number of the arm, of `n_arms`, that a pixel tries.
pub(super) fn arm_of(x: u32, y: u32, n_arms: usize) -> usize {
    let here = [x % 4, y % 4];
    let place = PLACES.iter().take(n_arms - 1).position(|&place| place == here);
    place.map_or(0, |place| place + 1)
}

/// What the pixels of one tile gave in the trial's pass.
pub(super) struct TileTrial {
    /// Sums of both halves of the pass, a pixel.
    halves: Vec<[f64; 2]>,
    /// Where the second half begins, and how many samples each has.
    middle: u32,
    half: f64,
    /// One entry an arm.
    costs: Vec<Cost>,
    /// Counts of the tile before the sample at hand.
    before: Cost,
}

/// Counts that cost time.
#[derive(Debug, Clone, Copy, Default)]
struct Cost {
    paths: u64,
    rays: u64,
    guided_events: u64,
    guided_segments: u64,
    candidates: u64,
}

impl Cost {
    fn of(statistics: &PathStatistics) -> Self {
        Self {
            paths: statistics.paths,
            rays: statistics.rays(),
            guided_events: statistics.guided_events,
            guided_segments: statistics.guided_segments,
            candidates: statistics.walks.candidates,
        }
    }

    /// Adds what there is in `after` beyond `before`.
    fn add(&mut self, after: &Self, before: &Self) {
        self.paths += after.paths - before.paths;
        self.rays += after.rays - before.rays;
        self.guided_events += after.guided_events - before.guided_events;
        self.guided_segments += after.guided_segments - before.guided_segments;
        self.candidates += after.candidates - before.candidates;
    }

    /// Of a path, in rays.
    fn mean(&self) -> f64 {
        let rays = self.rays as f64
            + VERTEX_COST * self.guided_events as f64
            + ODDS_COST * self.guided_segments as f64
            + CANDIDATE_COST * self.candidates as f64;
        rays / self.paths.max(1) as f64
    }
}

impl TileTrial {
    /// Of a pass that takes every pixel of a tile from `first` to `end` samples.
    pub(super) fn new(tile: &Tile, first: u32, end: u32, n_arms: usize) -> Self {
        let half = (end - first) / 2;
        Self {
            halves: vec![[0.0; 2]; tile.len()],
            middle: first + half,
            half: f64::from(half),
            costs: vec![Cost::default(); n_arms],
            before: Cost::default(),
        }
    }

    /// Adds sample number `sample` of pixel `index`; `statistics` are those of the tile in this pass so far.
    pub(super) fn add(
        &mut self,
        index: usize,
        sample: u32,
        path: &PathSample,
        arm: usize,
        statistics: &PathStatistics,
    ) {
        let radiance = f64::from(mean_component(path.record.radiance));
        if radiance.is_finite() {
            self.halves[index][usize::from(sample >= self.middle)] += radiance;
        }
        let counts = Cost::of(statistics);
        self.costs[arm].add(&counts, &self.before);
        self.before = counts;
    }

    /// Appends the squared relative differences of the halves, to those of its arm. Relative to the
    /// tile: a pixel's own mean is part of its error.
    fn differences(&self, tile: &Tile, into: &mut [Vec<f64>]) {
        let total: f64 = self.halves.iter().map(|[a, b]| a + b).sum();
        if total <= 0.0 {
            return;
        }
        let mean = total / (2.0 * self.half * self.halves.len() as f64);
        for (index, [a, b]) in self.halves.iter().enumerate() {
            let (x, y) = tile.pixel(index);
            let difference = (a - b) / (self.half * mean);
            into[arm_of(x, y, self.costs.len())].push(difference * difference);
        }
    }
}

/// What the tiles of `film` found, one entry a tile in its order. The first arm wins if there is nothing to compare.
pub(super) fn decide<'a>(
    film: &Film,
    arms: &[Arm],
    trials: impl Iterator<Item = &'a TileTrial>,
) -> TrialResult {
    let mut differences = vec![Vec::new(); arms.len()];
    let mut costs = vec![Cost::default(); arms.len()];
    for (tile, trial) in film.tiles().iter().zip(trials) {
        trial.differences(tile, &mut differences);
        for (sum, cost) in costs.iter_mut().zip(&trial.costs) {
            sum.add(cost, &Cost::default());
        }
    }
    let has_enough = differences[1..].iter().all(|of_arm| of_arm.len() >= FEWEST_PIXELS);
    let errors: Vec<Mean> = differences.into_iter().map(trimmed).collect();
    let compare = |number: usize| ArmResult {
        arm: arms[number],
        error: errors[number].value / errors[0].value,
        uncertainty: errors[number].relative_error.hypot(errors[0].relative_error),
        cost: costs[number].mean() / costs[0].mean(),
    };
    let results: Vec<ArmResult> = (1..arms.len()).map(compare).collect();
    let worth = |result: &ArmResult| result.error * result.cost;
    let is_worth_it = |result: &&ArmResult| worth(result) * (1.0 + CERTAINTY * result.uncertainty) < WORTH_IT;
    let best = results
        .iter()
        .filter(is_worth_it)
        .min_by(|a, b| worth(a).total_cmp(&worth(b)))
        .filter(|_| has_enough);
    TrialResult { chosen: best.map_or(arms[0], |best| best.arm), arms: results }
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
    fn one_pixel_in_sixteen_tries_each_arm() {
        let mut counts = [0; 4];
        (0..64).flat_map(|y| (0..64).map(move |x| (x, y))).for_each(|(x, y)| counts[arm_of(x, y, 4)] += 1);
        assert_eq!(counts, [13 * 256, 256, 256, 256]);
        assert!((0..16).all(|i| arm_of(i % 4, i / 4, 2) < 2));
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
        let trial = TileTrial::new(&film.tiles()[0], 16, 32, 2);
        let arms = [Arm::default(), Arm { directions: true, odds: false }];
        assert_eq!(decide(&film, &arms, std::iter::once(&trial)).chosen, Arm::default());
    }
}

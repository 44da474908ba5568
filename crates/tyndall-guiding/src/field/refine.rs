//! Which samples belong to which region, and the cutting of regions that got many.

use super::{FieldSettings, Region, TrainingSample};
use rayon::prelude::*;

/// What a new region keeps of the former one's statistics.
const KEPT: f32 = 0.25;
/// A plane is put through no fewer samples than this.
const MIN_CLOUD: usize = 32;
/// Samples per task. The tasks do not enter the result: each sample's region is found on its own.
const CHUNK: usize = 8192;

/// Where samples lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cloud {
    pub(super) mean: [f32; 3],
    /// Standard deviation per axis.
    pub(super) deviation: [f32; 3],
}

impl Cloud {
    fn of(samples: &[TrainingSample], group: &[u32]) -> Self {
        let mut sums = [(0.0f64, 0.0f64); 3];
        // Relative to the first one: a small cloud far from the origin must not cancel.
        let origin = group.first().map_or([0.0; 3], |&i| samples[i as usize].position);
        for &i in group {
            for axis in 0..3 {
                let v = f64::from(samples[i as usize].position[axis]) - f64::from(origin[axis]);
                sums[axis] = (sums[axis].0 + v, sums[axis].1 + v * v);
            }
        }
        let n = group.len().max(1) as f64;
        let mean = |axis: usize| (f64::from(origin[axis]) + sums[axis].0 / n) as f32;
        let deviation = |axis: usize| (sums[axis].1 / n - (sums[axis].0 / n).powi(2)).max(0.0).sqrt() as f32;
        Self { mean: [0, 1, 2].map(mean), deviation: [0, 1, 2].map(deviation) }
    }

    fn widest_axis(&self) -> usize {
        let d = &self.deviation;
        (1..3).fold(0, |widest, axis| if d[axis] > d[widest] { axis } else { widest })
    }
}

/// What becomes of a region.
pub(super) enum Plan {
    /// It stays one, with these samples.
    Leaf { samples: Vec<u32>, narrowing: Option<Narrowing> },
    /// It is cut; the parts are below and above the plane.
    Cut { axis: usize, plane: f32, parts: Box<[Plan; 2]> },
}

/// What a new region is to become.
pub(super) struct Narrowing {
    pub(super) cloud: Cloud,
    pub(super) depth: u32,
    /// What it keeps of the former region's samples.
    pub(super) factor: f32,
}

/// The samples of each of `n` regions, in their order: a stable counting sort by `region_of`.
pub(super) fn assign(
    samples: &[TrainingSample],
    n: usize,
    region_of: impl Fn(&TrainingSample) -> Option<usize> + Sync,
) -> Vec<Vec<u32>> {
    let nowhere = n as u32;
    let key = |s: &TrainingSample| region_of(s).map_or(nowhere, |region| region as u32);
    let keys: Vec<u32> = samples.par_iter().with_min_len(CHUNK).map(key).collect();
    let mut counts = vec![0usize; n + 1];
    keys.iter().for_each(|&key| counts[key as usize] += 1);
    let mut groups: Vec<Vec<u32>> = counts[..n].iter().map(|&count| Vec::with_capacity(count)).collect();
    for (i, &key) in keys.iter().enumerate().filter(|(_, key)| **key != nowhere) {
        groups[key as usize].push(i as u32);
    }
    groups
}

/// Cuts a region as often as its samples ask for.
pub(super) fn plan_region(
    samples: &[TrainingSample],
    group: Vec<u32>,
    region: &Region,
    settings: &FieldSettings,
) -> Plan {
    let former = Former {
        n_samples: region.n_samples,
        weights: region.statistics.weights(),
        depth: region.depth,
        factor: 1.0,
    };
    let is_new = region.n_samples == 0.0;
    former.plan(samples, group, is_new, settings)
}

/// The region that a part was cut from.
#[derive(Clone, Copy)]
struct Former {
    n_samples: f32,
    /// Σw and Σw².
    weights: [f64; 2],
    depth: u32,
    factor: f32,
}

impl Former {
    /// Whether there are so many samples, with these, that parts have enough.
    fn is_crowded(&self, samples: &[TrainingSample], group: &[u32], settings: &FieldSettings) -> bool {
        let [mut sum, mut squares] = self.weights;
        for &i in group {
            let w = f64::from(samples[i as usize].light());
            (sum, squares) = (sum + w, squares + w * w);
        }
        // False without light.
        let is_well_lit = sum * sum > f64::from(settings.effective_samples) * squares;
        is_well_lit || self.n_samples + group.len() as f32 > settings.region_samples as f32
    }

    fn plan(
        self,
        samples: &[TrainingSample],
        group: Vec<u32>,
        is_new: bool,
        settings: &FieldSettings,
    ) -> Plan {
        let may_cut = group.len() >= MIN_CLOUD
            && self.depth < settings.max_depth
            && self.is_crowded(samples, &group, settings);
        if !(may_cut || is_new) {
            return Plan::Leaf { samples: group, narrowing: None };
        }
        let cloud = Cloud::of(samples, &group);
        let axis = cloud.widest_axis();
        let plane = cloud.mean[axis];
        let is_below = |i: &u32| samples[*i as usize].position[axis] < plane;
        let n_below = if may_cut { group.iter().filter(|i| is_below(i)).count() } else { 0 };
        if n_below == 0 || n_below == group.len() {
            let narrowing = Narrowing { cloud, depth: self.depth, factor: self.factor };
            return Plan::Leaf { samples: group, narrowing: is_new.then_some(narrowing) };
        }
        let (below, above): (Vec<u32>, Vec<u32>) = group.into_iter().partition(is_below);
        let part = Self {
            n_samples: self.n_samples * KEPT,
            weights: self.weights.map(|w| w * f64::from(KEPT)),
            depth: self.depth + 1,
            factor: self.factor * KEPT,
        };
        let plan = |group: Vec<u32>| part.plan(samples, group, true, settings);
        let (below, above) = rayon::join(|| plan(below), || plan(above));
        Plan::Cut { axis, plane, parts: Box::new([below, above]) }
    }
}

//! Lobes that are alike become one, with all that was learned of them.
//!
//! They are merged in a list: while two regions become one, there are more of them than a region can hold.

use super::Region;
use super::region::LobeMoments;
use crate::directional::{
    PerLobe, SufficientStatistics, VmfLobe, VmfMixture, merged, merging_divergence, normalise,
};

/// The divergence below which two lobes become one. The published 0.025 merges lights of a few per cent with what is
/// around them (`examples/guided_balls.rs`: up to twice the variance).
const MERGE_BELOW: f64 = 0.001;

/// A lobe with its part of every sum.
#[derive(Debug, Clone, Copy)]
struct LearnedLobe {
    weight: f32,
    lobe: VmfLobe,
    statistics: [f32; SufficientStatistics::ROWS],
    moments: [f32; LobeMoments::ROWS],
}

impl LearnedLobe {
    fn absorb(&mut self, other: &Self) {
        (self.weight, self.lobe) = merged((self.weight, self.lobe), (other.weight, other.lobe));
        self.statistics.iter_mut().zip(other.statistics).for_each(|(sum, more)| *sum += more);
        self.moments.iter_mut().zip(other.moments).for_each(|(sum, more)| *sum += more);
    }
}

/// All lobes of one region, or of two.
#[derive(Debug, Clone)]
pub(super) struct LearnedLobes(Vec<LearnedLobe>);

impl LearnedLobes {
    pub(super) fn of(region: &Region) -> Self {
        let (sums, _) = region.statistics.parts();
        let learned = |(k, (weight, lobe)): (usize, (f32, VmfLobe))| LearnedLobe {
            weight,
            lobe,
            statistics: sums.each_ref().map(|row| row[k]),
            moments: region.moments.0.each_ref().map(|row| row[k]),
        };
        Self(region.mixture.lobes().enumerate().map(learned).collect())
    }

    /// These and behind them the `others`, which have this `part` of the light of both.
    pub(super) fn and(mut self, others: Self, part: f32) -> Self {
        self.0.iter_mut().for_each(|lobe| lobe.weight *= 1.0 - part);
        self.0.extend(others.0.into_iter().map(|lobe| LearnedLobe { weight: lobe.weight * part, ..lobe }));
        // What is left of next to nothing.
        self.0.retain(|lobe| lobe.weight > 0.0);
        self.normalise();
        self
    }

    fn normalise(&mut self) {
        normalise(self.0.iter_mut().map(|lobe| &mut lobe.weight));
    }

    /// Merges pairs, the most alike first, as long as one lobe can stand for both. Says whether there were any.
    pub(super) fn merge_similar(&mut self) -> bool {
        self.merge_pairs(|cost, _| cost < MERGE_BELOW)
    }

    /// Merges pairs, the most alike first, until there are no more than `most`.
    pub(super) fn merge_down_to(&mut self, most: usize) {
        self.merge_pairs(|_, n| n > most);
    }

    /// Merges the pair that costs least as long as `goes_on` says so of that cost and the number of lobes.
    fn merge_pairs(&mut self, goes_on: impl Fn(f64, usize) -> bool) -> bool {
        let lobes = &mut self.0;
        let before = lobes.len();
        // What merging costs, for each lobe with those before it.
        let mut costs: Vec<Vec<f64>> = (0..before).map(|of| costs_of(lobes, of)).collect();
        while let Some((cost, to, from)) = most_alike(&costs)
            && goes_on(cost, lobes.len())
        {
            let gone = lobes[from];
            lobes[to].absorb(&gone);
            lobes.swap_remove(from);
            costs.pop();
            for changed in [to, from].into_iter().filter(|&k| k < lobes.len()) {
                costs[changed] = costs_of(lobes, changed);
                for later in changed + 1..lobes.len() {
                    costs[later][changed] = cost_of(&lobes[changed], &lobes[later]);
                }
            }
        }
        let has_merged = lobes.len() < before;
        if has_merged {
            self.normalise();
        }
        has_merged
    }

    /// Makes these the lobes of `region`, which must have room for them.
    pub(super) fn put_into(&self, region: &mut Region) {
        let row = |of: &dyn Fn(&LearnedLobe) -> f32| PerLobe::from_first(self.0.iter().map(of));
        let mean = |axis: usize| row(&|l| l.lobe.mean()[axis]);
        let mixture = [row(&|l| l.weight), row(&|l| l.lobe.kappa()), mean(0), mean(1), mean(2)];
        region.mixture = VmfMixture::from_rows(self.0.len(), mixture);
        let (_, totals) = region.statistics.parts();
        let statistics = std::array::from_fn(|i| row(&|l| l.statistics[i]));
        region.statistics = SufficientStatistics::from_parts(statistics, totals);
        region.moments.0 = std::array::from_fn(|i| row(&|l| l.moments[i]));
    }
}

/// Merges the lobes of `region` that one can stand for.
pub(super) fn merge_similar(region: &mut Region) {
    let mut lobes = LearnedLobes::of(region);
    if lobes.merge_similar() {
        lobes.put_into(region);
    }
}

fn cost_of(one: &LearnedLobe, other: &LearnedLobe) -> f64 {
    merging_divergence((one.weight, one.lobe), (other.weight, other.lobe))
}

fn costs_of(lobes: &[LearnedLobe], of: usize) -> Vec<f64> {
    lobes[..of].iter().map(|other| cost_of(other, &lobes[of])).collect()
}

/// What merging costs least, and of which pair; the lower number first.
fn most_alike(costs: &[Vec<f64>]) -> Option<(f64, usize, usize)> {
    let pairs = costs
        .iter()
        .enumerate()
        .flat_map(|(from, row)| row.iter().enumerate().map(move |(to, c)| (*c, to, from)));
    pairs.min_by(|a, b| a.0.total_cmp(&b.0))
}

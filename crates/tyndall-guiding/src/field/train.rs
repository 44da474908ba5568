//! What a region learns from the samples of a pass.

use super::adapt::split_poor;
use super::parallax::Observation;
use super::region::{from_values, values_of};
use super::similar::merge_similar;
use super::{FieldSettings, Region, TrainingSample};
use crate::Moments;
use crate::directional::{Assigner, Assignment, LobeSums, PerLobe, fit_incrementally};
use glam::Vec3A;

/// Distances count as no less than this part of the region's radius: its samples cannot share nearer parallax.
const MIN_DISTANCE: f32 = 0.1;
/// Rounds of splitting lobes per update, each followed by some steps of fitting.
const SPLIT_ROUNDS: usize = 3;
const STEPS_AFTER_SPLIT: usize = 4;
/// As good as no limit for outliers.
const NO_LIMIT: f32 = 1e30;
/// Samples per partial sum.
const CHUNK: usize = 4096;

/// Learns from the samples whose numbers are in `group`.
pub(super) fn train(
    region: &mut Region,
    samples: &[TrainingSample],
    group: &[u32],
    settings: &FieldSettings,
) {
    if group.is_empty() {
        return;
    }
    fit_lobes(region, &observe(region, samples, group), group.len(), settings);
    add_moments(region, samples, group);
    region.n_samples += group.len() as f32;
}

/// The samples that saw light, as seen from the pivot.
fn observe(region: &Region, samples: &[TrainingSample], group: &[u32]) -> Vec<Observation> {
    let pivot = Vec3A::from(region.pivot);
    let min_distance = min_distance(region);
    let observations = group.iter().map(|&i| Observation::new(&samples[i as usize], pivot, min_distance));
    observations.filter(|o| o.light.is_usable()).collect()
}

fn min_distance(region: &Region) -> f32 {
    MIN_DISTANCE * Vec3A::from(region.spread).length()
}

fn fit_lobes(region: &mut Region, observations: &[Observation], n: usize, settings: &FieldSettings) {
    let lights: Vec<_> = observations.iter().map(|o| o.light).collect();
    let fit = |region: &mut Region, steps: usize| {
        let (mut latest, _) = fit_incrementally(&mut region.mixture, &region.statistics, &lights, steps);
        latest.count_dark(n - lights.len());
        latest
    };
    let mut latest = fit(region, settings.max_iterations as usize);
    for _ in 0..SPLIT_ROUNDS {
        if !split_poor(region, observations, &latest, settings.max_lobes as usize) {
            break;
        }
        latest = fit(region, STEPS_AFTER_SPLIT);
    }
    region.statistics.merge(&latest);
    merge_similar(region);
    region.inverse_distance = region.statistics.inverse_distances();
    region.set_background_distance();
}

/// The odds learn from dark samples as well.
fn add_moments(region: &mut Region, samples: &[TrainingSample], group: &[u32]) {
    let limits = outlier_limits(region);
    let (pivot, min_distance) = (Vec3A::from(region.pivot), min_distance(region));
    let assigner = Assigner::new(&region.mixture);
    for chunk in group.chunks(CHUNK) {
        let mut sums = LobeSums::default();
        for sample in chunk.iter().map(|&i| &samples[i as usize]) {
            let direction = Observation::new(sample, pivot, min_distance).light.direction;
            let Some(Assignment { shares, .. }) = assigner.assign(direction) else { continue };
            let [limit] = limits.blend(&shares, assigner.n_groups());
            if let Some(moments) = Moments::of(&sample.segment(), limit) {
                sums.add(&shares, assigner.n_groups(), &values_of(&moments));
            }
        }
        region.moments.merge(&sums);
    }
}

/// Above which the light of each lobe is an outlier, by earlier updates. Not by region: a small light would be one.
fn outlier_limits(region: &Region) -> LobeSums<1> {
    let mut limits = LobeSums([PerLobe::ZERO]);
    for k in 0..region.mixture.len() {
        let lobe = from_values(region.moments.0.each_ref().map(|sums| sums[k]));
        // Limits are averaged: one that is missing must not be infinite.
        limits.0[0][k] = lobe.outlier_limit().min(NO_LIMIT);
    }
    limits
}

#[cfg(test)]
#[path = "train_tests.rs"]
mod tests;

//! Two fields that learned apart become one, as if one had learned from the samples of both.
//!
//! The finer tree stays. Each of its regions takes over the region of the other field that it lies in: lobes are moved to
//! its middle, and what they stand for is *added*, sum by sum; where several regions lie in the same one, they share it by
//! their samples. Lobes that say the same are merged, and more of them while there are too many.

use super::parallax::seen_from;
use super::similar::LearnedLobes;
use super::tree::Tree;
use super::{Field, Region};
use glam::Vec3A;
use rayon::prelude::*;

impl Field {
    /// Adds what `other` learned in the same space. Which field is merged into which changes the result by as much as
    /// cutting space elsewhere does.
    pub fn merge(&mut self, other: &Self) {
        let most = self.settings.max_lobes as usize;
        for (mine, others) in [(&mut self.surface, &other.surface), (&mut self.volume, &other.volume)] {
            if mine.regions.len() >= others.regions.len() {
                mine.absorb(others, most);
            } else {
                let coarser = std::mem::replace(mine, others.clone());
                mine.absorb(&coarser, most);
            }
        }
        self.statistics.n_samples = self.statistics.n_samples.saturating_add(other.statistics.n_samples);
        self.statistics.n_rejected = self.statistics.n_rejected.saturating_add(other.statistics.n_rejected);
        self.statistics.n_updates = self.statistics.n_updates.saturating_add(other.statistics.n_updates);
    }
}

impl Tree {
    /// Adds the regions of a coarser tree.
    fn absorb(&mut self, other: &Self, max_lobes: usize) {
        if other.regions.is_empty() {
            return;
        }
        let mut partners: Vec<Vec<(usize, f32)>> =
            self.regions.iter().map(|region| vec![(other.region_at(region.pivot.into()), 1.0)]).collect();
        let mut totals = vec![0.0; other.regions.len()];
        for (region, partner) in self.regions.iter().zip(&partners) {
            totals[partner[0].0] += region.n_samples;
        }
        for (region, partner) in self.regions.iter().zip(&mut partners) {
            let total = totals[partner[0].0];
            partner[0].1 = if total > 0.0 { (region.n_samples / total).min(1.0) } else { 0.0 };
        }
        // Where no region of ours has its middle.
        for (i, region) in other.regions.iter().enumerate().filter(|(i, _)| totals[*i] == 0.0) {
            partners[self.region_at(region.pivot.into())].push((i, 1.0));
        }
        self.regions.par_iter_mut().zip(partners).for_each(|(region, partners)| {
            for (partner, share) in partners {
                region.absorb(&other.regions[partner], share, max_lobes);
            }
        });
    }
}

impl Region {
    /// Adds `share` of what `other` learned.
    pub(super) fn absorb(&mut self, other: &Self, share: f32, max_lobes: usize) {
        let mut other = other.clone();
        other.move_to(self.pivot.into());
        other.statistics.decay(share);
        other.moments.scale(share);
        let mut lobes = LearnedLobes::of(self);
        let light = |region: &Self| region.statistics.weights()[0] as f32;
        let (mine, others) = (light(self), light(&other));
        if others > 0.0 && mine + others < f32::MAX {
            lobes = lobes.and(LearnedLobes::of(&other), others / (mine + others));
            self.statistics.add_totals(&other.statistics);
        } else {
            self.statistics.count_dark(other.statistics.n_samples() as usize);
        }
        self.n_samples += share * other.n_samples;
        lobes.merge_similar();
        lobes.merge_down_to(max_lobes);
        lobes.put_into(self);
        self.inverse_distance = self.statistics.inverse_distances();
        self.set_background_distance();
    }

    /// The same light as seen from another place.
    pub(super) fn move_to(&mut self, pivot: Vec3A) {
        let offset = Vec3A::from(self.pivot) - pivot;
        self.mixture = seen_from(&self.mixture, &self.inverse_distance, offset).0;
        for (k, (_, lobe)) in self.mixture.lobes().enumerate() {
            self.statistics.aim(k, &lobe);
        }
        self.pivot = pivot.into();
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{teach, trained_field};
    use super::*;
    use crate::EventClass;
    use crate::directional::VmfMixture;

    fn taught(times: usize) -> Field {
        let mut field = trained_field();
        (0..times).for_each(|_| teach(&mut field));
        field
    }

    fn mass(field: &Field, class: EventClass) -> [f64; 3] {
        let (_, regions) = field.parts(class);
        let sum = |of: &dyn Fn(&Region) -> f32| regions.iter().map(|r| f64::from(of(r))).sum::<f64>();
        [sum(&|r| r.n_samples), sum(&|r| r.statistics.n_samples()), sum(&|r| r.moments().n)]
    }

    #[test]
    fn sums_add_up() {
        let (one, other) = (taught(0), taught(2));
        for (first, second) in [(&one, &other), (&other, &one)] {
            let mut merged = first.clone();
            merged.merge(second);
            for class in [EventClass::Surface, EventClass::Volume] {
                let (a, b, c) = (mass(first, class), mass(second, class), mass(&merged, class));
                for i in 0..3 {
                    assert!(
                        ((a[i] + b[i]) / c[i] - 1.0).abs() < 1e-3,
                        "{class:?} {i}: {} + {} = {}",
                        a[i],
                        b[i],
                        c[i]
                    );
                }
            }
            assert_eq!(
                merged.statistics().n_samples,
                one.statistics().n_samples + other.statistics().n_samples
            );
        }
    }

    #[test]
    fn a_field_merged_with_itself_says_the_same() {
        let field = taught(1);
        let mut twice = field.clone();
        twice.merge(&field);
        let (_, before) = field.parts(EventClass::Volume);
        let (_, after) = twice.parts(EventClass::Volume);
        assert_eq!(before.len(), after.len());
        let directions = VmfMixture::spread(24);
        let mut difference = 0.0;
        for (a, b) in before.iter().zip(after) {
            assert!((b.n_samples / a.n_samples - 2.0).abs() < 1e-3);
            let pdfs = directions.lobes().map(|(_, lobe)| [a, b].map(|r| r.lobes().pdf(lobe.mean())));
            let of = |[x, y]: [f32; 2]| f64::from((x - y).abs() / (x + y));
            difference += pdfs.map(of).sum::<f64>() / 24.0 / before.len() as f64;
        }
        assert!(difference < 0.02, "{difference}");
    }

    #[test]
    fn nothing_changes_nothing() {
        let field = taught(0);
        let (mut merged, empty) = (field.clone(), Field::new(*field.settings()));
        merged.merge(&empty);
        assert!(merged == field);
        let mut from_empty = empty;
        from_empty.merge(&field);
        assert!(from_empty == field);
    }
}
